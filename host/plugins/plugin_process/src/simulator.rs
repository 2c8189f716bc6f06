//! Plugins that are devices, wherever they run.

use std::sync::Arc;

use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    DeviceScenario, PluginError, SimulatedTag, Simulation, SimulationStatus, Simulator, shown,
};

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;
use crate::process_state::SimulationSetup;

/// Plugin that simulates the devices of its tags. An in-process simulator stops when this is
/// dropped, an isolated one with the last of its [`Plugin`]s.
pub enum RunningSimulator {
    /// Instance in this process.
    InProcess(Simulator),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl RunningSimulator {
    /// Reports whether a plugin has the simulator capability.
    pub fn is_offered_by(plugin: &Plugin) -> bool {
        plugin.info().capabilities.iter().any(|id| id == abi::SIMULATOR_ID)
    }

    /// Starts a plugin as the device of its tags. One whose process dies is started
    /// again, and is that device again.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says of addresses and of the
    /// place where it is to listen.
    pub fn start(
        plugin: &Plugin,
        tags: Vec<SimulatedTag>,
        simulation: &Simulation,
        scenario: DeviceScenario,
    ) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                Simulator::start(instance.clone(), &tags, simulation, &scenario)
                    .map(Self::InProcess)
            }
            Plugin::Isolated(process) => {
                process.simulate(SimulationSetup {
                    tags,
                    simulation: simulation.clone(),
                    scenario,
                })?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// The configuration's id of the instance.
    pub fn name(&self) -> &str {
        match self {
            Self::InProcess(simulator) => simulator.instance().name(),
            Self::Isolated(process) => process.name(),
        }
    }

    /// Asks for the status of the simulation.
    ///
    /// # Errors
    /// What the plugin says, or how its process ended.
    pub fn status(&self) -> Result<SimulationStatus, PluginError> {
        match self {
            Self::InProcess(simulator) => simulator.status(),
            Self::Isolated(process) => process.simulation_status(),
        }
    }
}

impl PluginProcess {
    fn simulate(&self, simulated: SimulationSetup) -> Result<(), PluginError> {
        let request = simulated.clone().into_request();
        // First: one that dies is started again as that device.
        *self.shared.simulation() = Some(simulated);
        self.done(request, &[]).inspect_err(|_| *self.shared.simulation() = None)
    }

    fn simulation_status(&self) -> Result<SimulationStatus, PluginError> {
        match self.shared.call(Request::SimulationStatus, &[])? {
            Answer::Simulating(status) => Ok(SimulationStatus {
                endpoint: shown(&status.endpoint, abi::BUSBAR_SIMULATOR_MESSAGE_CAPACITY),
                ..status
            }),
            _ => Err(self.shared.unexpected_answer()),
        }
    }
}
