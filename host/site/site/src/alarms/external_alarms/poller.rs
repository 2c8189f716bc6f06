//! Reads a plugin's alarms beside the frames: a call may take as long as the plugin takes.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_alarms::{SourceAlarm, SourceReport};
use busbar_plugin_host::PluginError;
use busbar_plugin_process::{Plugin, RunningAlarms};

/// Period of polling the plugin; alarms change on the screen no more often.
const POLL_PERIOD: Duration = Duration::from_millis(500);

/// State shared with the polling thread.
#[derive(Default)]
struct State {
    ends: bool,
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

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Alarms that are read on a thread of their own.
pub(super) struct AlarmPoller {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl AlarmPoller {
    pub(super) fn start(plugin: &Plugin) -> Result<Self, PluginError> {
        let alarms = RunningAlarms::from_plugin(plugin)?;
        let shared = Arc::new(Shared::default());
        shared.state().health.fault = Some("not asked yet".to_owned());
        let (theirs, plugin) = (shared.clone(), plugin.clone());
        let id = plugin.info().id.clone();
        let work = move || run(&plugin, &alarms, &theirs);
        let thread = std::thread::Builder::new().name("alarms".into()).spawn(work);
        let thread = thread.map_err(|error| PluginError::Failed {
            id,
            settings_at_fault: false,
            message: format!("no thread can be started to read its alarms: {error}"),
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// The alarms, if they were read anew since the last call; and how the source is.
    pub(super) fn take(&self) -> (Option<Vec<SourceAlarm>>, SourceHealth) {
        let mut state = self.shared.state();
        (state.new_alarms.take(), state.health.clone())
    }
}

impl Drop for AlarmPoller {
    fn drop(&mut self) {
        self.shared.state().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It ends with its call, which has a deadline.
            let _ = thread.join();
        }
    }
}

fn run(plugin: &Plugin, alarms: &RunningAlarms, shared: &Shared) {
    let (mut known, mut deaths) = (0, 0);
    loop {
        // What another process counts may be the same by chance.
        let died = plugin.status().deaths;
        known = if died == deaths { known } else { 0 };
        deaths = died;
        let read = alarms.read(known);
        let mut state = shared.state();
        match read {
            Ok(report) => take(report, &mut known, &mut state),
            Err(error) => state.health.fault = Some(error.to_string()),
        }
        let is_running = |state: &mut State| !state.ends;
        let waited = shared.changed.wait_timeout_while(state, POLL_PERIOD, is_running);
        if waited.unwrap_or_else(PoisonError::into_inner).0.ends {
            return;
        }
    }
}

fn take(report: SourceReport, known: &mut u64, state: &mut State) {
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
