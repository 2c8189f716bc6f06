//! Priorities of alarms, and the limits that raise them.

/// Priority of an alarm, the most urgent first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Priority {
    /// Action is needed at once.
    Critical,
    /// Action is needed promptly.
    High,
    /// Action is needed soon.
    #[default]
    Medium,
    /// Action may be deferred.
    Low,
}

/// Limit of a measurement that an alarm watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Upper limit of high urgency.
    HighHigh,
    /// Upper limit of a measurement.
    High,
    /// Lower limit of a measurement.
    Low,
    /// Lower limit of high urgency.
    LowLow,
}

impl Priority {
    /// All priorities, the most urgent first.
    pub const ALL: [Self; 4] = [Self::Critical, Self::High, Self::Medium, Self::Low];

    /// Returns `critical`, `high`, `medium` or `low`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Critical => "critical",
            Self::High => "high",
            Self::Medium => "medium",
            Self::Low => "low",
        }
    }
}

impl Limit {
    /// Reports whether a number must be above the limit, and not below it.
    pub const fn is_upper(self) -> bool {
        matches!(self, Self::HighHigh | Self::High)
    }

    /// Returns `high-high`, `high`, `low` or `low-low`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::HighHigh => "high-high",
            Self::High => "high",
            Self::Low => "low",
            Self::LowLow => "low-low",
        }
    }
}
