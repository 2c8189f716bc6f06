//! Plugins as the viewer uses them, in this process or isolated.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use busbar_geometry::Mesh;
use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    Instance, LinkReport, MeshOptimizer, OptimizedMesh, Overlay, OverlayBinding,
    OverlayDescription, OverlayPicture, PluginError, PluginInfo, SampleSink, SceneClock,
    SourcePolicy, Telemetry, TelemetryTag,
};
use busbar_tags::{Sample, SampleQueue, SourceTime, TagHandle, TagState};
use busbar_types::Origin;

use crate::process::PluginProcess;
use crate::simulator_detection::{SimulatorCheck, SimulatorDetector, is_connected_to_simulator};
use crate::socket_table::SocketOwner;
use crate::status::PluginStatus;

/// An instance of a plugin with its settings.
#[derive(Clone)]
pub enum Plugin {
    /// Instance in this process.
    InProcess(Arc<Instance>),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl Plugin {
    /// Returns the plugin's description of itself.
    pub fn info(&self) -> &PluginInfo {
        match self {
            Self::InProcess(instance) => instance.info(),
            Self::Isolated(process) => process.info(),
        }
    }

    /// The configuration's id of this instance.
    pub fn name(&self) -> &str {
        match self {
            Self::InProcess(instance) => instance.name(),
            Self::Isolated(process) => process.name(),
        }
    }

    /// Returns the state of its process; an instance in this process always runs.
    pub fn status(&self) -> PluginStatus {
        match self {
            Self::InProcess(_) => PluginStatus::default(),
            Self::Isolated(process) => process.status(),
        }
    }

    /// Begins to end its process, which then ends beside those of others; nothing
    /// can be done with it any more.
    pub fn quit(&self) {
        if let Self::Isolated(process) = self {
            process.quit();
        }
    }

    /// Starts it again now where it waits for that or is in quarantine.
    pub fn restart(&self) {
        if let Self::Isolated(process) = self {
            process.restart();
        }
    }
}

/// A telemetry plugin that serves tags. One in this process stops when this is
/// dropped, one in its own with the last of its [`Plugin`]s.
pub enum RunningTelemetry {
    /// Instance in this process.
    InProcess(Box<InProcessTelemetry>),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

/// A telemetry plugin in this process.
pub struct InProcessTelemetry {
    telemetry: Telemetry,
    /// Queue of received samples.
    queue: Arc<SampleQueue>,
    /// Detector of connections of this process to simulators.
    simulators: Mutex<SimulatorDetector>,
}

impl InProcessTelemetry {
    /// Delivers the samples since the last call. A connection of this process to a simulator
    /// counts for each plugin in it, since its owner is unknown.
    fn drain(&self, sink: &mut impl SampleSink) {
        let samples = self.queue.drain();
        // What says that there is no link comes from nowhere.
        let first = samples.iter().find(|sample| sample.value.is_some());
        let check = SimulatorCheck { first_sample: first.map(|sample| sample.received) };
        let has_samples = first.is_some();
        let mut simulators = self.simulators.lock().unwrap_or_else(PoisonError::into_inner);
        simulators.follow_link(self.telemetry.link().state);
        if simulators.is_due(has_samples) {
            let is_simulated =
                is_connected_to_simulator(SocketOwner::Process(std::process::id()), check);
            simulators.note_check(is_simulated, has_samples);
            if is_simulated {
                self.telemetry.add_origin(Origin::SIMULATED);
            }
        }
        // Also of samples that were queued before the intake was told.
        let origin = simulators.origin();
        for sample in &samples {
            sink.take(&Sample { origin: sample.origin | origin, ..sample.clone() });
        }
    }
}

impl RunningTelemetry {
    /// Reports whether a plugin has the telemetry capability.
    pub fn has_telemetry(plugin: &Plugin) -> bool {
        plugin.info().capabilities.iter().any(|id| id == abi::TELEMETRY_ID)
    }

    /// Validates tags and addresses with the plugin, without a connection.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says of addresses.
    pub fn check(plugin: &Plugin, tags: &[TelemetryTag]) -> Result<(), PluginError> {
        match plugin {
            Plugin::InProcess(instance) => Telemetry::check(instance, tags),
            Plugin::Isolated(process) => process.check(tags),
        }
    }

    /// Starts a plugin on its tags.
    ///
    /// # Errors
    /// Returns the errors of [`RunningTelemetry::check`].
    pub fn start(
        plugin: &Plugin,
        tags: &[TelemetryTag],
        policy: SourcePolicy,
    ) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                let queue = Arc::new(SampleQueue::default());
                let telemetry = Telemetry::start(instance.clone(), tags, queue.clone(), policy)?;
                Ok(Self::InProcess(Box::new(InProcessTelemetry {
                    telemetry,
                    queue,
                    simulators: Mutex::default(),
                })))
            }
            Plugin::Isolated(process) => {
                process.start(tags, policy)?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// The configuration's id of the instance.
    pub fn name(&self) -> &str {
        match self {
            Self::InProcess(own) => own.telemetry.instance().name(),
            Self::Isolated(process) => process.name(),
        }
    }

    /// Hands over the samples since the last call, the oldest first.
    pub fn drain(&self, sink: &mut impl SampleSink) {
        match self {
            Self::InProcess(own) => own.drain(sink),
            Self::Isolated(process) => process.drain(sink),
        }
    }

    /// Time that its values are of, where that is not now: a recording's.
    pub fn scene_time(&self) -> Option<SourceTime> {
        match self {
            Self::InProcess(own) => own.telemetry.scene_time(),
            Self::Isolated(process) => process.scene_time(),
        }
    }

    /// Returns the last link state with the counts of samples.
    pub fn link(&self) -> LinkReport {
        match self {
            Self::InProcess(own) => own.telemetry.link(),
            Self::Isolated(process) => process.link().unwrap_or_default(),
        }
    }
}

/// An overlay with its bindings.
pub enum RunningOverlay {
    /// Instance in this process.
    InProcess(Box<Overlay>),
    /// Plugin in a supervised process.
    Isolated {
        /// Process of the plugin.
        process: Arc<PluginProcess>,
        /// The tags bound, in the order of the bindings.
        tags: Vec<TagHandle>,
    },
}

impl RunningOverlay {
    /// Configures a plugin with its bindings.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says.
    pub fn configure(plugin: &Plugin, bindings: Vec<OverlayBinding>) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                let overlay = Overlay::configure(instance.clone(), bindings)?;
                Ok(Self::InProcess(Box::new(overlay)))
            }
            Plugin::Isolated(process) => {
                process.configure(&bindings)?;
                let tags = bindings.iter().map(|binding| binding.tag).collect();
                Ok(Self::Isolated { process: process.clone(), tags })
            }
        }
    }

    /// The configuration's id of the instance.
    pub fn name(&self) -> &str {
        match self {
            Self::InProcess(overlay) => overlay.instance().name(),
            Self::Isolated { process, .. } => process.name(),
        }
    }

    /// Returns the legend and other content besides values; the last received one where isolated.
    pub fn description(&self) -> Arc<OverlayDescription> {
        match self {
            Self::InProcess(overlay) => overlay.description().clone(),
            Self::Isolated { process, .. } => process.description(),
        }
    }

    /// Draws the overlay for these tag states. An isolated overlay returns the last complete
    /// picture, unless that is too old. The call waits up to `patience` for the picture of these
    /// very states.
    ///
    /// # Errors
    /// What the plugin says, the rule its result breaks, or how it ended.
    pub fn draw(
        &mut self,
        state: impl Fn(TagHandle) -> Option<TagState>,
        clock: SceneClock,
        patience: Duration,
    ) -> Result<Arc<OverlayPicture>, PluginError> {
        let states: Vec<Option<TagState>> = match self {
            Self::InProcess(overlay) => {
                overlay.bindings().iter().map(|binding| state(binding.tag)).collect()
            }
            Self::Isolated { tags, .. } => tags.iter().map(|&tag| state(tag)).collect(),
        };
        let scene_time = clock.time_of_values(states.iter().flatten());
        match self {
            Self::InProcess(overlay) => overlay.draw_states(&states, scene_time).map(Arc::new),
            Self::Isolated { process, .. } => process.draw(states, scene_time, patience),
        }
    }
}

/// A plugin that orders collapses. Several meshes may be optimised at once.
#[derive(Clone)]
pub enum Optimizer {
    /// Instance in this process.
    InProcess(MeshOptimizer),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl Optimizer {
    /// The optimiser that a plugin is.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                MeshOptimizer::from_instance(instance.clone()).map(Self::InProcess)
            }
            Plugin::Isolated(process) => {
                process.require_capability(abi::MESH_OPTIMIZER_ID)?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// The collapse sequence of a mesh. `progress` gets 0 to 1 and returns
    /// whether to go on. The wedges of each position must be together, as
    /// welding puts them.
    ///
    /// # Errors
    /// What the plugin says, the rule its result breaks, or how it ended.
    pub fn optimize(
        &self,
        mesh: &Mesh,
        mut progress: impl FnMut(f32) -> bool,
    ) -> Result<OptimizedMesh, PluginError> {
        match self {
            Self::InProcess(optimizer) => optimizer.optimize(mesh, progress),
            Self::Isolated(process) => process.optimize(mesh, &mut progress),
        }
    }
}
