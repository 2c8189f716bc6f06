//! Layouts of channel lines: those of the editions, and what recorders make of them.
//!
//! The numbers of a line stand at its end and tell the layout, whatever revision the file names.
//! The fields in front of them are names, which may have commas.

use super::fields::Fields;
use super::revision::Revision;

/// Fields at the end of an analogue line: a, b, skew, min, max, and then primary, secondary, PS.
const TAIL: usize = 8;
/// Fields at the end of an analogue line without PS.
const TAIL_WITHOUT_SIDE: usize = 7;
/// Fields at the end of an analogue line of 1991.
const TAIL_1991: usize = 5;
/// Names of an analogue line: `ch_id`, `ph`, `ccbm`, `uu`.
const ANALOG_NAMES: usize = 4;
/// Fields of a digital line, and those of 1991.
const DIGITAL_FIELDS: usize = 5;
const DIGITAL_FIELDS_1991: usize = 3;

/// Difference of a line from the layout of its revision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Oddity {
    /// Commas at the end.
    TrailingCommas,
    /// The layout of another edition.
    OtherEdition,
    /// A name with commas.
    CommaInName,
}

impl Oddity {
    /// The difference for a remark.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::TrailingCommas => "has commas at its end",
            Self::OtherEdition => "has the layout of another edition",
            Self::CommaInName => "has a name with commas",
        }
    }
}

/// Fields of a channel line by their meaning.
pub(super) struct ChannelFields<'a> {
    /// Identifier, with its commas.
    pub(super) id: String,
    /// Fields after the names; that of a digital line is its normal state.
    pub(super) tail: Vec<&'a str>,
    /// Unit of an analogue channel.
    pub(super) unit: &'a str,
    pub(super) oddity: Option<Oddity>,
}

/// Finds the fields of an analogue line; nothing where it has no layout.
pub(super) fn analog<'a>(fields: &Fields<'a>, revision: Revision) -> Option<ChannelFields<'a>> {
    let own = if revision == Revision::Of1991 { TAIL_1991 } else { TAIL };
    let mut tails = vec![own];
    tails.extend([TAIL, TAIL_WITHOUT_SIDE, TAIL_1991].into_iter().filter(|tail| *tail != own));
    let all = fields.all();
    let blank = all.iter().rev().take_while(|field| field.is_empty()).count();
    // Names without commas first, then as few fields cut off as possible.
    for has_commas in [false, true] {
        for cut in 0..=blank {
            let kept = all.get(..all.len() - cut)?;
            for &tail in &tails {
                let Some(names) = kept.len().checked_sub(tail + 1) else { continue };
                let fits = if has_commas { names > ANALOG_NAMES } else { names == ANALOG_NAMES };
                let (front, numbers) = kept.split_at(kept.len() - tail);
                // A unit that is a number is a field of the end, which has one too many.
                let is_shifted = front.last().is_some_and(|unit| is_number(unit));
                if !fits || is_shifted || !are_numbers(numbers) {
                    continue;
                }
                let oddity = match (has_commas, tail == own, cut) {
                    (true, ..) => Some(Oddity::CommaInName),
                    (_, false, _) => Some(Oddity::OtherEdition),
                    (_, _, 1..) => Some(Oddity::TrailingCommas),
                    _ => None,
                };
                let id = front.get(1..front.len() + 1 - ANALOG_NAMES)?.join(",");
                let unit = front.last().copied().unwrap_or_default();
                return Some(ChannelFields { id, tail: numbers.to_vec(), unit, oddity });
            }
        }
    }
    None
}

/// Reports the end of an analogue line: a number, then numbers or nothing, then a side.
fn are_numbers(fields: &[&str]) -> bool {
    let (numbers, side) = match fields.get(TAIL - 1) {
        Some(side) => (fields.get(..TAIL - 1).unwrap_or_default(), *side),
        None => (fields, ""),
    };
    numbers.first().is_some_and(|a| is_number(a))
        && numbers.iter().all(|text| text.is_empty() || is_number(text))
        && matches!(side, "" | "P" | "p" | "S" | "s")
}

fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok_and(f64::is_finite)
}

/// Finds the fields of a digital line; nothing where it has no name.
pub(super) fn digital<'a>(fields: &Fields<'a>, revision: Revision) -> Option<ChannelFields<'a>> {
    let own = if revision == Revision::Of1991 { DIGITAL_FIELDS_1991 } else { DIGITAL_FIELDS };
    let all = fields.all();
    let blank = all.iter().rev().take_while(|field| field.is_empty()).count();
    let cut = all.len().saturating_sub(own).min(blank);
    let kept = all.get(..all.len() - cut)?;
    let id = *kept.get(1)?;
    let state = |text: &&&str| matches!(**text, "0" | "1");
    let normal = kept.get(2..).unwrap_or_default().last().filter(state).copied();
    let tail = normal.into_iter().collect();
    let cut_oddity = (cut > 0).then_some(Oddity::TrailingCommas);
    let of = |id: String, oddity| Some(ChannelFields { id, tail, unit: "", oddity });
    match kept.len() {
        count if count == own => of(id.to_owned(), cut_oddity),
        2..=DIGITAL_FIELDS => of(id.to_owned(), Some(Oddity::OtherEdition)),
        count => {
            // Of 1991 the state alone comes after the name; later phase and component too.
            let after = if revision == Revision::Of1991 { 1 } else { 3 };
            of(kept.get(1..count - after)?.join(","), Some(Oddity::CommaInName))
        }
    }
}

#[cfg(test)]
#[path = "layout_tests.rs"]
mod tests;
