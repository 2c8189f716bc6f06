//! Pairs of units for the tests of adapters: every spelling of every unit against every unit.

use crate::rows;

/// Words that are no unit of the table, as sources write them.
pub const UNKNOWN_WORDS: [&str; 4] = ["apples", "Bq", "kN/m2", "%RH"];

/// Unit of a tag, the unit that its source states, and the outcome that any adapter must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitPair {
    /// Unit of the tag.
    pub tag: &'static str,
    /// Unit that the source states.
    pub source: &'static str,
    /// Permission to show the value as good.
    pub may_be_good: bool,
    /// Duty to tell of the source's unit.
    pub must_be_told: bool,
}

/// Lists every spelling that a source may state against one spelling of each unit, and words that
/// are no unit against all.
pub fn unit_pairs() -> Vec<UnitPair> {
    let mut pairs = Vec::new();
    for row in rows() {
        let Some(tag) = row.last() else { continue };
        for other in rows() {
            let is_same = std::ptr::eq(row, other);
            pairs.extend(other.iter().map(|source| UnitPair {
                tag,
                source,
                may_be_good: is_same,
                must_be_told: !is_same,
            }));
        }
        pairs.extend(UNKNOWN_WORDS.map(|source| UnitPair {
            tag,
            source,
            may_be_good: true,
            must_be_told: true,
        }));
    }
    pairs
}
