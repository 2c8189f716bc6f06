//! What plugins bring.

use super::*;

/// Where samples go: into the tags, and what they switch to the events.
struct Updates<'a> {
    tags: &'a mut TagTable,
    events: &'a mut EventLog,
}

impl SampleSink for Updates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self.tags.apply(sample, |change| self.events.note(change));
    }
}

impl Viewer {
    /// Starts a plugin again that waits for that or is in quarantine.
    pub fn start_plugin(&self, name: &str) {
        if let Some(plugin) = self.scene.instances.get(name) {
            plugin.start_again();
        }
    }

    /// The tags as the last frame showed them.
    pub fn tags(&self) -> Snapshot<'_> {
        self.tags.snapshot()
    }

    /// What switched since the start, in the order in which it came.
    pub fn events(&self) -> &EventLog {
        &self.events
    }

    /// Takes over what plugins brought; values past their limit are stale from here on.
    pub(super) fn take_samples(&mut self) {
        let (tags, events) = (&mut self.tags, &mut self.events);
        tags.follow_clock(wall_clock(), Moment::now());
        for telemetry in &self.telemetry {
            telemetry.drain(&mut Updates { tags, events });
        }
        tags.advance(Moment::now(), |change| events.note(change));
    }
}
