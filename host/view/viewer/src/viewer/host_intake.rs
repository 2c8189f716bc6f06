//! Intake of the values that a host program sets: by the rules for samples of plugins.

use std::time::Duration;

use busbar_plugin_host::{ProgramValue, SampleIntake, SampleSink, SourcePolicy, TelemetryTag};
use busbar_protocol::message::{TagQuality, TagUpdate, TagValue};
use busbar_tags::{DoublePoint, Moment, Quality, Reason, SourceTime, TagHandle, TagSpec, Value};

use crate::load::LoadedScene;

/// Judges the values that a host program sets, one source of many tags.
pub(super) struct HostIntake(SampleIntake);

/// An instant by the clocks of this process.
#[derive(Clone, Copy)]
pub(super) struct ArrivalTimes {
    /// Instant on the monotonic clock of moments.
    pub(super) now: Moment,
    /// Instant on the wall clock.
    pub(super) wall: SourceTime,
    /// Instant on the clock since boot that stamps messages, nanoseconds.
    pub(super) boot: u64,
}

impl HostIntake {
    /// An intake for the tags of a scene that its host program sets.
    pub(super) fn for_scene(scene: &LoadedScene) -> Self {
        let is_host_written = |spec: &TagSpec| {
            scene.config.tags.get(&spec.id).is_some_and(|tag| tag.is_host_written())
        };
        let specs = (0..).map(TagHandle).zip(scene.tags.specs());
        let telemetry = |(tag, spec): (TagHandle, &TagSpec)| TelemetryTag {
            tag,
            kind: spec.kind,
            freshness: spec.freshness,
            id: spec.id.clone(),
            address_json: String::new(),
        };
        let tags: Vec<_> = specs.filter(|(_, spec)| is_host_written(spec)).map(telemetry).collect();
        Self(SampleIntake::new(&tags, SourcePolicy::default()))
    }

    /// Passes on a value that the host program reported.
    pub(super) fn take(
        &mut self,
        tag: TagHandle,
        update: &TagUpdate,
        ArrivalTimes { now, wall, boot }: ArrivalTimes,
        sink: &mut impl SampleSink,
    ) {
        let waited = Duration::from_nanos(boot.saturating_sub(update.sent_at));
        self.0.take_program_value(&program_value(tag, update), waited, (now, wall), sink);
    }
}

fn program_value(tag: TagHandle, update: &TagUpdate) -> ProgramValue {
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
    let quality = match update.quality {
        TagQuality::Good => Quality::Good,
        TagQuality::Uncertain => Quality::Uncertain(Reason::Unknown),
        TagQuality::Bad => Quality::Bad(Reason::Unknown),
    };
    let source_time = update.source_time;
    ProgramValue { tag, value: update.value.map(value), quality, source_time }
}
