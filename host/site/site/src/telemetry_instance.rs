//! Running telemetry plugins and their tags, across reloads.

use std::time::{Duration, Instant};

use busbar_plugin_host::{ClockReport, LinkReport, SampleSink};
use busbar_plugin_process::RunningTelemetry;
use busbar_tags::{HandleRemap, Sample, SourceTime};

/// Running telemetry plugin with the map from its tag indices to the present ones.
pub(crate) struct TelemetryInstance {
    running: RunningTelemetry,
    /// Map from the plugin's tag indices to the present ones.
    remap: HandleRemap,
    clock_log: ClockLog,
}

/// Findings about the source's clock that the log has.
#[derive(Default)]
struct ClockLog {
    logged: ClockReport,
    next: Option<Instant>,
}

/// Least time between two looks at the findings about a source's clock.
const CLOCK_LOG_PERIOD: Duration = Duration::from_secs(1);

impl ClockLog {
    /// Sentences of a report that tell something new: a skew that came or went, another
    /// step, the first time that cannot be used.
    fn new_remarks(&mut self, report: ClockReport) -> Vec<String> {
        let is_new = |report: ClockReport, before: ClockReport| {
            report.skew_nanos.is_some() != before.skew_nanos.is_some()
                || report.steps != before.steps
                || (report.future_times > 0) != (before.future_times > 0)
                || (report.unusable_times > 0) != (before.unusable_times > 0)
        };
        if !is_new(report, self.logged) {
            return Vec::new();
        }
        let had_skew = self.logged.skew_nanos.is_some();
        self.logged = report;
        match report.remarks() {
            remarks if remarks.is_empty() && had_skew => {
                vec!["the source's clock agrees with this machine's again".to_owned()]
            }
            remarks => remarks,
        }
    }
}

impl TelemetryInstance {
    /// Wraps a plugin that was just started.
    pub(crate) fn new(running: RunningTelemetry) -> Self {
        Self { running, remap: HandleRemap::default(), clock_log: ClockLog::default() }
    }

    /// The configuration's id of the instance.
    pub(crate) fn name(&self) -> &str {
        self.running.name()
    }

    /// Adapts to other tag indices after a reload.
    pub(crate) fn remap_tags(&mut self, remap: &HandleRemap) {
        self.remap = self.remap.then(remap);
    }

    /// Passes on the samples since the last call, the oldest first.
    #[inline(always)]
    pub(crate) fn drain(&self, sink: &mut impl SampleSink) {
        if self.remap.is_identity() {
            return self.running.drain(sink);
        }
        self.running.drain(&mut |sample: &Sample| {
            if let Some(tag) = self.remap.tag(sample.tag) {
                sink.take(&Sample { tag, ..sample.clone() });
            }
        });
    }

    /// Logs new findings about the source's clock, once for each step or skew.
    pub(crate) fn log_clock(&mut self) {
        let now = Instant::now();
        if self.clock_log.next.is_some_and(|next| now < next) {
            return;
        }
        self.clock_log.next = Some(now + CLOCK_LOG_PERIOD);
        for new_remarks in self.clock_log.new_remarks(self.running.link().clock) {
            tracing::warn!(plugin = self.running.name(), "{new_remarks}");
        }
    }

    /// Time that its values are of, where that is not now: a recording's.
    pub(crate) fn scene_time(&self) -> Option<SourceTime> {
        self.running.scene_time()
    }

    /// Returns the link state that the plugin reported, with sample counters.
    pub(crate) fn link(&self) -> LinkReport {
        self.running.link()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_and_a_skew_are_logged_once_each() {
        let mut log = ClockLog::default();
        let mut report = ClockReport::default();
        assert!(log.new_remarks(report).is_empty());
        report.steps = 1;
        assert_eq!(log.new_remarks(report).len(), 1);
        assert!(log.new_remarks(report).is_empty());
        report.steps = 2;
        assert_eq!(log.new_remarks(report), ["the source's clock was set back 2 times"]);
        report = ClockReport { skew_nanos: Some(3_600_000_000_000), ..ClockReport::default() };
        assert_eq!(log.new_remarks(report).len(), 1);
        report.skew_nanos = Some(3_600_000_000_001);
        assert!(log.new_remarks(report).is_empty());
        let agrees = log.new_remarks(ClockReport::default());
        assert_eq!(agrees, ["the source's clock agrees with this machine's again"]);
    }
}
