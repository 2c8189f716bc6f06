//! Reference designations of equipment (IEC 81346-1): the nearest of several places, and
//! what is within another.

/// Returns the items whose ids share the most leading designations with an id; several where
/// they are equally near.
pub fn nearest<'a, T: Clone>(id: &str, items: &'a [T], id_of: impl Fn(&'a T) -> &'a str) -> Vec<T> {
    let shared = |item: &'a T| {
        let pairs = designations(id).into_iter().zip(designations(id_of(item)));
        pairs.take_while(|(a, b)| a == b).count()
    };
    let most = items.iter().map(shared).max().unwrap_or(0);
    items.iter().filter(|item| shared(item) == most).cloned().collect()
}

/// Reports whether an id is a designation, or begins with it.
pub fn is_within(id: &str, designation: &str) -> bool {
    designations(id).starts_with(&designations(designation))
}

/// Splits an id into designations: `=S12D1Q3-QB1` into `=S12`, `D1`, `Q3`, `-QB1`. Each is
/// letters with the digits that follow them.
fn designations(id: &str) -> Vec<&str> {
    let mut starts = Vec::new();
    let mut before = '0';
    for (at, letter) in id.char_indices() {
        let begins = match letter {
            letter if letter.is_ascii_digit() => false,
            letter if letter.is_alphabetic() => before.is_ascii_digit(),
            _ => true,
        };
        if begins || at == 0 {
            starts.push(at);
        }
        before = letter;
    }
    let ends = starts.iter().skip(1).copied().chain([id.len()]);
    starts.iter().zip(ends).map(|(start, end)| &id[*start..end]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn designations_are_whole() {
        assert_eq!(designations("=S12D1Q3-QB1"), ["=S12", "D1", "Q3", "-QB1"]);
        assert_eq!(designations("220-L1-QF"), ["220", "-L1", "-QF"]);
        let near = |id| nearest(id, &["=Q1-B1", "=Q10-B1", "=Q2-B1"], |id| id);
        assert_eq!(near("=Q1-QA1"), ["=Q1-B1"], "=Q10 is another bay");
        assert_eq!(near("=Q3-QA1").len(), 3, "none is nearer");
        assert!(nearest("", &[] as &[&str], |id| id).is_empty());
        assert!(is_within("=Q1-QB1-L1", "=Q1") && !is_within("=Q10-QB1-L1", "=Q1"));
    }
}
