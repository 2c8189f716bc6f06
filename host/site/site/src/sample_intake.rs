//! Intake of samples into tags, switching events, histories and alarms.

use busbar_history::History;
use busbar_plugin_host::SampleSink;
use busbar_tags::{Change, EventLog, Sample, TagTable};

use crate::alarms::AlarmService;

/// Receiver of samples: applies them to the tags, and changes to events, histories and alarms.
pub(crate) struct SampleUpdates<'a> {
    pub(crate) table: &'a mut TagTable,
    pub(crate) listeners: ChangeListeners<'a>,
}

/// Listeners to the changes of tags.
pub(crate) struct ChangeListeners<'a> {
    pub(crate) events: &'a mut EventLog,
    pub(crate) history: &'a mut History,
    pub(crate) alarms: Option<&'a mut AlarmService>,
}

impl ChangeListeners<'_> {
    /// Notes a change of a tag.
    #[inline(always)]
    pub(crate) fn note(&mut self, change: &Change) {
        self.events.note(change);
        self.history.note(change);
        if let Some(alarms) = &mut self.alarms {
            alarms.note(change);
        }
    }
}

impl SampleSink for SampleUpdates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        let Self { table, listeners } = self;
        table.apply(sample, |change| listeners.note(change));
    }
}
