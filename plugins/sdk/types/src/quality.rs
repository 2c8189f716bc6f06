//! Quality of values, with the reason of one that is not good.

use core::fmt;

use crate::code::codes;

/// Quality of a value, with the reason where it is not good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Quality {
    /// Value that is usable.
    Good,
    /// Value that is doubtful.
    Uncertain(Reason),
    /// Value that is not usable.
    Bad(Reason),
}

/// Quality without its reason, the best first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[repr(u8)]
pub enum QualityLevel {
    /// Value or state that is usable.
    #[default]
    Good = 0,
    /// Value or state that is doubtful.
    Uncertain = 1,
    /// Value that is not usable, or state that is not known.
    Bad = 2,
}

/// Reason of a quality that is not good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Reason {
    /// Reason that the source does not give.
    Unknown = 0,
    /// Link to the device that is down.
    Communication = 1,
    /// Sensor that failed, as the device says.
    Sensor = 2,
    /// Value outside the measuring range.
    OutOfRange = 3,
    /// Address that the device refused, or an answer that does not fit.
    Configuration = 4,
    /// Device that is not connected yet: no value was received.
    NotConnected = 5,
    /// Value that is not a finite number.
    NotFinite = 6,
    /// Value past its freshness limit; only the host gives this reason.
    Stale = 7,
    /// Source timestamp that is missing where one is promised, unreadable, in the future or
    /// impossible.
    SourceTime = 8,
}

codes!(QualityLevel { Good, Uncertain, Bad });
codes!(Reason {
    Unknown,
    Communication,
    Sensor,
    OutOfRange,
    Configuration,
    NotConnected,
    NotFinite,
    Stale,
    SourceTime,
});

impl Quality {
    /// Creates a quality from its level, with a reason that counts where the level is not good.
    #[inline]
    pub const fn new(level: QualityLevel, reason: Reason) -> Self {
        match level {
            QualityLevel::Good => Self::Good,
            QualityLevel::Uncertain => Self::Uncertain(reason),
            QualityLevel::Bad => Self::Bad(reason),
        }
    }

    /// Returns the quality without its reason.
    #[inline]
    pub const fn level(self) -> QualityLevel {
        match self {
            Self::Good => QualityLevel::Good,
            Self::Uncertain(_) => QualityLevel::Uncertain,
            Self::Bad(_) => QualityLevel::Bad,
        }
    }

    /// Returns the reason of a quality that is not good.
    #[inline]
    pub const fn reason(self) -> Option<Reason> {
        match self {
            Self::Good => None,
            Self::Uncertain(reason) | Self::Bad(reason) => Some(reason),
        }
    }

    /// Reports whether the value can be shown as certain.
    #[inline]
    pub fn is_good(self) -> bool {
        self == Self::Good
    }

    /// Returns `good`, `uncertain` or `bad`.
    pub const fn name(self) -> &'static str {
        self.level().name()
    }

    /// Returns the worse of two qualities; the first where they are alike.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        if other.level() > self.level() { other } else { self }
    }

    /// Returns the numbers of level and reason in the C ABI.
    #[inline]
    pub const fn codes(self) -> (u8, u8) {
        match self {
            Self::Good => (QualityLevel::Good.code(), Reason::Unknown.code()),
            Self::Uncertain(reason) => (QualityLevel::Uncertain.code(), reason.code()),
            Self::Bad(reason) => (QualityLevel::Bad.code(), reason.code()),
        }
    }

    /// Finds the quality of two numbers in the C ABI; `None` where either is not known.
    #[inline]
    pub fn from_codes(level: u8, reason: u8) -> Option<Self> {
        let reason = Reason::from_code(reason)?;
        Some(Self::new(QualityLevel::from_code(level)?, reason))
    }
}

impl QualityLevel {
    /// Returns `good`, `uncertain` or `bad`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Uncertain => "uncertain",
            Self::Bad => "bad",
        }
    }
}

impl fmt::Display for Reason {
    /// Writes the reason in words, such as `out of range`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "no reason given",
            Self::Communication => "communication",
            Self::Sensor => "sensor",
            Self::OutOfRange => "out of range",
            Self::Configuration => "configuration",
            Self::NotConnected => "not connected",
            Self::NotFinite => "not finite",
            Self::Stale => "stale",
            Self::SourceTime => "source time",
        })
    }
}
