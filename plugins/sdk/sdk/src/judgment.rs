//! Judgments of overlays on equipment: normal, abnormal, or unknown with a reason.

use busbar_types::Verdict;

/// Verdict with its reason, and the defaults that it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgment<'a> {
    /// Verdict on the equipment.
    pub verdict: Verdict,
    /// Reason, for people; not empty for an unknown verdict.
    pub reason: &'a str,
    /// Default of the plugin that the verdict rests on; empty for none.
    pub assumption: &'a str,
}

impl<'a> Judgment<'a> {
    /// Equipment within its limits.
    pub const NORMAL: Judgment<'static> =
        Judgment { verdict: Verdict::Normal, reason: "", assumption: "" };

    /// Creates the judgment on equipment outside its limits, for a reason.
    pub fn abnormal(reason: &'a str) -> Self {
        Self { verdict: Verdict::Abnormal, reason, assumption: "" }
    }

    /// Creates the judgment on equipment that cannot be judged, for a reason.
    pub fn unknown(reason: &'a str) -> Self {
        Self { verdict: Verdict::Unknown, reason, assumption: "" }
    }

    /// Returns the judgment with a default of the plugin that it rests on; empty for none.
    pub fn assuming(self, assumption: &'a str) -> Self {
        Self { assumption, ..self }
    }
}

/// Bindings that verdicts rest on, as they lie in the host's buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Basis {
    pub(crate) offset: u32,
    pub(crate) count: u32,
}

impl Basis {
    /// No binding: a verdict that rests on settings alone.
    pub const NONE: Self = Self { offset: 0, count: 0 };
}
