//! Tag values written by a host program, judged by the rules for samples of plugins.

use std::time::Duration;

use busbar_plugin_abi as abi;
use busbar_tags::{Moment, Sample, SourceTime, TagHandle};
use busbar_types::{Quality, Value};

use crate::PublishedSample;
use crate::sample_intake::{SampleIntake, SampleSink};

/// Tag value written by a host program, with the time that it gives.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramValue {
    /// Tag that it is of.
    pub tag: TagHandle,
    /// Value of the tag; none for a quality alone.
    pub value: Option<Value>,
    /// Quality without its reason: the program gives none.
    pub quality: Quality,
    /// Time since which it is so, nanoseconds since 1970.
    pub source_time: Option<i64>,
}

impl SampleIntake {
    /// Delivers a value that the program wrote `waited` ago to `sink`, as a sample of a plugin
    /// received at that time. Waiting in a queue makes no value younger. `now` is the present
    /// instant, and `wall_clock` the same on the wall clock. Returns false for a tag of another
    /// instance.
    pub fn take_program_value(
        &mut self,
        value: &ProgramValue,
        waited: Duration,
        (now, wall_clock): (Moment, SourceTime),
        sink: &mut impl SampleSink,
    ) -> bool {
        self.follow_clock(wall_clock, now);
        let waited_nanos = i64::try_from(waited.as_nanos()).unwrap_or(i64::MAX);
        let (said, called) =
            (now.before(waited), SourceTime(wall_clock.0.saturating_sub(waited_nanos)));
        let mut sink = |sample: &Sample| sink.take(&Sample { received: now, ..sample.clone() });
        self.take(&value.to_raw(), said, called, &mut sink)
    }
}

impl ProgramValue {
    fn to_raw(&self) -> PublishedSample {
        let (kind, bits, text) = PublishedSample::value_fields(self.value.as_ref());
        // The least number stands for no time between plugin and host; here it is a time.
        let is_unusable = self.source_time == Some(abi::BUSBAR_NO_TIME);
        PublishedSample {
            tag: self.tag.0,
            kind,
            quality: self.quality.level().code(),
            reason: abi::BUSBAR_REASON_NONE,
            flags: if is_unusable { abi::BUSBAR_SAMPLE_TIME_UNUSABLE } else { 0 },
            bits,
            source_time_unix_nanos: self.source_time.unwrap_or(abi::BUSBAR_NO_TIME),
            text,
        }
    }
}

#[cfg(test)]
#[path = "program_value_tests.rs"]
mod tests;
