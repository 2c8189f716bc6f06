//! Messages between the host and a plugin's process.

use std::path::PathBuf;
use std::time::SystemTime;

use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    CommandInfo, CommandReport, DeviceScenario, LinkState, OverlayBinding, OverlayDescription,
    OverlayPicture, PluginError, PluginInfo, SettingsError, SimulatedTag, Simulation,
    SimulationStatus, Stage, TelemetryTag, shown,
};
use busbar_tags::TagState;
use serde::{Deserialize, Serialize};

use crate::capability_messages::{CapabilityAnswer, CapabilityRequest};
use crate::memory::MeshSizes;

/// Version of these messages: both processes are mostly the same program.
pub(crate) const PROTOCOL_VERSION: u32 = 12;
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
    /// Calls a capability whose calls are a question and an answer.
    Capability(CapabilityRequest),
    /// Asks for the list of commands.
    Commands,
    /// Run a command; the descriptors of its input and of a pipe for its output come along.
    Run { name: String, arguments: Vec<String> },
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
    Optimized { collapses: u32, stages: Vec<Stage>, theta_by_mesh: bool },
    /// Answer to a call of a capability.
    Capability(CapabilityAnswer),
    /// List of the commands.
    Commands(Vec<CommandInfo>),
    /// Report of a command.
    Ran(CommandReport),
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
                let has = has.into_iter().take(MAX_FAULTS).map(words).collect();
                let mut known = abi::CAPABILITIES.iter().map(|capability| capability.id);
                match known.find(|known| *known == wanted) {
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
            Self::Capability(request) => request.name(),
            Self::Commands => "commands",
            Self::Run { .. } => "run",
        }
    }
}
