//! Reads a plugin's chart beside the frames: a call may take as long as the plugin takes.

use std::sync::Arc;
use std::time::Duration;

use busbar_chart::{Description, Explanation, MAX_RECORDS, Records};
use busbar_plugin_host::{MAX_PAGE_RECORDS, PluginError};
use busbar_plugin_process::{Plugin, RunningChart};

use crate::plugin_poller::{PluginPoller, PolledCapability, SharedState, note_fault};

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

/// Chart of a plugin, with the revision that is known and the question to answer next.
struct PolledChart {
    chart: RunningChart,
    known: Option<u64>,
    reads: u64,
    asked: Option<ExplanationRequest>,
}

/// Chart as it was read, and questions about it.
#[derive(Default)]
struct ReadChart {
    wanted: Option<ExplanationRequest>,
    read: Option<ChartData>,
    explained: Option<(ExplanationRequest, Result<Explanation, String>)>,
    fault: Option<String>,
}

impl PolledCapability for PolledChart {
    const SUBJECT: &'static str = "chart";
    const PERIOD: Duration = Duration::from_secs(1);
    type State = ReadChart;

    fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        let chart = RunningChart::from_plugin(plugin)?;
        Ok(Self { chart, known: None, reads: 0, asked: None })
    }

    fn forget(&mut self) {
        self.known = None;
    }

    fn poll(&mut self, plugin: &Plugin, shared: &SharedState<ReadChart>) {
        let read = poll(&self.chart, self.known);
        shared.with(|state| {
            let fault = match read {
                Ok(None) => None,
                Ok(Some((revision, description, records))) => {
                    (self.known, self.reads) = (Some(revision), self.reads + 1);
                    state.read = Some(ChartData { number: self.reads, description, records });
                    None
                }
                Err(fault) => {
                    self.known = None;
                    Some(fault)
                }
            };
            note_fault::<Self>(plugin, &mut state.fault, fault);
        });
    }

    fn take_request(&mut self, state: &mut ReadChart) -> bool {
        self.asked = state.wanted.take();
        self.asked.is_some()
    }

    fn answer(&mut self, shared: &SharedState<ReadChart>) {
        let Some(question) = self.asked.take() else { return };
        let answer = self.chart.explain(question.equipment.clone(), question.unix_nanos);
        let answer = answer.map_err(|error| error.to_string());
        shared.with(|state| state.explained = Some((question, answer)));
    }
}

/// A chart that is read on a thread of its own.
pub struct ChartReader(PluginPoller<PolledChart>);

impl ChartReader {
    /// Starts the thread that reads a plugin's chart.
    ///
    /// # Errors
    /// A plugin without a chart, or no thread.
    pub fn start(plugin: &Plugin) -> Result<Self, PluginError> {
        PluginPoller::start(plugin).map(Self)
    }

    /// Waits until it was read once, or could not be.
    pub fn wait_for_first(&self, timeout: Duration) {
        self.0.wait_for_first(timeout);
    }

    /// Takes the data read since the last call.
    pub fn take(&self) -> Option<ChartData> {
        self.0.with(|state| state.read.take())
    }

    /// Returns the fault that keeps the chart from being read.
    pub fn fault(&self) -> Option<String> {
        self.0.with(|state| state.fault.clone())
    }

    /// Returns the explanation if it is available, and requests it otherwise. Waits at most
    /// `timeout`.
    pub fn explain(
        &self,
        question: &ExplanationRequest,
        timeout: Duration,
    ) -> Option<Result<Explanation, String>> {
        let is_it =
            |state: &ReadChart| state.explained.as_ref().is_some_and(|(q, _)| q == question);
        let is_asked = self.0.with(|state| {
            let is_new = !is_it(state) && state.wanted.as_ref() != Some(question);
            if is_new {
                state.wanted = Some(question.clone());
            }
            is_new
        });
        if is_asked {
            self.0.wake();
        }
        self.0.wait_until(timeout, is_it);
        self.0.with(|state| {
            let answer = state.explained.as_ref().filter(|(asked, _)| asked == question);
            answer.map(|(_, answer)| answer.clone())
        })
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
