//! The tags that a telemetry plugin serves, whatever numbers they have by now.

use busbar_plugin_host::{LinkReport, SampleSink};
use busbar_plugin_process::RunningTelemetry;
use busbar_tags::{Renumbering, Sample};

/// A telemetry plugin that runs, and what it calls its tags.
pub(crate) struct ServedTags {
    running: RunningTelemetry,
    /// From the numbers that it was told to those of now.
    numbers: Renumbering,
}

impl ServedTags {
    /// By a plugin that was just started.
    pub(crate) fn by(running: RunningTelemetry) -> Self {
        Self { running, numbers: Renumbering::default() }
    }

    /// The configuration's id of the instance.
    pub(crate) fn name(&self) -> &str {
        self.running.name()
    }

    /// Goes on where tags have other numbers.
    pub(crate) fn follow(&mut self, numbers: &Renumbering) {
        self.numbers = self.numbers.then(numbers);
    }

    /// Hands over the samples since the last call, the oldest first.
    #[inline(always)]
    pub(crate) fn drain(&self, sink: &mut impl SampleSink) {
        if self.numbers.is_none() {
            return self.running.drain(sink);
        }
        self.running.drain(&mut |sample: &Sample| {
            if let Some(tag) = self.numbers.tag(sample.tag) {
                sink.take(&Sample { tag, ..*sample });
            }
        });
    }

    /// What it last said of its link, and what came through it.
    pub(crate) fn link(&self) -> LinkReport {
        self.running.link()
    }
}
