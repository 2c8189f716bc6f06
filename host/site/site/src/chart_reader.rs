//! Reads a plugin's chart beside the frames: a call may take as long as the plugin takes.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_chart::{Description, Explanation, MAX_RECORDS, Records};
use busbar_plugin_host::{MAX_PAGE_RECORDS, PluginError};
use busbar_plugin_process::{Plugin, RunningChart};

/// Period of polling for a new revision.
const POLL_PERIOD: Duration = Duration::from_secs(1);
/// Largest number of read attempts while records change.
const MAX_TRIES: u32 = 5;

/// A question: what a piece of equipment's record of an instant means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExplanationRequest {
    /// Id of the equipment in the chart's description.
    pub equipment: String,
    /// Instant of the record, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Number of the read that it refers to: [`ChartData::number`].
    pub read: u64,
}

/// Chart data that was read and not taken yet.
pub struct ChartData {
    /// Number of reads so far; a restarted plugin begins its revisions anew.
    pub number: u64,
    /// Description of axes, legend and equipment.
    pub description: Arc<Description>,
    /// All records of the chart.
    pub records: Records,
}

#[derive(Default)]
struct State {
    ends: bool,
    wanted: Option<ExplanationRequest>,
    read: Option<ChartData>,
    explained: Option<(ExplanationRequest, Result<Explanation, String>)>,
    fault: Option<String>,
    /// Number of polls so far.
    polls: u64,
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

/// A chart that is read on a thread of its own.
pub struct ChartReader {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl ChartReader {
    /// Starts the thread that reads a plugin's chart.
    ///
    /// # Errors
    /// A plugin without a chart, or no thread.
    pub fn start(plugin: &Plugin) -> Result<Self, PluginError> {
        let chart = RunningChart::from_plugin(plugin)?;
        let shared = Arc::new(Shared::default());
        let (theirs, plugin) = (shared.clone(), plugin.clone());
        let id = plugin.info().id.clone();
        let work = move || run(&plugin, &chart, &theirs);
        let thread = std::thread::Builder::new().name("chart".into()).spawn(work);
        let thread = thread.map_err(|error| PluginError::Failed {
            id,
            settings_at_fault: false,
            message: format!("no thread can be started to read its chart: {error}"),
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Waits until it was read once, or could not be.
    pub fn wait_for_first(&self, timeout: Duration) {
        self.wait(timeout, |state| state.polls > 0);
    }

    /// Takes the data read since the last call.
    pub fn take(&self) -> Option<ChartData> {
        self.shared.state().read.take()
    }

    /// Returns the fault that keeps the chart from being read.
    pub fn fault(&self) -> Option<String> {
        self.shared.state().fault.clone()
    }

    /// Returns the explanation if it is available, and requests it otherwise. Waits at most
    /// `timeout`.
    pub fn explain(
        &self,
        question: &ExplanationRequest,
        timeout: Duration,
    ) -> Option<Result<Explanation, String>> {
        let is_it = |state: &State| state.explained.as_ref().is_some_and(|(q, _)| q == question);
        {
            let mut state = self.shared.state();
            if !is_it(&state) && state.wanted.as_ref() != Some(question) {
                state.wanted = Some(question.clone());
                self.shared.changed.notify_all();
            }
        }
        self.wait(timeout, is_it);
        let state = self.shared.state();
        let answer = state.explained.as_ref().filter(|(asked, _)| asked == question);
        answer.map(|(_, answer)| answer.clone())
    }

    fn wait(&self, timeout: Duration, until: impl Fn(&State) -> bool) {
        let end = Instant::now() + timeout;
        let mut state = self.shared.state();
        while !until(&state) {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            let waited = self.shared.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for ChartReader {
    fn drop(&mut self) {
        self.shared.state().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It ends with its call, which has a deadline.
            let _ = thread.join();
        }
    }
}

fn run(plugin: &Plugin, chart: &RunningChart, shared: &Shared) {
    let (mut known, mut deaths, mut reads) = (None, 0, 0);
    let mut next_poll = Instant::now();
    loop {
        let wanted = {
            let state = shared.state();
            let left = next_poll.saturating_duration_since(Instant::now());
            let is_idle = |state: &mut State| !state.ends && state.wanted.is_none();
            let waited = shared.changed.wait_timeout_while(state, left, is_idle);
            let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
            if state.ends {
                return;
            }
            state.wanted.take()
        };
        if let Some(question) = wanted {
            let answer = chart.explain(question.equipment.clone(), question.unix_nanos);
            let answer = answer.map_err(|error| error.to_string());
            shared.state().explained = Some((question, answer));
        } else {
            // What another process counts may be the same by chance.
            let died = plugin.status().deaths;
            known = known.filter(|_| died == deaths);
            deaths = died;
            let read = poll(chart, known);
            next_poll = Instant::now() + POLL_PERIOD;
            let mut state = shared.state();
            state.polls += 1;
            match read {
                Ok(Some((revision, description, records))) => {
                    (known, reads) = (Some(revision), reads + 1);
                    state.fault = None;
                    state.read = Some(ChartData { number: reads, description, records });
                }
                Ok(None) => state.fault = None,
                Err(fault) => {
                    if state.fault.as_ref() != Some(&fault) {
                        tracing::error!(
                            plugin = plugin.name(),
                            "the chart cannot be read: {fault}"
                        );
                    }
                    (known, state.fault) = (None, Some(fault));
                }
            }
        }
        shared.changed.notify_all();
    }
}

/// Revision, description and records of a complete read.
type CompleteRead = (u64, Arc<Description>, Records);

/// Everything, if it is of another revision than is known.
fn poll(chart: &RunningChart, known: Option<u64>) -> Result<Option<CompleteRead>, String> {
    let words = |error: PluginError| error.to_string();
    if Some(chart.read(0, 0, 0).map_err(words)?.revision) == known {
        return Ok(None);
    }
    for _ in 0..MAX_TRIES {
        if let Some(read) = read_all(chart).map_err(|fault| fault.to_string())? {
            return Ok(Some(read));
        }
    }
    Err(format!("its records changed {MAX_TRIES} times while they were read"))
}

/// `None` where records changed meanwhile.
fn read_all(chart: &RunningChart) -> Result<Option<CompleteRead>, String> {
    let words = |error: PluginError| error.to_string();
    let revision = chart.read(0, 0, 0).map_err(words)?.revision;
    let description = chart.describe().map_err(words)?;
    let mut records = Records::new(&description);
    let axes = description.axes.len() as u32;
    loop {
        let first = records.len() as u64;
        let page = chart.read(axes, first, MAX_PAGE_RECORDS).map_err(words)?;
        if page.revision != revision {
            return Ok(None);
        }
        let states = description.legend.len();
        records.append(&page.records, &page.values, states).map_err(|fault| fault.to_string())?;
        let is_all = records.len() as u64 >= page.total || records.len() >= MAX_RECORDS;
        if is_all || page.records.is_empty() {
            return Ok(Some((revision, Arc::new(description), records)));
        }
    }
}
