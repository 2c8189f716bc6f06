//! The states of an alarm (IEC 62682, alarm state transition diagram; the same letters in
//! ANSI/ISA-18.2).

use busbar_tags::SourceTime;
use serde::{Deserialize, Serialize};

/// The state of an alarm.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum State {
    /// Normal state of an alarm.
    #[default]
    #[serde(rename = "A")]
    Normal,
    /// Unacknowledged alarm, condition active.
    #[serde(rename = "B")]
    Unacknowledged,
    /// Acknowledged alarm, condition active.
    #[serde(rename = "C")]
    Acknowledged,
    /// Returned to normal, unacknowledged.
    #[serde(rename = "D")]
    ReturnedUnacknowledged,
    /// Latched, unacknowledged: condition over; needs acknowledgment and reset.
    #[serde(rename = "E")]
    LatchedUnacknowledged,
    /// Latched, acknowledged: condition over; needs a reset.
    #[serde(rename = "F")]
    LatchedAcknowledged,
    /// Shelved by an operator for some time.
    #[serde(rename = "G")]
    Shelved,
    /// Suppressed by design (logic).
    #[serde(rename = "H")]
    SuppressedByDesign,
    /// Out of service (maintenance).
    #[serde(rename = "I")]
    OutOfService,
}

/// Flags that determine an alarm's state, also under a hold (shelving, suppression by design, out
/// of service). Holds are independent of each other; the strongest is visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct AlarmFlags {
    /// True while the condition holds, delays counted.
    #[serde(skip_serializing_if = "is_false")]
    pub is_active: bool,
    /// True until an operator acknowledges it.
    #[serde(skip_serializing_if = "is_false")]
    pub is_unacknowledged: bool,
    /// True while it waits for a reset.
    #[serde(skip_serializing_if = "is_false")]
    pub is_latched: bool,
    /// True while an operator has it shelved.
    #[serde(skip_serializing_if = "is_false")]
    pub is_shelved: bool,
    /// End of shelving by the wall clock.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shelved_until: Option<SourceTime>,
    /// True while it is suppressed by design.
    #[serde(skip_serializing_if = "is_false")]
    pub is_suppressed: bool,
    /// True while it is out of service.
    #[serde(skip_serializing_if = "is_false")]
    pub is_out_of_service: bool,
}

/// Suppression that keeps an alarm from being annunciated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hold {
    Shelf { until: Option<SourceTime> },
    Suppression,
    OutOfService,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl State {
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
    pub fn letter(self) -> char {
        match self {
            Self::Normal => 'A',
            Self::Unacknowledged => 'B',
            Self::Acknowledged => 'C',
            Self::ReturnedUnacknowledged => 'D',
            Self::LatchedUnacknowledged => 'E',
            Self::LatchedAcknowledged => 'F',
            Self::Shelved => 'G',
            Self::SuppressedByDesign => 'H',
            Self::OutOfService => 'I',
        }
    }

    /// Returns the name of the state for people.
    pub fn name(self) -> &'static str {
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
    pub fn is_unacknowledged(self) -> bool {
        matches!(
            self,
            Self::Unacknowledged | Self::ReturnedUnacknowledged | Self::LatchedUnacknowledged
        )
    }

    /// Reports whether the alarm is in the alarm list: neither normal nor suppressed.
    pub fn is_annunciated(self) -> bool {
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
    pub fn is_held(self) -> bool {
        matches!(self, Self::Shelved | Self::SuppressedByDesign | Self::OutOfService)
    }
}

impl AlarmFlags {
    /// The state that it makes.
    pub fn state(&self) -> State {
        let Self { is_active, is_unacknowledged, is_latched, .. } = *self;
        match (is_active, is_latched, is_unacknowledged) {
            _ if self.is_out_of_service => State::OutOfService,
            _ if self.is_suppressed => State::SuppressedByDesign,
            _ if self.is_shelved => State::Shelved,
            (true, _, true) => State::Unacknowledged,
            (true, _, false) => State::Acknowledged,
            (false, true, true) => State::LatchedUnacknowledged,
            (false, true, false) => State::LatchedAcknowledged,
            (false, false, true) => State::ReturnedUnacknowledged,
            (false, false, false) => State::Normal,
        }
    }

    /// The standing of which nothing but the state is known.
    pub fn from_state(state: State, shelved_until: Option<SourceTime>) -> Self {
        Self {
            is_active: matches!(state, State::Unacknowledged | State::Acknowledged),
            is_unacknowledged: state.is_unacknowledged(),
            is_latched: matches!(state, State::LatchedUnacknowledged | State::LatchedAcknowledged),
            is_shelved: state == State::Shelved,
            shelved_until: shelved_until.filter(|_| state == State::Shelved),
            is_suppressed: state == State::SuppressedByDesign,
            is_out_of_service: state == State::OutOfService,
        }
    }

    pub(crate) fn is_held(&self) -> bool {
        self.is_shelved || self.is_suppressed || self.is_out_of_service
    }

    /// The condition holds. Behind a shelf it latches still: an operator must learn of it
    /// later. What is suppressed or out of service is no alarm.
    pub(crate) fn occur(&mut self, latches: bool) {
        self.is_active = true;
        self.is_latched |= latches && !self.is_suppressed && !self.is_out_of_service;
        self.is_unacknowledged |= !self.is_held();
    }

    /// Records the end of the condition.
    pub(crate) fn return_to_normal(&mut self) {
        self.is_active = false;
    }

    pub(crate) fn acknowledge(&mut self) {
        self.is_unacknowledged = false;
    }

    pub(crate) fn reset(&mut self) {
        self.is_latched = false;
    }

    /// Applies a hold; an existing one is renewed.
    pub(crate) fn hold(&mut self, hold: Hold) {
        match hold {
            Hold::Shelf { until } => (self.is_shelved, self.shelved_until) = (true, until),
            Hold::Suppression => self.is_suppressed = true,
            Hold::OutOfService => self.is_out_of_service = true,
        }
        self.is_unacknowledged = false;
    }

    /// Lifts a hold. After the last one, an active condition is annunciated anew.
    pub(crate) fn release(&mut self, hold: Hold, latches: bool) {
        match hold {
            Hold::Shelf { .. } => (self.is_shelved, self.shelved_until) = (false, None),
            Hold::Suppression => self.is_suppressed = false,
            Hold::OutOfService => self.is_out_of_service = false,
        }
        if !self.is_held() {
            self.is_latched |= latches && self.is_active;
            self.is_unacknowledged = self.is_active || self.is_latched;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standing_of_a_state_makes_that_state() {
        for state in State::ALL {
            assert_eq!(AlarmFlags::from_state(state, None).state(), state);
        }
    }
}
