//! Operator actions on alarms.

use std::time::Duration;

use busbar_tags::SourceTime;

use crate::state::Hold;
use crate::{AlarmEvent, AlarmFlags, State};

/// The longest name of an operator, in bytes.
pub const MAX_OPERATOR_BYTES: usize = 100;

/// Operator action on an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Say that it was seen.
    Acknowledge,
    /// Let go of a latch.
    Reset,
    /// Put it on the shelf for so long; one that is there stays so long from now on.
    Shelve(Duration),
    /// Take it off the shelf.
    Unshelve,
    /// Take it out of service, until an operator returns it.
    RemoveFromService,
    /// Put it back into service.
    ReturnToService,
}

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
        action: Action,
        /// The state of the alarm.
        state: State,
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
fn remedy(action: Action, state: State) -> &'static str {
    match (action, state) {
        (Action::Acknowledge, State::Normal | State::Acknowledged | State::LatchedAcknowledged) => {
            "there is nothing to acknowledge"
        }
        (Action::Acknowledge, _) => "it cannot be acknowledged while it is held back",
        (Action::Reset, State::Unacknowledged | State::Acknowledged) => {
            "it can be reset once it has returned to normal"
        }
        (Action::Reset, State::LatchedUnacknowledged) => "acknowledge it first, then reset it",
        (Action::Reset, _) => "it has no latch to reset",
        (Action::Shelve(_), _) => "it is held back already",
        (Action::Unshelve, _) => "it is not on the shelf",
        (Action::RemoveFromService, _) => "it is out of service already",
        (Action::ReturnToService, _) => "it is in service",
    }
}

impl Action {
    /// Reports whether an action is allowed in this state. A reset needs an alarm that has
    /// returned and was acknowledged (OPC 10000-9, 5.8.5).
    pub(crate) fn is_legal(self, standing: &AlarmFlags) -> bool {
        let state = standing.state();
        match self {
            Self::Acknowledge => state.is_unacknowledged(),
            Self::Reset => state == State::LatchedAcknowledged,
            Self::Shelve(_) => {
                state.is_annunciated() || matches!(state, State::Normal | State::Shelved)
            }
            Self::Unshelve => standing.is_shelved,
            Self::RemoveFromService => !standing.is_out_of_service,
            Self::ReturnToService => standing.is_out_of_service,
        }
    }

    /// Applies the action and returns its event. `until` is the end of shelving; `latches` is
    /// true for a latching alarm.
    pub(crate) fn apply(
        self,
        standing: &mut AlarmFlags,
        until: Option<SourceTime>,
        latches: bool,
    ) -> AlarmEvent {
        match self {
            Self::Acknowledge => {
                standing.acknowledge();
                AlarmEvent::Acknowledged
            }
            Self::Reset => {
                standing.reset();
                AlarmEvent::Reset
            }
            Self::Shelve(_) => {
                standing.hold(Hold::Shelf { until });
                AlarmEvent::Shelved
            }
            Self::Unshelve => {
                standing.release(Hold::Shelf { until: None }, latches);
                AlarmEvent::Unshelved
            }
            Self::RemoveFromService => {
                standing.hold(Hold::OutOfService);
                AlarmEvent::RemovedFromService
            }
            Self::ReturnToService => {
                standing.release(Hold::OutOfService, latches);
                AlarmEvent::ReturnedToService
            }
        }
    }
}
