//! Intake of the values that a host program sets: by the rules for samples of plugins.

use std::time::Duration;

use busbar_plugin_host::{ProgramValue, SampleIntake, SampleSink, SourcePolicy, TelemetryTag};
use busbar_tags::{Moment, Quality, SourceTime, TagHandle, TagSpec, Value};

use busbar_scene_loader::LoadedScene;

/// Value that a host program sets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HostTagValue {
    /// New value; none changes the quality alone.
    pub value: Option<Value>,
    /// Quality of the value.
    pub quality: Quality,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, if known.
    pub source_time: Option<i64>,
    /// Time since the host program set the value; it counts as age.
    pub waited: Duration,
}

/// Judges the values that a host program sets, one source of many tags.
pub(super) struct HostIntake(SampleIntake);

/// An instant by the clocks of this process.
#[derive(Clone, Copy)]
pub(super) struct ArrivalTimes {
    /// Instant on the monotonic clock of moments.
    pub(super) now: Moment,
    /// Instant on the wall clock.
    pub(super) wall: SourceTime,
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
        value: &HostTagValue,
        ArrivalTimes { now, wall }: ArrivalTimes,
        sink: &mut impl SampleSink,
    ) {
        let HostTagValue { value, quality, source_time, waited } = *value;
        let value = ProgramValue { tag, value, quality, source_time };
        self.0.take_program_value(&value, waited, (now, wall), sink);
    }
}
