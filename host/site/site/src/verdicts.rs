//! Verdicts of an overlay on its equipment, as they hold in this step.
//!
//! A verdict is withdrawn in the step in which one of its values is not good. An abnormal verdict
//! is remembered until the piece is judged normal: an alarm does not clear for lack of data.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use busbar_overlay_picture::OverlayPicture;
use busbar_tags::{Snapshot, SourceTime, TagHandle, TagSet};
use busbar_types::{Origin, Quality, Reason, Severity, Verdict, VerdictSeverity};

/// Reason of a verdict, or its lack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum VerdictCause {
    /// The plugin gave none: a fault of it.
    #[default]
    Missing,
    /// The plugin said so: index into the verdicts of its picture.
    Plugin(u32),
    /// A value that the plugin's verdict rests on is not good.
    Tag(TagHandle),
    /// The overlay is late or gone.
    LateDisplay,
}

/// Verdict on one piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PieceVerdict {
    verdict: Verdict,
    severity: VerdictSeverity,
    is_assumed: bool,
    /// Unknown now, and abnormal when it was last known.
    was_abnormal: bool,
    cause: VerdictCause,
}

impl Default for PieceVerdict {
    fn default() -> Self {
        Self {
            verdict: Verdict::Unknown,
            severity: VerdictSeverity::default(),
            is_assumed: false,
            was_abnormal: false,
            cause: VerdictCause::Missing,
        }
    }
}

/// The verdicts of one overlay, by the indices of its equipment.
#[derive(Default)]
pub struct VerdictBoard {
    pieces: Vec<PieceVerdict>,
    /// The picture that they come of.
    picture: Arc<OverlayPicture>,
    has_logged_missing: bool,
}

/// Verdict on a piece of equipment, with its reason as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerdictText<'a> {
    /// Verdict as it holds in this step.
    pub verdict: Verdict,
    /// Severity of an abnormal verdict; none of any other.
    pub severity: Option<VerdictSeverity>,
    /// True if the plugin assumed it.
    pub is_assumed: bool,
    /// Unknown now, and abnormal when it was last known.
    pub was_abnormal: bool,
    /// Reason of the verdict, or of its lack.
    pub reason: Cow<'a, str>,
    /// Origins of the values that it rests on: a verdict on simulated values is no live one.
    pub origin: Origin,
}

impl VerdictBoard {
    /// Takes the verdicts of a picture at the qualities of this frame.
    pub(crate) fn update(&mut self, picture: &Arc<OverlayPicture>, snapshot: Snapshot<'_>) {
        let is_good = |tag| snapshot.state(tag).is_some_and(|state| state.report_quality.is_good());
        let before = std::mem::take(&mut self.pieces);
        self.pieces = vec![PieceVerdict::default(); before.len()];
        for (verdict, index) in picture.verdicts.iter().zip(0..) {
            let Some(piece) = self.pieces.get_mut(verdict.equipment as usize) else { continue };
            let bad_tag = picture.verdicts.basis(verdict).iter().find(|tag| !is_good(**tag));
            let next = match bad_tag.filter(|_| verdict.verdict != Verdict::Unknown) {
                Some(tag) => PieceVerdict {
                    cause: VerdictCause::Tag(*tag),
                    // The plugin has not heard of it yet, or thinks that it knows better.
                    was_abnormal: verdict.verdict == Verdict::Abnormal,
                    ..PieceVerdict::default()
                },
                None => PieceVerdict {
                    verdict: verdict.verdict,
                    severity: verdict.severity,
                    is_assumed: verdict.is_assumed,
                    was_abnormal: false,
                    cause: VerdictCause::Plugin(index),
                },
            };
            if piece.cause == VerdictCause::Missing || urgency(&next) > urgency(piece) {
                *piece = next;
            }
        }
        self.carry_abnormal(&before);
        self.picture = Arc::clone(picture);
    }

    /// Marks all verdicts as not known: the overlay is late or gone.
    pub(crate) fn mark_unknown(&mut self) {
        for piece in &mut self.pieces {
            *piece = PieceVerdict {
                was_abnormal: is_or_was_abnormal(piece),
                cause: VerdictCause::LateDisplay,
                ..PieceVerdict::default()
            };
        }
    }

    fn carry_abnormal(&mut self, before: &[PieceVerdict]) {
        for (piece, before) in self.pieces.iter_mut().zip(before) {
            piece.was_abnormal |= piece.verdict == Verdict::Unknown && is_or_was_abnormal(before);
        }
    }

    /// Adopts another list of equipment; pieces that remain keep their verdicts.
    pub(crate) fn describe(&mut self, before: &[String], now: &[String]) {
        let known: HashMap<&str, PieceVerdict> =
            before.iter().map(String::as_str).zip(self.pieces.iter().copied()).collect();
        let piece = |id: &String| known.get(id.as_str()).copied().unwrap_or_default();
        self.pieces = now.iter().map(piece).collect();
    }

    /// Logs once that the plugin is at fault: pieces that it described have no verdict.
    pub(crate) fn log_missing(&mut self, plugin: &str, equipment: &[String]) {
        let is_missing = |piece: &&PieceVerdict| piece.cause == VerdictCause::Missing;
        let missing = self.pieces.iter().filter(is_missing).count();
        if missing == 0 || std::mem::replace(&mut self.has_logged_missing, true) {
            return;
        }
        let first = self.pieces.iter().position(|piece| piece.cause == VerdictCause::Missing);
        let first = first.and_then(|index| equipment.get(index)).map_or("", String::as_str);
        tracing::error!(
            plugin,
            "it gives no verdict on {missing} pieces of equipment that it describes, '{first}' \
             first: they are shown as unknown; mend the plugin"
        );
    }

    /// Indices of the pieces that are unknown.
    pub fn unknown(&self) -> impl Iterator<Item = usize> {
        let pieces = self.pieces.iter().enumerate();
        pieces.filter(|(_, piece)| piece.verdict == Verdict::Unknown).map(|(index, _)| index)
    }

    /// Reports whether there are no pieces.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Returns the number of pieces.
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Returns the verdict on a piece.
    pub(crate) fn piece(&self, equipment: usize) -> PieceVerdict {
        self.pieces.get(equipment).copied().unwrap_or_default()
    }

    /// Returns the origins of the values that a verdict rests on, and the latest of their times.
    pub(crate) fn basis_origin(
        &self,
        piece: &PieceVerdict,
        snapshot: Snapshot<'_>,
    ) -> (Origin, Option<SourceTime>) {
        let VerdictCause::Plugin(index) = piece.cause else { return (Origin::LIVE, None) };
        let verdicts = &self.picture.verdicts;
        let basis = verdicts.iter().nth(index as usize).map(|verdict| verdicts.basis(verdict));
        let states = basis.into_iter().flatten().filter_map(|tag| snapshot.state(*tag));
        states.fold((Origin::LIVE, None), |(origin, time), state| {
            (origin | state.origin, time.max(state.source_time))
        })
    }

    /// Returns the verdict on a piece, with its reason as text.
    pub fn verdict<'a>(
        &'a self,
        equipment: usize,
        tags: &TagSet,
        snapshot: Snapshot<'_>,
    ) -> VerdictText<'a> {
        let piece = self.pieces.get(equipment).copied().unwrap_or_default();
        let mut reason = match piece.cause {
            VerdictCause::Missing => Cow::Borrowed("the overlay gave no verdict"),
            VerdictCause::LateDisplay => Cow::Borrowed("display late"),
            VerdictCause::Plugin(index) => {
                let verdicts = &self.picture.verdicts;
                let verdict = verdicts.iter().nth(index as usize);
                Cow::Borrowed(verdict.map_or("", |verdict| verdicts.reason(verdict)))
            }
            VerdictCause::Tag(tag) => Cow::Owned(describe_bad_value(tag, tags, snapshot)),
        };
        if piece.was_abnormal {
            reason += "; abnormal when last known";
        }
        let (origin, _) = self.basis_origin(&piece, snapshot);
        VerdictText {
            origin,
            verdict: piece.verdict,
            severity: (piece.verdict == Verdict::Abnormal).then_some(piece.severity),
            is_assumed: piece.is_assumed,
            was_abnormal: piece.was_abnormal,
            reason,
        }
    }
}

/// An overlay with the equipment that it judges.
pub struct OverlayVerdicts<'a> {
    /// Name of its plugin instance.
    pub name: &'a str,
    /// Ids of the equipment, as it describes them.
    pub equipment: &'a [String],
    pub(crate) verdicts: &'a VerdictBoard,
    pub(crate) tags: &'a TagSet,
    pub(crate) snapshot: Snapshot<'a>,
}

impl OverlayVerdicts<'_> {
    /// Returns the verdict on a piece of its equipment, by index.
    pub fn verdict(&self, equipment: usize) -> VerdictText<'_> {
        self.verdicts.verdict(equipment, self.tags, self.snapshot)
    }
}

impl PieceVerdict {
    /// Reports whether the verdict is abnormal, and at least of a severity; none while that is
    /// unknown.
    pub(crate) fn reaches(&self, least: Severity) -> Option<bool> {
        match (self.verdict, self.severity) {
            (Verdict::Normal, _) => Some(false),
            (Verdict::Unknown, _) => None,
            (Verdict::Abnormal, _) if least < Severity::Alarm => Some(true),
            (Verdict::Abnormal, VerdictSeverity::Warning) => Some(false),
            (Verdict::Abnormal, VerdictSeverity::PerhapsAlarm) => None,
            (Verdict::Abnormal, VerdictSeverity::Alarm) => Some(true),
        }
    }

    /// Reports whether the plugin's verdict rests on a default.
    pub(crate) fn is_assumed(&self) -> bool {
        self.is_assumed
    }
}

fn is_or_was_abnormal(piece: &PieceVerdict) -> bool {
    piece.verdict == Verdict::Abnormal || piece.was_abnormal
}

/// Returns the urgency of a verdict; the most urgent one of several counts.
pub(crate) fn urgency(piece: &PieceVerdict) -> (u8, VerdictSeverity) {
    match piece.verdict {
        Verdict::Normal => (0, VerdictSeverity::Warning),
        Verdict::Unknown => (1, VerdictSeverity::Warning),
        Verdict::Abnormal => (2, piece.severity),
    }
}

/// Describes a value that is not good.
fn describe_bad_value(tag: TagHandle, tags: &TagSet, snapshot: Snapshot<'_>) -> String {
    let quality = snapshot.state(tag).map_or(Quality::Bad(Reason::NotConnected), |s| s.quality);
    let name = tags.spec(tag).map_or("a tag that is gone", |spec| spec.id.as_str());
    match quality.reason() {
        Some(reason) => format!("{name}: {reason}"),
        None => format!("{name}: it was not good when this was drawn"),
    }
}

#[cfg(test)]
#[path = "verdicts_tests.rs"]
mod tests;
