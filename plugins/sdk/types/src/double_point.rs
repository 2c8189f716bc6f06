//! Double points: positions of switches by two contacts.

use core::fmt;

use crate::{Quality, Reason};

/// Position of a switch by two contacts (IEC 60870-5-101, 7.2.6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum DoublePoint {
    /// Neither contact is closed: the switch is travelling.
    Intermediate = 0,
    /// Position of an open switch.
    Off = 1,
    /// Position of a closed switch.
    On = 2,
    /// Both contacts are closed: a fault.
    BadState = 3,
}

impl DoublePoint {
    /// Creates a position from the two bits of a double-point information element; higher bits are
    /// ignored.
    #[inline]
    pub const fn from_bits(bits: u64) -> Self {
        match bits & 0b11 {
            0 => Self::Intermediate,
            1 => Self::Off,
            2 => Self::On,
            _ => Self::BadState,
        }
    }

    /// Returns the two bits of a double-point information element.
    #[inline]
    pub const fn bits(self) -> u8 {
        self as u8
    }

    /// Returns the quality of a position: contacts that contradict each other are a doubtful sensor.
    #[inline]
    pub const fn quality(self) -> Quality {
        match self {
            Self::Intermediate | Self::Off | Self::On => Quality::Good,
            Self::BadState => Quality::Uncertain(Reason::Sensor),
        }
    }

    /// Finds the position of a word in settings: `intermediate`, `off`, `on` or `bad_state`.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "intermediate" => Self::Intermediate,
            "off" => Self::Off,
            "on" => Self::On,
            "bad_state" => Self::BadState,
            _ => return None,
        })
    }
}

impl fmt::Display for DoublePoint {
    /// Writes `travelling`, `open`, `closed` or `invalid`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Intermediate => "travelling",
            Self::Off => "open",
            Self::On => "closed",
            Self::BadState => "invalid",
        })
    }
}
