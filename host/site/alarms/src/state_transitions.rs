//! Transitions between the states of an alarm, by flags (IEC 62682, alarm state transition diagram;
//! the same letters in ANSI/ISA-18.2).

use busbar_tags::SourceTime;
use busbar_types::AlarmState;
use serde::{Deserialize, Serialize};

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

impl AlarmFlags {
    /// The state that it makes.
    pub fn state(&self) -> AlarmState {
        let Self { is_active, is_unacknowledged, is_latched, .. } = *self;
        match (is_active, is_latched, is_unacknowledged) {
            _ if self.is_out_of_service => AlarmState::OutOfService,
            _ if self.is_suppressed => AlarmState::SuppressedByDesign,
            _ if self.is_shelved => AlarmState::Shelved,
            (true, _, true) => AlarmState::Unacknowledged,
            (true, _, false) => AlarmState::Acknowledged,
            (false, true, true) => AlarmState::LatchedUnacknowledged,
            (false, true, false) => AlarmState::LatchedAcknowledged,
            (false, false, true) => AlarmState::ReturnedUnacknowledged,
            (false, false, false) => AlarmState::Normal,
        }
    }

    /// The standing of which nothing but the state is known.
    pub fn from_state(state: AlarmState, shelved_until: Option<SourceTime>) -> Self {
        Self {
            is_active: matches!(state, AlarmState::Unacknowledged | AlarmState::Acknowledged),
            is_unacknowledged: state.is_unacknowledged(),
            is_latched: matches!(
                state,
                AlarmState::LatchedUnacknowledged | AlarmState::LatchedAcknowledged
            ),
            is_shelved: state == AlarmState::Shelved,
            shelved_until: shelved_until.filter(|_| state == AlarmState::Shelved),
            is_suppressed: state == AlarmState::SuppressedByDesign,
            is_out_of_service: state == AlarmState::OutOfService,
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
        for state in AlarmState::ALL {
            assert_eq!(AlarmFlags::from_state(state, None).state(), state);
        }
    }
}
