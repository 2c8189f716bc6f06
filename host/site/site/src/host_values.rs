//! Intake of the values that a host program sets: by the rules for samples of plugins.

use std::time::Duration;

use busbar_config::OriginConfig;
use busbar_plugin_host::{ProgramValue, SampleIntake, SampleSink, SourcePolicy, TelemetryTag};
use busbar_tags::{Moment, SourceTime, TagHandle, TagSpec, TagTable};
use busbar_types::{Quality, Value};

use crate::definition::SiteDefinition;

/// Value that a host program sets.
#[derive(Clone, Debug, PartialEq)]
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

impl HostTagValue {
    /// Creates a good value that is set now.
    pub fn from_number(number: f64) -> Self {
        let (value, quality) = (Some(Value::F64(number)), Quality::Good);
        Self { value, quality, source_time: None, waited: Duration::ZERO }
    }
}

/// Judges the values that a host program sets, one source of many tags.
pub(crate) struct HostIntake(SampleIntake);

impl HostIntake {
    /// Creates an intake for the tags that the host program sets.
    pub(crate) fn new(site: &SiteDefinition) -> Self {
        let is_host_written = |spec: &TagSpec| {
            site.config.tags.get(&spec.id).is_some_and(|tag| tag.is_host_written())
        };
        let specs = (0..).map(TagHandle).zip(site.tags.specs());
        let telemetry = |(tag, spec): (TagHandle, &TagSpec)| TelemetryTag {
            tag,
            kind: spec.kind,
            freshness: spec.freshness,
            id: spec.id.clone(),
            address_json: String::new(),
            unit: spec.unit.clone(),
        };
        let tags: Vec<_> = specs.filter(|(_, spec)| is_host_written(spec)).map(telemetry).collect();
        Self(SampleIntake::new(&tags, SourcePolicy::default()))
    }

    /// Passes on a value of the host program that arrived at `now` on both clocks.
    pub(crate) fn take(
        &mut self,
        tag: TagHandle,
        value: HostTagValue,
        now: (Moment, SourceTime),
        sink: &mut impl SampleSink,
    ) {
        let HostTagValue { value, quality, source_time, waited } = value;
        let value = ProgramValue { tag, value, quality, source_time };
        self.0.take_program_value(&value, waited, now, sink);
    }
}

/// Returns the handle of a tag that the host program sets.
///
/// # Errors
/// A text: the tag does not exist or is not set by the host.
pub(crate) fn host_tag(site: &SiteDefinition, id: &str) -> Result<TagHandle, String> {
    let found = site.tags.specs().binary_search_by(|spec| spec.id.as_str().cmp(id));
    let by_host = site.config.tags.get(id).map(|tag| tag.is_host_written());
    let (Ok(index), Some(by_host)) = (found, by_host) else {
        return Err(format!("there is no tag '{id}'"));
    };
    if !by_host {
        return Err(format!(
            "tag '{id}' comes from elsewhere; say \"set_by_host\": true in the configuration \
             instead of its source"
        ));
    }
    Ok(TagHandle(index as u32))
}

/// Creates an empty tag table. Host values survive a stop of this process, since their queue does.
pub(crate) fn empty_table(site: &SiteDefinition) -> TagTable {
    let mut table = TagTable::new(site.tags.clone(), Moment::now());
    let is_by_host = |spec: &TagSpec| {
        let tag = site.config.tags.get(&spec.id);
        tag.is_some_and(|tag| matches!(tag.origin, OriginConfig::Host))
    };
    let specs = site.tags.specs().iter().zip(0..);
    let by_host = specs.filter(|(spec, _)| is_by_host(spec)).map(|(_, tag)| TagHandle(tag));
    table.keep_current_across_stops(by_host);
    table
}
