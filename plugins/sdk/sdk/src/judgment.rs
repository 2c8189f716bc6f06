//! Judgments of overlays on equipment: normal, abnormal, or unknown with a reason.

use busbar_plugin_abi as abi;
use busbar_types::{Verdict, VerdictSeverity};

/// Returns the bits of a severity among the flags of a verdict.
pub(crate) fn severity_flag(severity: VerdictSeverity) -> u32 {
    match severity {
        VerdictSeverity::Warning => abi::BUSBAR_VERDICT_FLAG_WARNING,
        VerdictSeverity::PerhapsAlarm => abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM,
        VerdictSeverity::Alarm => 0,
    }
}

/// Verdict with its reason, and the defaults that it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgment<'a> {
    /// Verdict on the equipment.
    pub verdict: Verdict,
    /// Severity of an abnormal verdict; says nothing of any other.
    pub severity: VerdictSeverity,
    /// Reason, for people; not empty for an unknown verdict.
    pub reason: &'a str,
    /// Default of the plugin that the verdict rests on; empty for none.
    pub assumption: &'a str,
}

impl<'a> Judgment<'a> {
    /// Equipment within its limits.
    pub const NORMAL: Judgment<'static> = Judgment::new(Verdict::Normal, "");

    const fn new(verdict: Verdict, reason: &str) -> Judgment<'_> {
        Judgment { verdict, severity: VerdictSeverity::Alarm, reason, assumption: "" }
    }

    /// Creates the judgment on equipment outside its limits, for a reason: an alarm, unless
    /// [`Judgment::of_severity`] says otherwise.
    pub fn abnormal(reason: &'a str) -> Self {
        Self::new(Verdict::Abnormal, reason)
    }

    /// Creates the judgment on equipment that cannot be judged, for a reason.
    pub fn unknown(reason: &'a str) -> Self {
        Self::new(Verdict::Unknown, reason)
    }

    /// Returns the judgment with the severity that it has where it is abnormal.
    pub fn of_severity(self, severity: VerdictSeverity) -> Self {
        Self { severity, ..self }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_severity_is_no_more_certain_than_its_bounds() {
        for (bounds, expected, flag) in [
            ((true, true), VerdictSeverity::Alarm, 0),
            ((false, true), VerdictSeverity::PerhapsAlarm, abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM),
            ((false, false), VerdictSeverity::Warning, abi::BUSBAR_VERDICT_FLAG_WARNING),
        ] {
            let severity = VerdictSeverity::from_bounds(bounds.0, bounds.1);
            assert_eq!((severity, severity_flag(severity)), (expected, flag), "{bounds:?}");
        }
        let judgment = Judgment::abnormal("hot");
        assert_eq!(judgment.severity, VerdictSeverity::Alarm, "unless it says otherwise");
        let warning = judgment.of_severity(VerdictSeverity::Warning);
        assert_eq!((warning.verdict, warning.reason), (judgment.verdict, "hot"));
    }
}
