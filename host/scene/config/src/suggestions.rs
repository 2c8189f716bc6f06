//! "Did you mean": the nearest of the names that exist.

use strsim::osa_distance;

/// The most names one suggestion compares.
const MAX_CANDIDATES: usize = 2_000;
/// The most names listed where none is near.
const MAX_LISTED: usize = 8;
/// The longest part of a value that a message shows, in characters.
const MAX_SHOWN_CHARS: usize = 60;

/// Suggests a replacement for `name`: the nearest of `known`, or a choice of them. The result is
/// `otherwise` where there are too many to list, or none.
pub(crate) fn remedy<'k>(
    name: &str,
    known: impl Iterator<Item = &'k str> + Clone,
    otherwise: impl FnOnce() -> String,
) -> String {
    if let Some(nearest) = nearest(name, known.clone()) {
        return format!("did you mean '{}'?", shown(nearest));
    }
    let names: Vec<String> =
        known.take(MAX_LISTED + 1).map(|n| format!("'{}'", shown(n))).collect();
    match names.len() {
        1..=MAX_LISTED => format!("write one of {}", names.join(", ")),
        _ => otherwise(),
    }
}

/// A text cut to what fits a message, without control characters.
pub(crate) fn shown(text: &str) -> String {
    let cut: String = text.chars().take(MAX_SHOWN_CHARS).flat_map(escape_control).collect();
    if text.chars().nth(MAX_SHOWN_CHARS).is_some() { format!("{cut}...") } else { cut }
}

fn escape_control(letter: char) -> Vec<char> {
    if letter.is_control() { letter.escape_default().collect() } else { vec![letter] }
}

/// The name that needs the fewest edits, at most a third of its length.
pub(crate) fn nearest<'k>(name: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    let length = name.chars().count();
    let most_edits = (length / 3).max(1);
    let lower = name.to_lowercase();
    known
        .take(MAX_CANDIDATES)
        .filter(|candidate| candidate.chars().count().abs_diff(length) <= most_edits)
        .map(|candidate| (osa_distance(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(edits, _)| *edits <= most_edits)
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, known: &[&str], expected: &str) {
        assert_eq!(remedy(name, known.iter().copied(), || "none".into()), expected);
    }

    #[test]
    fn near_names_are_suggested_and_far_ones_are_not() {
        check("lables", &["labels", "plc"], "did you mean 'labels'?");
        check("PLC", &["labels", "plc"], "did you mean 'plc'?");
        check("x", &["labels", "plc"], "write one of 'labels', 'plc'");
        check("x", &[], "none");
        check("x", &["label"; 9], "none");
    }

    #[test]
    fn shown_texts_are_short_and_printable() {
        assert_eq!(shown("a\u{7}b"), "a\\u{7}b");
        assert_eq!(shown(&"é".repeat(61)), format!("{}...", "é".repeat(60)));
    }
}
