//! Verdicts of overlays on equipment: normal, abnormal, or unknown with a reason.

use std::ops::Range;

use busbar_tags::TagHandle;
use busbar_types::{Verdict, VerdictSeverity};
use serde::{Deserialize, Serialize};

use crate::overlay_binding::MAX_PART_BYTES;

/// Verdicts that one overlay may give in a frame, for each piece of equipment described.
const MAX_VERDICTS_A_PIECE: usize = 2;
/// Bindings that all verdicts of a frame may rest on together.
pub const MAX_BASIS: usize = 1 << 22;

/// Verdict on one piece of equipment, without its reason and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerdictRating {
    /// Verdict on the equipment.
    pub verdict: Verdict,
    /// Severity of an abnormal verdict; says nothing of any other.
    pub severity: VerdictSeverity,
    /// True if it rests on a default of the plugin, which the reason names.
    pub is_assumed: bool,
}

impl From<Verdict> for VerdictRating {
    fn from(verdict: Verdict) -> Self {
        Self { verdict, severity: VerdictSeverity::default(), is_assumed: false }
    }
}

/// A verdict by indices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverlayVerdict {
    /// Index of the equipment described.
    pub equipment: u32,
    /// Verdict on the equipment.
    pub verdict: Verdict,
    /// Severity of an abnormal verdict; says nothing of any other.
    pub severity: VerdictSeverity,
    /// Reports whether it rests on a default of the plugin, which the reason names.
    pub is_assumed: bool,
    reason: Range<u32>,
    basis: Range<u32>,
}

/// The verdicts of one frame, with reasons and bases in shared buffers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verdicts {
    list: Vec<OverlayVerdict>,
    reasons: String,
    basis: Vec<TagHandle>,
}

impl Verdicts {
    /// The verdicts in the plugin's order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &OverlayVerdict> {
        self.list.iter()
    }

    /// The reason of a verdict; empty for none.
    pub fn reason(&self, verdict: &OverlayVerdict) -> &str {
        let Range { start, end } = verdict.reason;
        self.reasons.get(start as usize..end as usize).unwrap_or_default()
    }

    /// The tags that a verdict rests on.
    pub fn basis(&self, verdict: &OverlayVerdict) -> &[TagHandle] {
        let Range { start, end } = verdict.basis;
        self.basis.get(start as usize..end as usize).unwrap_or_default()
    }

    /// Replaces every tag under the verdicts.
    pub fn map_tags(&mut self, tag: impl Fn(TagHandle) -> TagHandle) {
        self.basis.iter_mut().for_each(|of| *of = tag(*of));
    }

    /// Adds a verdict that the host itself gives.
    pub fn push(
        &mut self,
        equipment: u32,
        rating: impl Into<VerdictRating>,
        reason: &str,
        basis: &[TagHandle],
    ) {
        let from = self.basis.len() as u32;
        self.basis.extend_from_slice(basis);
        let basis = from..self.basis.len() as u32;
        self.push_on_basis(equipment, rating.into(), reason, basis);
    }

    /// Creates an empty list whose verdicts rest on ranges of these tags; it has room for so many.
    pub fn with_basis(basis: Vec<TagHandle>, capacity: usize) -> Self {
        Self { list: Vec::with_capacity(capacity), reasons: String::new(), basis }
    }

    /// Adds a verdict that rests on a range of the tags of [`Verdicts::with_basis`]. The range is
    /// checked by [`PictureRules::check`](crate::PictureRules::check).
    pub fn push_on_basis(
        &mut self,
        equipment: u32,
        rating: VerdictRating,
        reason: &str,
        basis: Range<u32>,
    ) {
        let from = self.reasons.len() as u32;
        self.reasons.push_str(reason);
        let reason = from..self.reasons.len() as u32;
        let VerdictRating { verdict, severity, is_assumed } = rating;
        self.list.push(OverlayVerdict { equipment, verdict, severity, is_assumed, reason, basis });
    }

    /// Checks the rules for verdicts on so many pieces of equipment, resting on tags that
    /// `is_bound` knows.
    ///
    /// # Errors
    /// The rule that they break, in words.
    pub(crate) fn check(
        &self,
        equipment: usize,
        is_bound: impl Fn(TagHandle) -> bool,
    ) -> Result<(), &'static str> {
        if self.list.len() > max_verdicts(equipment) || self.basis.len() > MAX_BASIS {
            return Err("it claims too many verdicts");
        }
        if !self.basis.iter().all(|tag| is_bound(*tag)) {
            return Err("a verdict rests on a tag that is not bound");
        }
        for verdict in &self.list {
            if verdict.equipment as usize >= equipment {
                return Err("a verdict names equipment that was not described");
            }
            let reason = verdict.reason.start as usize..verdict.reason.end as usize;
            if reason.len() > MAX_PART_BYTES {
                return Err("the reason of a verdict is too long");
            }
            let Some(reason) = self.reasons.get(reason) else {
                return Err("a verdict names text that is not there");
            };
            let basis = verdict.basis.start as usize..verdict.basis.end as usize;
            if self.basis.get(basis).is_none() {
                return Err("a verdict names a basis that is not there");
            }
            let needs_reason = verdict.verdict == Verdict::Unknown || verdict.is_assumed;
            if needs_reason && reason.trim().is_empty() {
                return Err("a verdict is unknown or assumed without a reason");
            }
        }
        Ok(())
    }
}

/// Returns the number of verdicts that an overlay may give in a frame.
pub fn max_verdicts(equipment: usize) -> usize {
    equipment * MAX_VERDICTS_A_PIECE
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAG: TagHandle = TagHandle(3);

    fn verdicts(equipment: u32, verdict: Verdict, is_assumed: bool, reason: &str) -> Verdicts {
        let mut verdicts = Verdicts::default();
        let rating = VerdictRating { is_assumed, ..verdict.into() };
        verdicts.push(equipment, rating, reason, &[TAG]);
        verdicts
    }

    #[test]
    fn a_verdict_names_what_is_there_and_says_why_it_is_none() {
        let is_bound = |tag| tag == TAG;
        let check = |verdicts: &Verdicts| verdicts.check(2, is_bound);
        let right = verdicts(1, Verdict::Unknown, false, "no temperature");
        assert_eq!(check(&right), Ok(()));
        let only = right.iter().next().expect("one");
        assert_eq!((right.reason(only), right.basis(only)), ("no temperature", &[TAG][..]));
        assert_eq!(check(&verdicts(1, Verdict::Normal, false, "")), Ok(()));
        for wrong in [
            verdicts(2, Verdict::Normal, false, ""),
            verdicts(1, Verdict::Unknown, false, " "),
            verdicts(1, Verdict::Normal, true, ""),
            verdicts(1, Verdict::Normal, false, &"x".repeat(MAX_PART_BYTES + 1)),
        ] {
            assert!(check(&wrong).is_err(), "{wrong:?}");
        }
        assert!(right.check(2, |_| false).is_err(), "a tag that is not bound");
        let mut many = right.clone();
        (0..4).for_each(|_| many.push(0, Verdict::Normal, "", &[]));
        assert!(check(&many).is_err());
    }

    #[test]
    fn ranges_of_a_hostile_process_lead_nowhere() {
        let mut hostile = verdicts(0, Verdict::Normal, false, "");
        hostile.list[0].basis = 0..9;
        assert!(hostile.check(1, |_| true).is_err());
        assert_eq!(hostile.basis(&hostile.list[0]), &[]);
        hostile.list[0].basis = Range { start: 1, end: 0 };
        assert!(hostile.check(1, |_| true).is_err());
        hostile.list[0].basis = 0..1;
        hostile.list[0].reason = 5..7;
        assert!(hostile.check(1, |_| true).is_err());
        assert_eq!(hostile.reason(&hostile.list[0]), "");
    }
}
