//! Messages between the host and a plugin's process.

use std::path::PathBuf;
use std::time::SystemTime;

use busbar_alarms::SourceReport;
use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    ChartPage, CommandInfo, CommandReport, DeviceScenario, LinkState, OverlayBinding,
    OverlayDescription, OverlayPicture, PluginError, PluginInfo, RecordPage, SettingsError,
    SimulatedTag, Simulation, SimulationStatus, Stage, TelemetryTag, shown,
};
use busbar_tags::TagState;
use serde::{Deserialize, Serialize};

use crate::memory::MeshSizes;

/// Version of these messages: both processes are mostly the same program.
pub(crate) const PROTOCOL_VERSION: u32 = 8;
/// Bytes of an error in a plugin's words that are kept.
const MAX_WORDS_BYTES: usize = 4096;
/// Settings faults, and capabilities in an error, that are kept.
const MAX_FAULTS: usize = 64;

/// Messages from the host to a plugin's process.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum ToPlugin {
    /// Do something and answer with the same number.
    Call { call: u64, request: Request },
    /// Stop that call if it can be.
    Cancel { call: u64 },
    /// Liveness probe that is answered at once.
    Ping,
    /// Stop everything and end.
    Quit,
}

/// Requests of the host.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum Request {
    /// Confine this process and load the library; its descriptor comes along.
    Load { version: u32, path: PathBuf, confinement: Confinement },
    /// Make the one instance. Settings are JSON text.
    Create { name: String, plugin: String, settings: String },
    /// Validates tags and addresses without a connection.
    Check { tags: Vec<TelemetryTag> },
    /// Serve tags; the descriptor of the ring comes along.
    Start { tags: Vec<TelemetryTag> },
    /// Be the device of tags.
    Simulate { tags: Vec<SimulatedTag>, simulation: Simulation, scenario: DeviceScenario },
    /// Asks for the status of the simulation.
    SimulationStatus,
    /// Configures an overlay with its bindings.
    Configure { bindings: Vec<OverlayBinding> },
    /// Work out a picture from the states of the bound tags.
    Draw { states: Vec<Option<TagState>>, scene_time: SystemTime },
    /// Order collapses; the descriptors of mesh and room for results come along.
    Optimize { sizes: MeshSizes },
    /// Asks for the description of the chart.
    DescribeChart,
    /// Records of its chart, of so many axes, from one on.
    ReadChart { axes: u32, first: u64, count: u32 },
    /// Explains the last record of equipment at or before an instant.
    Explain { equipment: String, unix_nanos: i64 },
    /// Asks for the description of the record lists.
    DescribeRecords,
    /// Rows of a list, which has so many columns, from one on; none asks for the revision.
    ReadRecords { list: u32, columns: u32, first: u64, count: u32 },
    /// Asks for the list of commands.
    Commands,
    /// Run a command; the descriptors of its input and of a pipe for its output come along.
    Run { name: String, arguments: Vec<String> },
    /// Asks for alarms newer than a known revision; 0 for none.
    ReadAlarms { known: u64 },
    /// Asks for the properties of the optimizer.
    DescribeOptimizer,
}

/// Resource limits of a plugin's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confinement {
    /// Limit of the address space, bytes.
    pub memory_bytes: u64,
    /// True where the network may be used.
    pub network: bool,
}

/// Messages from a plugin's process to the host.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum FromPlugin {
    /// The answer to a call.
    Done { call: u64, result: Result<Answer, CallError> },
    /// Progress of a call, 0 to 1.
    Progress { call: u64, fraction: f32 },
    /// Link state reported by the plugin.
    Link { state: LinkState, message: String },
    /// Answer to a ping.
    Pong,
}

/// Results of the requests.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum Answer {
    /// The library is loaded: its plugins, and what confines the process.
    Loaded { plugins: Vec<PluginInfo>, confined: Vec<String> },
    /// Done, with nothing to tell.
    Done,
    /// Description of the overlay that was configured.
    Configured(OverlayDescription),
    /// Picture of an overlay.
    Drawn(OverlayPicture),
    /// Status of a simulation.
    Simulating(SimulationStatus),
    /// Number of collapses in the shared buffer, with the durations of stages.
    Optimized { collapses: u32, stages: Vec<Stage> },
    /// Description of the chart.
    ChartDescribed(busbar_chart::Description),
    /// Page of chart records.
    ChartRead(ChartPage),
    /// Explanation of a record.
    Explained(busbar_chart::Explanation),
    /// Description of the record lists.
    RecordsDescribed(busbar_records::Description),
    /// Page of a list's rows.
    RecordsRead(RecordPage),
    /// List of the commands.
    Commands(Vec<CommandInfo>),
    /// Report of a command.
    Ran(CommandReport),
    /// State of the alarms.
    AlarmsRead(SourceReport),
    /// Properties of the optimizer: true where it reads wedges.
    OptimizerDescribed { reads_wedges: bool },
}

/// A [`PluginError`] on its way.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum CallError {
    Library(String),
    WrongCapability { wanted: String, has: Vec<String> },
    Settings(Vec<SettingsError>),
    Failed { settings_at_fault: bool, message: String },
    Cancelled,
    Violation(String),
}

impl From<PluginError> for CallError {
    fn from(error: PluginError) -> Self {
        match error {
            PluginError::WrongCapability { wanted, has, .. } => {
                Self::WrongCapability { wanted: wanted.to_owned(), has }
            }
            PluginError::Settings { faults, .. } => Self::Settings(faults),
            PluginError::Failed { settings_at_fault, message, .. } => {
                Self::Failed { settings_at_fault, message }
            }
            PluginError::Cancelled => Self::Cancelled,
            PluginError::Violation { what, .. } => Self::Violation(what),
            other => Self::Failed { settings_at_fault: false, message: other.to_string() },
        }
    }
}

impl CallError {
    /// Converts to an error of the plugin with this id. The texts come from a process that may be
    /// hostile: they are cut and made printable.
    pub(crate) fn into_error(self, id: &str) -> PluginError {
        let id = id.to_owned();
        let words = |text: String| shown(&text, MAX_WORDS_BYTES);
        match self {
            Self::Library(what) | Self::Violation(what) => {
                PluginError::Violation { id, what: words(what) }
            }
            Self::WrongCapability { wanted, has } => {
                let known = [
                    abi::TELEMETRY_ID,
                    abi::OVERLAY_ID,
                    abi::MESH_OPTIMIZER_ID,
                    abi::SIMULATOR_ID,
                    abi::COMMAND_ID,
                    abi::CHART_ID,
                    abi::RECORDS_ID,
                    abi::ALARMS_ID,
                ];
                let has = has.into_iter().take(MAX_FAULTS).map(words).collect();
                match known.into_iter().find(|known| *known == wanted) {
                    Some(wanted) => PluginError::WrongCapability { id, wanted, has },
                    None => {
                        let what = format!("it has no capability {}", words(wanted));
                        PluginError::Violation { id, what }
                    }
                }
            }
            Self::Settings(faults) => {
                let faults = faults.into_iter().take(MAX_FAULTS).map(|fault| SettingsError {
                    pointer: words(fault.pointer),
                    message: words(fault.message),
                });
                PluginError::Settings { id, faults: faults.collect() }
            }
            Self::Failed { settings_at_fault, message } => {
                PluginError::Failed { id, settings_at_fault, message: words(message) }
            }
            Self::Cancelled => PluginError::Cancelled,
        }
    }
}

impl Request {
    /// Number of tags or bindings in the request.
    pub(crate) fn tags(&self) -> u32 {
        let count = match self {
            Self::Check { tags } | Self::Start { tags } => tags.len(),
            Self::Simulate { tags, .. } => tags.len(),
            Self::Configure { bindings } => bindings.len(),
            _ => 0,
        };
        u32::try_from(count).unwrap_or(u32::MAX)
    }

    /// Returns the name in messages for people.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Load { .. } => "load",
            Self::Create { .. } => "create",
            Self::Check { .. } => "check",
            Self::Start { .. } => "start",
            Self::Simulate { .. } => "simulate",
            Self::SimulationStatus => "simulation status",
            Self::Configure { .. } => "configure",
            Self::Draw { .. } => "draw",
            Self::Optimize { .. } => "optimize",
            Self::DescribeOptimizer => "describe optimiser",
            Self::DescribeChart => "describe chart",
            Self::ReadChart { .. } => "read chart",
            Self::Explain { .. } => "explain",
            Self::DescribeRecords => "describe records",
            Self::ReadRecords { .. } => "read records",
            Self::ReadAlarms { .. } => "read alarms",
            Self::Commands => "commands",
            Self::Run { .. } => "run",
        }
    }
}
