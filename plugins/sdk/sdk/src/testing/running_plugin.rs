//! Telemetry plugin that runs in a test, with its recorder.

use std::time::Duration;

use super::{Recorder, Recording};
use crate::{LinkState, Quality, Reason, Sample, TagSpec, Telemetry, Value};

/// Telemetry plugin that was started, with the recorder of its samples. Its waits fail the test
/// when they take too long.
///
/// ```no_run
/// # use std::time::Duration;
/// # use busbar_plugin_sdk::testing::RunningPlugin;
/// # use busbar_plugin_sdk::{Reason, TagSpec, Telemetry, Value};
/// # fn test(plugin: impl Telemetry, tags: Vec<TagSpec>) {
/// let running = RunningPlugin::start(plugin, tags, Duration::from_secs(10));
/// running.wait_for(1, Value::F64(21.5));
/// running.wait_for_bad(2, Reason::Communication);
/// # }
/// ```
pub struct RunningPlugin<P> {
    /// Plugin; it ends before its recorder.
    pub plugin: P,
    /// Recorder of the plugin's samples and link reports.
    pub recorder: Recorder,
    /// Longest time of a wait: enough for a loaded machine.
    pub patience: Duration,
}

impl<P: Telemetry> RunningPlugin<P> {
    /// Starts a plugin with these tags.
    ///
    /// # Panics
    /// When it refuses.
    #[track_caller]
    pub fn start(mut plugin: P, tags: Vec<TagSpec>, patience: Duration) -> Self {
        let recorder = Recorder::new();
        if let Err(error) = plugin.start(tags, recorder.sink()) {
            panic!("the plugin does not start: {error}");
        }
        Self { plugin, recorder, patience }
    }

    /// Waits until a tag has this value, and it is good.
    ///
    /// # Panics
    /// When it has not in time.
    #[track_caller]
    pub fn wait_for(&self, tag: u32, value: Value) {
        self.wait("value", tag, |sample| {
            sample.value.as_ref() == Some(&value) && sample.quality.is_good()
        });
    }

    /// Waits until a tag is bad for this reason.
    ///
    /// # Panics
    /// When it is not in time.
    #[track_caller]
    pub fn wait_for_bad(&self, tag: u32, reason: Reason) {
        self.wait_for_quality(tag, Quality::Bad(reason));
    }

    /// Waits until a tag has this quality.
    ///
    /// # Panics
    /// When it has not in time.
    #[track_caller]
    pub fn wait_for_quality(&self, tag: u32, quality: Quality) {
        self.wait("quality", tag, |sample| sample.quality == quality);
    }

    /// Waits until a tag's newest sample satisfies a condition; `what` names the condition.
    ///
    /// # Panics
    /// When it is not in time.
    #[track_caller]
    pub fn wait(&self, what: &str, tag: u32, wanted: impl Fn(&Sample) -> bool) {
        let is_there = |seen: &Recording| seen.latest(tag).is_some_and(|sample| wanted(&sample));
        let latest = || self.recorder.latest(tag);
        let arrived = self.recorder.wait_until(self.patience, is_there);
        assert!(arrived, "{what} of tag {tag}: {:?}; links {:?}", latest(), self.links());
    }

    /// Waits for any sample of a tag that satisfies a condition, newest or not.
    ///
    /// # Panics
    /// When there is none in time.
    #[track_caller]
    pub fn wait_for_any(&self, tag: u32, wanted: impl Fn(&Sample) -> bool) {
        let is_wanted = |sample: &Sample| sample.tag == tag && wanted(sample);
        let has = |seen: &Recording| seen.samples.iter().any(is_wanted);
        let latest = || self.recorder.latest(tag);
        assert!(self.recorder.wait_until(self.patience, has), "tag {tag}: {:?}", latest());
    }

    /// Waits for a link report with this state and text.
    ///
    /// # Panics
    /// When there is none in time.
    #[track_caller]
    pub fn wait_for_link(&self, state: LinkState, message: &str) {
        let said = |seen: &Recording| {
            seen.links.iter().any(|(found, said)| *found == state && said.contains(message))
        };
        let arrived = self.recorder.wait_until(self.patience, said);
        assert!(arrived, "{state:?} {message}: {:?}", self.links());
    }

    /// Reports whether any sample is good.
    pub fn has_good_samples(&self) -> bool {
        self.recorder.recording().samples.iter().any(|sample| sample.quality.is_good())
    }

    /// Returns the samples of a tag that have a value, in order.
    pub fn samples(&self, tag: u32) -> Vec<Sample> {
        let samples = self.recorder.recording().samples;
        samples.into_iter().filter(|s| s.tag == tag && s.value.is_some()).collect()
    }

    fn links(&self) -> Vec<(LinkState, String)> {
        self.recorder.recording().links.into()
    }
}
