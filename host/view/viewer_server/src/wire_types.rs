//! Conversions between the protocol's messages and the viewer's types.

use std::time::Duration;

use busbar_protocol::message::{self, TagQuality, TagUpdate, TagValue};
use busbar_protocol::pictures;
use busbar_tags::{DoublePoint, Quality, Reason, Value};
use busbar_viewer::{AlarmAction, CameraPose, HostTagValue};

/// Converts an alarm action from the protocol.
pub(crate) fn alarm_action(action: message::AlarmAction) -> AlarmAction {
    use message::AlarmAction as Said;
    match action {
        Said::Acknowledge => AlarmAction::Acknowledge,
        Said::Reset => AlarmAction::Reset,
        Said::Unshelve => AlarmAction::Unshelve,
        Said::Shelve(seconds) => AlarmAction::Shelve(Duration::from_secs(u64::from(seconds))),
    }
}

/// Converts an alarm action to the protocol; none for an action that no host program is asked for.
pub(crate) fn alarm_action_message(action: AlarmAction) -> Option<message::AlarmAction> {
    use message::AlarmAction as Said;
    match action {
        AlarmAction::Acknowledge => Some(Said::Acknowledge),
        AlarmAction::Reset => Some(Said::Reset),
        AlarmAction::Unshelve => Some(Said::Unshelve),
        AlarmAction::Shelve(time) => {
            Some(Said::Shelve(u32::try_from(time.as_secs()).unwrap_or(u32::MAX)))
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
pub(crate) fn host_tag_value(update: &TagUpdate) -> HostTagValue {
    let value = |value| match value {
        TagValue::F64(value) => Value::F64(value),
        TagValue::I64(value) => Value::I64(value),
        TagValue::Bool(value) => Value::Bool(value),
        TagValue::DoublePoint(position) => Value::DoublePoint(match position {
            0 => DoublePoint::Intermediate,
            1 => DoublePoint::Off,
            2 => DoublePoint::On,
            _ => DoublePoint::BadState,
        }),
    };
    HostTagValue {
        value: update.value.map(value),
        quality: match update.quality {
            TagQuality::Good => Quality::Good,
            TagQuality::Uncertain => Quality::Uncertain(Reason::Unknown),
            TagQuality::Bad => Quality::Bad(Reason::Unknown),
        },
        source_time: update.source_time,
        waited: Duration::from_nanos(pictures::now().saturating_sub(update.sent_at)),
    }
}
