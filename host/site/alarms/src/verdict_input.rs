//! Verdict of an overlay on the equipment of an alarm.

use std::sync::Arc;

use busbar_tags::SourceTime;
use busbar_types::Origin;

use crate::AlarmHandle;

/// Verdict on the equipment of an alarm, as it holds in a step.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictInput {
    /// Alarm that follows the verdict.
    pub alarm: AlarmHandle,
    /// Reports whether the verdict is abnormal, and of the alarm's severity; none while it is
    /// unknown, for whatever reason.
    pub holds: Option<bool>,
    /// Origins of the values that the verdict rests on.
    pub origin: Origin,
    /// Latest time of these values at their sources.
    pub source_time: Option<SourceTime>,
    /// True where the verdict rests on a default of its overlay.
    pub is_assumed: bool,
    /// Reason of the verdict, or of its lack.
    pub reason: Option<Arc<str>>,
}
