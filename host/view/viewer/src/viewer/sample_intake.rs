//! Intake of plugin samples into tags, events, histories and alarms.

use super::*;

/// Receiver of samples: applies them to the tags, and changes to events, histories and alarms.
pub(super) struct SampleUpdates<'a> {
    pub(super) tags: &'a mut TagTable,
    pub(super) events: &'a mut EventLog,
    pub(super) history: &'a mut History,
    pub(super) alarms: Option<&'a mut AlarmService>,
}

impl SampleSink for SampleUpdates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        let Self { tags, events, history, alarms } = self;
        tags.apply(sample, |change| {
            events.note(change);
            history.note(change);
            if let Some(alarms) = alarms {
                alarms.note(change);
            }
        });
    }
}

impl Viewer {
    /// Starts a plugin again that waits for that or is in quarantine.
    pub fn start_plugin(&self, name: &str) {
        if let Some(plugin) = self.scene.instances.get(name) {
            plugin.restart();
        }
    }

    /// The tags as the last frame showed them.
    pub fn tags(&self) -> Snapshot<'_> {
        self.tags.snapshot()
    }

    /// Returns the switching events since the start, in order of arrival.
    pub fn events(&self) -> &EventLog {
        &self.events
    }

    /// Holds values from before a pause of the process or the machine for stale.
    fn mark_stale_after_pause(&mut self) {
        let Some(pause) = self.pauses.take() else { return };
        tracing::warn!("{pause}");
        let Self { tags, events, history, alarms, .. } = self;
        tags.mark_stale_before(&pause, |change| {
            events.note(change);
            history.note(change);
            if let Some(alarms) = alarms {
                alarms.note(change);
            }
        });
    }

    /// Takes the samples of all plugins; values beyond their freshness limit become stale. Returns
    /// the CPU time.
    pub(super) fn take_samples(&mut self) -> FrameStageMillis {
        let began = CpuClock::start();
        self.mark_stale_after_pause();
        let Self { tags, events, history, .. } = self;
        for telemetry in &mut self.telemetry {
            telemetry.log_clock();
            let alarms = self.alarms.as_mut();
            telemetry.drain(&mut SampleUpdates { tags, events, history, alarms });
        }
        let (now, mut alarms) = (Moment::now(), self.alarms.as_mut());
        tags.advance(now, |change| {
            events.note(change);
            history.note(change);
            if let Some(alarms) = &mut alarms {
                alarms.note(change);
            }
        });
        history.follow(tags.snapshot(), now);
        let tags_millis = began.millis();
        if let Some(alarms) = alarms {
            alarms.take_sources(&self.scene);
            alarms.step(tags.snapshot(), now, wall_clock());
        }
        let alarms_millis = began.millis() - tags_millis;
        FrameStageMillis { tags: tags_millis, alarms: alarms_millis, ..FrameStageMillis::default() }
    }
}
