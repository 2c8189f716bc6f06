//! Overlays and charts: verdicts on equipment, severities, fill patterns.

use crate::code::codes;

/// Judgment on a piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[repr(u8)]
pub enum Verdict {
    /// Equipment within its limits.
    Normal = 1,
    /// Equipment outside its limits, or in a state that needs attention.
    Abnormal = 2,
    /// Equipment that cannot be judged: nothing known decides.
    Unknown = 3,
}

/// Severity of a value or state for an operator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[repr(u8)]
pub enum Severity {
    /// Normal state, drawn grey.
    #[default]
    Normal = 0,
    /// Value outside the normal band.
    Warning = 1,
    /// Condition that needs action now.
    Alarm = 2,
}

/// Severity of an abnormal verdict, as far as the inputs decide on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum VerdictSeverity {
    /// Attention is needed, and surely no action now.
    Warning,
    /// Attention is needed; the inputs do not decide whether action is.
    PerhapsAlarm,
    /// Action is needed now.
    #[default]
    Alarm,
}

/// Severity of a defect in the words of DL/T 664 for thermography, which sites use for all
/// defects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[repr(u8)]
pub enum DefectSeverity {
    /// Defect to be mended when there is occasion.
    General = 1,
    /// Defect to be mended soon, and watched until then.
    Serious = 2,
    /// Defect to be mended at once.
    Critical = 3,
}

/// Pattern of a state beside its colour: of a fill, or of a line by its dashes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[repr(u8)]
pub enum Pattern {
    /// Plain colour without a pattern; unbroken lines.
    #[default]
    Solid = 0,
    /// Diagonal stripes in one direction; long dashes.
    Striped = 1,
    /// Crossed diagonal stripes (cross-hatching); dashes and dots.
    Crossed = 2,
    /// Regular grid of dots; dotted lines.
    Dotted = 3,
}

codes!(Verdict { Normal, Abnormal, Unknown });
codes!(Severity { Normal, Warning, Alarm });
codes!(DefectSeverity { General, Serious, Critical });
codes!(Pattern { Solid, Striped, Crossed, Dotted });

impl Verdict {
    /// Returns the word for statistics and other programs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Abnormal => "abnormal",
            Self::Unknown => "unknown",
        }
    }
}

impl VerdictSeverity {
    /// Returns the severity of what is surely an alarm, or is surely none, or neither.
    pub const fn from_bounds(is_alarm: bool, may_be_alarm: bool) -> Self {
        match (is_alarm, may_be_alarm) {
            (true, _) => Self::Alarm,
            (false, true) => Self::PerhapsAlarm,
            (false, false) => Self::Warning,
        }
    }

    /// Returns the word for statistics and other programs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::PerhapsAlarm => "perhaps_alarm",
            Self::Alarm => "alarm",
        }
    }
}

impl DefectSeverity {
    /// Returns the word shown to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::General => "general",
            Self::Serious => "serious",
            Self::Critical => "critical",
        }
    }
}
