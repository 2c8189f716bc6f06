//! Operator actions on alarms.

use std::time::Duration;

use busbar_tags::SourceTime;
use busbar_types::{AlarmAction, AlarmState};

use crate::state_transitions::Hold;
use crate::{AlarmEvent, AlarmFlags};

/// The longest name of an operator, in bytes.
pub const MAX_OPERATOR_BYTES: usize = 100;

/// Errors of an action, which then has no effect.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ActionError {
    /// The alarm does not exist.
    #[error("there is no such alarm; the configuration may have been loaded anew")]
    Unknown,
    /// The alarm belongs to another alarm system.
    #[error("'{alarm}' is decided on by the host's alarm system; act there")]
    Mirrored {
        /// Id of the alarm.
        alarm: String,
    },
    /// The alarm is in a state in which the action has no meaning.
    #[error("'{alarm}' is {}: {}", .state.name(), remedy(*.action, *.state))]
    Illegal {
        /// Id of the alarm.
        alarm: String,
        /// Action that was refused.
        action: AlarmAction,
        /// The state of the alarm.
        state: AlarmState,
    },
    /// The shelving time is zero or too long.
    #[error(
        "'{alarm}' cannot be shelved for {} s: choose from 1 to {} s",
        .asked.as_secs(),
        .most.as_secs()
    )]
    ShelvingTime {
        /// Id of the alarm.
        alarm: String,
        /// Duration that was asked for.
        asked: Duration,
        /// The longest that is allowed.
        most: Duration,
    },
    /// The operator's name is missing.
    #[error("the operator has no name, or one of more than {MAX_OPERATOR_BYTES} bytes; log in")]
    Nameless,
}

/// Returns the remedy for an action that is not allowed in a state.
fn remedy(action: AlarmAction, state: AlarmState) -> &'static str {
    match (action, state) {
        (
            AlarmAction::Acknowledge,
            AlarmState::Normal | AlarmState::Acknowledged | AlarmState::LatchedAcknowledged,
        ) => "there is nothing to acknowledge",
        (AlarmAction::Acknowledge, _) => "it cannot be acknowledged while it is held back",
        (AlarmAction::Reset, AlarmState::Unacknowledged | AlarmState::Acknowledged) => {
            "it can be reset once it has returned to normal"
        }
        (AlarmAction::Reset, AlarmState::LatchedUnacknowledged) => {
            "acknowledge it first, then reset it"
        }
        (AlarmAction::Reset, _) => "it has no latch to reset",
        (AlarmAction::Shelve(_), _) => "it is held back already",
        (AlarmAction::Unshelve, _) => "it is not on the shelf",
        (AlarmAction::RemoveFromService, _) => "it is out of service already",
        (AlarmAction::ReturnToService, _) => "it is in service",
    }
}

impl AlarmFlags {
    /// Reports whether an action is allowed in this state. A reset needs an alarm that has
    /// returned and was acknowledged (OPC 10000-9, 5.8.5).
    pub(crate) fn allows(&self, action: AlarmAction) -> bool {
        let state = self.state();
        match action {
            AlarmAction::Acknowledge => state.is_unacknowledged(),
            AlarmAction::Reset => state == AlarmState::LatchedAcknowledged,
            AlarmAction::Shelve(_) => {
                state.is_annunciated() || matches!(state, AlarmState::Normal | AlarmState::Shelved)
            }
            AlarmAction::Unshelve => self.is_shelved,
            AlarmAction::RemoveFromService => !self.is_out_of_service,
            AlarmAction::ReturnToService => self.is_out_of_service,
        }
    }

    /// Applies an action and returns its event. `until` is the end of shelving; `latches` is
    /// true for a latching alarm.
    pub(crate) fn apply(
        &mut self,
        action: AlarmAction,
        until: Option<SourceTime>,
        latches: bool,
    ) -> AlarmEvent {
        match action {
            AlarmAction::Acknowledge => {
                self.acknowledge();
                AlarmEvent::Acknowledged
            }
            AlarmAction::Reset => {
                self.reset();
                AlarmEvent::Reset
            }
            AlarmAction::Shelve(_) => {
                self.hold(Hold::Shelf { until });
                AlarmEvent::Shelved
            }
            AlarmAction::Unshelve => {
                self.release(Hold::Shelf { until: None }, latches);
                AlarmEvent::Unshelved
            }
            AlarmAction::RemoveFromService => {
                self.hold(Hold::OutOfService);
                AlarmEvent::RemovedFromService
            }
            AlarmAction::ReturnToService => {
                self.release(Hold::OutOfService, latches);
                AlarmEvent::ReturnedToService
            }
        }
    }
}
