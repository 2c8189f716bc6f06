//! Units that sources state beside their values, compared with the unit of the tag.
//!
//! One decision for all adapters: a unit that contradicts the tag's is refused and never
//! converted, because a conversion that nobody configured hides the mistake of one of both. A
//! spelling that is not known contradicts nothing; it is told, and the value is taken. A unit that
//! cannot be read at all leaves its value uncertain.

mod spellings;
pub mod testing;

use busbar_types::{Quality, Reason};

use spellings::{PRESSURES, UNITS};

/// Longest part of a unit that a message repeats, characters.
const MAX_SHOWN_CHARS: usize = 32;
/// Shortest spelling that is known in another case too, bytes: `S` is no `s`.
const MIN_CASELESS_BYTES: usize = 2;

/// Suffixes of pressures above the surrounding air.
const GAUGE: &[&str] = &["(gauge)", "gauge", "(rel)", "rel", "(g)", "g"];
/// Suffixes of pressures above vacuum.
const ABSOLUTE: &[&str] = &["(abs)", "abs", "(a)", "a"];

/// Relation of the unit that a source states to that of the tag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnitAgreement {
    /// No statement, nothing to compare with, or the same unit.
    #[default]
    Agrees,
    /// Another unit for certain: the value must not be shown under the tag's.
    Conflicts,
    /// Spelling of one of both that is not known.
    Unknown,
    /// Statement that is no text, number or code of a unit: it may contradict.
    Unreadable,
}

impl UnitAgreement {
    /// Limits the quality of a value: bad where its unit is another, uncertain at best where it
    /// cannot be read.
    pub fn limit(self, quality: Quality) -> Quality {
        match (self, quality) {
            (Self::Conflicts, Quality::Good | Quality::Uncertain(_)) => {
                Quality::Bad(Reason::Configuration)
            }
            (Self::Unreadable, Quality::Good) => Quality::Uncertain(Reason::Configuration),
            _ => quality,
        }
    }
}

/// Statement of a unit by a source that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnreadableUnit;

/// Unit that the samples of a tag must have, to compare with what a source states.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TagUnit(Box<str>);

impl TagUnit {
    /// Takes the unit of a tag; an empty one is compared with nothing.
    pub fn new(unit: &str) -> Self {
        Self(unit.trim().into())
    }

    /// Reports whether there is a unit to compare with.
    pub fn is_known(&self) -> bool {
        !self.0.is_empty()
    }

    /// Compares the unit with all names by which a source states its own. Any contradiction
    /// counts, also of one name to the other.
    pub fn compare<'s>(&self, stated: impl IntoIterator<Item = &'s str>) -> UnitAgreement {
        let names = stated.into_iter().map(str::trim).filter(|name| !name.is_empty());
        let mut has_unknown = false;
        let mut agrees = false;
        for name in names.filter(|_| self.is_known()) {
            match compare(name, &self.0) {
                UnitAgreement::Conflicts => return UnitAgreement::Conflicts,
                UnitAgreement::Agrees => agrees = true,
                UnitAgreement::Unknown | UnitAgreement::Unreadable => has_unknown = true,
            }
        }
        if has_unknown && !agrees { UnitAgreement::Unknown } else { UnitAgreement::Agrees }
    }

    /// Judges a statement that cannot be read; where there is nothing to compare with, it does not
    /// matter.
    pub fn judge_unreadable(&self) -> UnitAgreement {
        if self.is_known() { UnitAgreement::Unreadable } else { UnitAgreement::Agrees }
    }

    /// Describes a unit that does not agree, with a remedy; `stated` is the source's own text.
    pub fn remark(&self, agreement: UnitAgreement, stated: &str) -> Option<String> {
        let (stated, wanted) = (shown(stated), shown(&self.0));
        match agreement {
            UnitAgreement::Agrees => None,
            UnitAgreement::Conflicts => Some(format!(
                "its source states the unit '{stated}', the tag has '{wanted}', so that its \
                 values are bad: correct the tag's unit, or give its address a `scale`"
            )),
            UnitAgreement::Unknown => Some(format!(
                "its source states the unit '{stated}', of which it is not known whether it is \
                 '{wanted}', the tag's: its values are taken as they are"
            )),
            UnitAgreement::Unreadable => Some(format!(
                "its source states a unit that cannot be read ('{stated}'), so that its values \
                 are uncertain: the tag has '{wanted}'"
            )),
        }
    }
}

/// Finds the spelling that stands for all spellings of a unit, by an exact spelling.
pub fn find_unit(text: &str) -> Option<&'static str> {
    let text = text.trim();
    let spellings = rows().find(|spellings| spellings.contains(&text))?;
    spellings.first().copied()
}

/// Reports two units that differ for certain: both are known, and not the same.
pub fn units_conflict(one: &str, other: &str) -> bool {
    compare(one.trim(), other.trim()) == UnitAgreement::Conflicts
}

/// Zero of a pressure scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PressureReference {
    Gauge,
    Absolute,
}

fn compare(one: &str, other: &str) -> UnitAgreement {
    if one == other || one.is_empty() || other.is_empty() {
        return UnitAgreement::Agrees;
    }
    let (Some((one, one_zero)), Some((other, other_zero))) = (find(one), find(other)) else {
        return UnitAgreement::Unknown;
    };
    match (one_zero, other_zero) {
        _ if one != other => UnitAgreement::Conflicts,
        (Some(one), Some(other)) if one != other => UnitAgreement::Conflicts,
        (Some(_), None) | (None, Some(_)) => UnitAgreement::Unknown,
        _ => UnitAgreement::Agrees,
    }
}

fn rows() -> impl Iterator<Item = &'static [&'static str]> {
    UNITS.iter().chain(PRESSURES).copied()
}

/// Finds the spelling that stands for a unit, and the zero that a unit of pressure names.
fn find(text: &str) -> Option<(&'static str, Option<PressureReference>)> {
    if let Some(unit) = find_unit(text).or_else(|| find_caseless(rows(), text)) {
        return Some((unit, None));
    }
    let lower = text.to_lowercase();
    let references = [(PressureReference::Gauge, GAUGE), (PressureReference::Absolute, ABSOLUTE)];
    references.into_iter().find_map(|(reference, suffixes)| {
        suffixes.iter().find_map(|suffix| {
            let length = lower.strip_suffix(suffix)?.len();
            let rest = text.get(..length)?.trim_end_matches(['.', ' ', '_']);
            let exact = PRESSURES.iter().find(|row| row.contains(&rest));
            let unit = exact.and_then(|row| row.first().copied());
            let unit = unit.or_else(|| find_caseless(PRESSURES.iter().copied(), rest))?;
            Some((unit, Some(reference)))
        })
    })
}

/// Finds a unit in letters of another case, where no prefix is in doubt: `mw` is no `MW`.
fn find_caseless(
    mut rows: impl Iterator<Item = &'static [&'static str]>,
    text: &str,
) -> Option<&'static str> {
    if text.len() < MIN_CASELESS_BYTES {
        return None;
    }
    let lower = text.to_lowercase();
    let is_alike = |symbol: &&str| {
        symbol.len() >= MIN_CASELESS_BYTES
            && symbol.to_lowercase() == lower
            && milli_or_mega(symbol) == milli_or_mega(text)
    };
    rows.find(|row| row.iter().any(is_alike))?.first().copied()
}

/// Returns the first letter, where it may be milli or mega.
fn milli_or_mega(symbol: &str) -> Option<char> {
    symbol.chars().next().filter(|first| matches!(first, 'm' | 'M'))
}

/// Shortens a unit for a message, on one line.
fn shown(text: &str) -> String {
    let chars = text.trim().chars().take(MAX_SHOWN_CHARS);
    chars.map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests;
