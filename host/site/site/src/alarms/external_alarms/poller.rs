//! Reads a plugin's alarms beside the frames: a call may take as long as the plugin takes.

use std::time::{Duration, Instant};

use busbar_alarms::{SourceAlarm, SourceReport};
use busbar_plugin_host::PluginError;
use busbar_plugin_process::{Plugin, RunningAlarms};

use crate::plugin_poller::{PluginPoller, PolledCapability, SharedState};

/// Alarms of a plugin, with the revision that is known.
pub(super) struct PolledAlarms {
    alarms: RunningAlarms,
    known: u64,
}

/// Alarms as they were read, and how their source is.
pub(super) struct ReadAlarms {
    /// Alarms that were read and not taken yet.
    new_alarms: Option<Vec<SourceAlarm>>,
    health: SourceHealth,
}

/// Liveness of an external alarm source.
#[derive(Clone, Debug, Default)]
pub(super) struct SourceHealth {
    /// Instant of the source's last sign of life.
    pub(super) last_heard: Option<Instant>,
    /// Reason why the source is not current: its own report, or a plugin that does not answer.
    pub(super) fault: Option<String>,
    /// Alarms that it has beyond those reported.
    pub(super) left_out: u64,
}

impl Default for ReadAlarms {
    fn default() -> Self {
        let fault = Some("not asked yet".to_owned());
        Self { new_alarms: None, health: SourceHealth { fault, ..SourceHealth::default() } }
    }
}

impl PolledCapability for PolledAlarms {
    const SUBJECT: &'static str = "alarms";
    /// Alarms change on the screen no more often.
    const PERIOD: Duration = Duration::from_millis(500);
    type State = ReadAlarms;

    fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        Ok(Self { alarms: RunningAlarms::from_plugin(plugin)?, known: 0 })
    }

    fn forget(&mut self) {
        self.known = 0;
    }

    fn poll(&mut self, _plugin: &Plugin, shared: &SharedState<ReadAlarms>) {
        let read = self.alarms.read(self.known);
        shared.with(|state| match read {
            Ok(report) => take(report, &mut self.known, state),
            Err(error) => state.health.fault = Some(error.to_string()),
        });
    }
}

/// Takes the alarms, if they were read anew since the last call; and how the source is.
pub(super) fn take_alarms(
    poller: &PluginPoller<PolledAlarms>,
) -> (Option<Vec<SourceAlarm>>, SourceHealth) {
    poller.with(|state| (state.new_alarms.take(), state.health.clone()))
}

fn take(report: SourceReport, known: &mut u64, state: &mut ReadAlarms) {
    let SourceReport { revision, heard_millis, fault, left_out, alarms } = report;
    let last_heard =
        heard_millis.and_then(|ago| Instant::now().checked_sub(Duration::from_millis(ago)));
    // A plugin that was started again has heard of nothing yet; its alarms are old.
    let last_heard = last_heard.max(state.health.last_heard);
    state.health = SourceHealth { last_heard, fault, left_out };
    if let Some(alarms) = alarms.filter(|_| *known != revision) {
        *known = revision;
        state.new_alarms = Some(alarms);
    }
}
