//! Conversions between the protocol's messages and the viewer's types.

use std::time::Duration;

use busbar_protocol::message::{self, AlarmRequest, TagUpdate};
use busbar_protocol::pictures;
use busbar_types::{Quality, Reason};
use busbar_viewer::{AlarmAction, CameraPose, HostTagValue};

/// Converts an alarm action from the protocol.
pub(crate) fn alarm_action(request: AlarmRequest) -> AlarmAction {
    match request {
        AlarmRequest::Acknowledge => AlarmAction::Acknowledge,
        AlarmRequest::Reset => AlarmAction::Reset,
        AlarmRequest::Unshelve => AlarmAction::Unshelve,
        AlarmRequest::Shelve(seconds) => {
            AlarmAction::Shelve(Duration::from_secs(u64::from(seconds)))
        }
    }
}

/// Converts an alarm action to the protocol; none for an action that no host program is asked for.
pub(crate) fn alarm_request(action: AlarmAction) -> Option<AlarmRequest> {
    match action {
        AlarmAction::Acknowledge => Some(AlarmRequest::Acknowledge),
        AlarmAction::Reset => Some(AlarmRequest::Reset),
        AlarmAction::Unshelve => Some(AlarmRequest::Unshelve),
        AlarmAction::Shelve(time) => {
            Some(AlarmRequest::Shelve(u32::try_from(time.as_secs()).unwrap_or(u32::MAX)))
        }
        AlarmAction::RemoveFromService | AlarmAction::ReturnToService => None,
    }
}

/// Converts a camera pose from the protocol.
pub(crate) fn camera_pose(pose: &message::CameraPose) -> CameraPose {
    let message::CameraPose { eye, target, is_orthographic } = *pose;
    CameraPose { eye, target, is_orthographic }
}

/// Converts a camera pose to the protocol.
pub(crate) fn camera_pose_message(pose: &CameraPose) -> message::CameraPose {
    let CameraPose { eye, target, is_orthographic } = *pose;
    message::CameraPose { eye, target, is_orthographic }
}

/// Converts a tag's value from the protocol, with the time that it was on its way until now.
pub(crate) fn host_tag_value(update: TagUpdate) -> HostTagValue {
    HostTagValue {
        value: update.value,
        quality: Quality::new(update.quality, Reason::Unknown),
        source_time: update.source_time,
        waited: Duration::from_nanos(pictures::now().saturating_sub(update.sent_at)),
    }
}
