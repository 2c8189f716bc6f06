//! States of an alarm (IEC 62682, alarm state transition diagram; the same letters in
//! ANSI/ISA-18.2), and actions of operators on it.

use core::time::Duration;

/// State of an alarm by IEC 62682. In JSON it is its letter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AlarmState {
    /// Normal state of an alarm.
    #[default]
    #[cfg_attr(feature = "serde", serde(rename = "A"))]
    Normal,
    /// Unacknowledged alarm, condition active.
    #[cfg_attr(feature = "serde", serde(rename = "B"))]
    Unacknowledged,
    /// Acknowledged alarm, condition active.
    #[cfg_attr(feature = "serde", serde(rename = "C"))]
    Acknowledged,
    /// Returned to normal, unacknowledged.
    #[cfg_attr(feature = "serde", serde(rename = "D"))]
    ReturnedUnacknowledged,
    /// Latched, unacknowledged: condition over; needs acknowledgment and reset.
    #[cfg_attr(feature = "serde", serde(rename = "E"))]
    LatchedUnacknowledged,
    /// Latched, acknowledged: condition over; needs a reset.
    #[cfg_attr(feature = "serde", serde(rename = "F"))]
    LatchedAcknowledged,
    /// Shelved by an operator for some time.
    #[cfg_attr(feature = "serde", serde(rename = "G"))]
    Shelved,
    /// Suppressed by design (logic).
    #[cfg_attr(feature = "serde", serde(rename = "H"))]
    SuppressedByDesign,
    /// Out of service (maintenance).
    #[cfg_attr(feature = "serde", serde(rename = "I"))]
    OutOfService,
}

/// Operator action on an alarm (IEC 62682).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmAction {
    /// Acknowledges the alarm: an operator saw it.
    Acknowledge,
    /// Resets the latch of the alarm.
    Reset,
    /// Shelves the alarm for so long; one that is shelved stays so for so long from now on.
    Shelve(Duration),
    /// Takes the alarm off the shelf.
    Unshelve,
    /// Takes the alarm out of service, until an operator returns it.
    RemoveFromService,
    /// Puts the alarm back into service.
    ReturnToService,
}

impl AlarmState {
    /// All states, in the order of their letters.
    pub const ALL: [Self; 9] = [
        Self::Normal,
        Self::Unacknowledged,
        Self::Acknowledged,
        Self::ReturnedUnacknowledged,
        Self::LatchedUnacknowledged,
        Self::LatchedAcknowledged,
        Self::Shelved,
        Self::SuppressedByDesign,
        Self::OutOfService,
    ];

    /// Returns the letter of the state in the diagrams of IEC 62682, `A` to `I`.
    pub const fn letter(self) -> char {
        (b'A' + self as u8) as char
    }

    /// Finds the state of a letter in the diagrams of IEC 62682.
    pub fn from_letter(letter: char) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.letter() == letter)
    }

    /// Returns the name of the state for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::ReturnedUnacknowledged => "returned, unacknowledged",
            Self::LatchedUnacknowledged => "latched, unacknowledged",
            Self::LatchedAcknowledged => "latched, acknowledged",
            Self::Shelved => "shelved",
            Self::SuppressedByDesign => "suppressed by design",
            Self::OutOfService => "out of service",
        }
    }

    /// Reports whether the state is an unacknowledged one.
    pub const fn is_unacknowledged(self) -> bool {
        matches!(
            self,
            Self::Unacknowledged | Self::ReturnedUnacknowledged | Self::LatchedUnacknowledged
        )
    }

    /// Reports whether the condition holds, as far as the state shows it.
    pub const fn is_active(self) -> bool {
        matches!(self, Self::Unacknowledged | Self::Acknowledged)
    }

    /// Reports whether the alarm is in the alarm list: neither normal nor suppressed.
    pub const fn is_annunciated(self) -> bool {
        matches!(
            self,
            Self::Unacknowledged
                | Self::Acknowledged
                | Self::ReturnedUnacknowledged
                | Self::LatchedUnacknowledged
                | Self::LatchedAcknowledged
        )
    }

    /// Reports whether the alarm is shelved, suppressed by design or out of service.
    pub const fn is_held(self) -> bool {
        matches!(self, Self::Shelved | Self::SuppressedByDesign | Self::OutOfService)
    }
}
