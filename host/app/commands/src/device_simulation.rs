//! A configuration without its devices: plugins that can be them are.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::time::{Duration, SystemTime};

use busbar_config::{Config, ScenarioConfig, TagConfig};
use busbar_plugin_host::{
    DeviceScenario, PluginError, SimulatedBehavior, SimulatedEvent, SimulatedLinkFault,
    SimulatedTag, Simulation, SimulationStatus,
};
use busbar_plugin_process::{Plugin, RunningSimulator, SimulatorRegistration};
use busbar_scene_loader::{
    DiagnosticsCollector, LoadError, config_folder, create_instances, read_config,
    read_config_text, report_plugin_error, tag_specs, telemetry_tags,
};

/// The devices of a configuration, for as long as this lives.
pub struct SimulatedDevices {
    devices: Vec<SimulatedDevice>,
    instances: BTreeMap<String, Plugin>,
    remarks: Vec<String>,
    /// Registration by which views on this machine mark these values as simulated. It is dropped
    /// last.
    registration: Option<SimulatorRegistration>,
}

/// Plugin instance that simulates its device.
pub struct SimulatedDevice {
    simulator: RunningSimulator,
    /// Number of simulated tags.
    pub tag_count: usize,
}

impl SimulatedDevice {
    /// The configuration's name of the plugin instance.
    pub fn name(&self) -> &str {
        self.simulator.name()
    }

    /// Returns the status of the simulation.
    ///
    /// # Errors
    /// The plugin's error, or the end of its process, which is restarted then.
    pub fn status(&self) -> Result<SimulationStatus, PluginError> {
        self.simulator.status()
    }
}

impl SimulatedDevices {
    /// Starts the device of every plugin instance that is the source of a tag and can be
    /// one, or of the one named alone. They do what the scenario in a file says from now on.
    ///
    /// # Errors
    /// Every fault of the files and of what they ask of plugins; also when there is no
    /// device to start.
    pub fn start(
        path: &Path,
        only: Option<&str>,
        simulation: &Simulation,
        scenario: Option<&Path>,
    ) -> Result<Self, LoadError> {
        let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
        let config = read_config(path)?;
        let scenario = match scenario {
            Some(path) => read_scenario(path, &config)?,
            None => ScenarioConfig::default(),
        };
        let mut faults = DiagnosticsCollector::new(&config);
        let is_wanted = |name: &str| {
            let mut sources = config.tags.values().filter_map(TagConfig::source);
            only.is_none_or(|only| only == name) && sources.any(|source| source.plugin == name)
        };
        let instances = create_instances(&config, &config_folder(path), &mut faults, &is_wanted);
        let (devices, remarks) = (Vec::new(), Vec::new());
        let mut started = Self { devices, instances, remarks, registration: None };
        // Before they listen: no value of theirs is shown unmarked.
        started.register();
        if !faults.has_errors() {
            started.start_all(&config, simulation, &scenario, &mut faults);
        }
        if !faults.has_errors() && started.devices.is_empty() {
            faults.add("/plugins", started.nothing(only), NOTHING_REMEDY);
        }
        if faults.has_errors() {
            return Err(faulty(faults.found));
        }
        let file = path.display().to_string();
        started.remarks.extend(faults.found.iter().map(|warning| warning.render(&file)));
        Ok(started)
    }

    fn register(&mut self) {
        match SimulatorRegistration::new() {
            Ok(registration) => self.registration = Some(registration),
            Err(error) => self.remarks.push(format!(
                "views cannot tell that these devices are simulated: {error}; set \"simulated\": \
                 true in their configurations"
            )),
        }
    }

    fn start_all(
        &mut self,
        config: &Config,
        simulation: &Simulation,
        scenario: &ScenarioConfig,
        faults: &mut DiagnosticsCollector<'_>,
    ) {
        let specs = tag_specs(config);
        let begun = SystemTime::now();
        for (name, plugin) in &self.instances {
            let tags = telemetry_tags(config, &specs, name);
            if !RunningSimulator::is_offered_by(plugin) {
                self.remarks.push(format!(
                    "'{name}' cannot be simulated, and its {} tags have no device here: plugin \
                     '{}' offers no simulator",
                    tags.len(),
                    plugin.info().id
                ));
                continue;
            }
            let simulated: Vec<_> = tags
                .into_iter()
                .filter_map(|tag| {
                    let behavior = behavior(config.tags.get(&tag.id)?);
                    Some(SimulatedTag { tag, behavior })
                })
                .collect();
            let tag_count = simulated.len();
            let scenario = device_scenario(scenario, begun, name, &simulated, config);
            match RunningSimulator::start(plugin, simulated, simulation, scenario) {
                Ok(simulator) => self.devices.push(SimulatedDevice { simulator, tag_count }),
                Err(error) => {
                    let pointer = config.plugins.get(name).map_or("", |plugin| &plugin.pointer);
                    report_plugin_error(pointer, &error, faults);
                }
            }
        }
    }

    fn nothing(&self, only: Option<&str>) -> String {
        match only {
            Some(only) if self.instances.is_empty() => {
                format!("no tag has a source '{only}': there is nothing to simulate")
            }
            _ => "no source of a tag can be simulated".into(),
        }
    }

    /// The devices, in order of name.
    pub fn devices(&self) -> &[SimulatedDevice] {
        &self.devices
    }

    /// Returns the sources that are not simulated, with reasons.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

const NOTHING_REMEDY: &str = "name the source of a tag whose plugin offers a simulator; `busbar \
                              plugin list` shows what plugins offer";

impl Drop for SimulatedDevices {
    fn drop(&mut self) {
        // They end beside each other, not one after another.
        self.instances.values().for_each(Plugin::quit);
    }
}

fn read_scenario(path: &Path, config: &Config) -> Result<ScenarioConfig, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let text = read_config_text(path).map_err(|fault| faulty(vec![fault]))?;
    busbar_config::parse_scenario(&text, config).map_err(faulty)
}

/// Returns the part of a scenario that concerns one device.
fn device_scenario(
    scenario: &ScenarioConfig,
    begun: SystemTime,
    name: &str,
    tags: &[SimulatedTag],
    config: &Config,
) -> DeviceScenario {
    let handles: HashMap<&str, _> =
        tags.iter().map(|simulated| (simulated.tag.id.as_str(), simulated.tag.tag)).collect();
    let events = scenario.events.iter().filter_map(|event| {
        let [factor, offset] = scale(config.tags.get(&event.tag)?);
        Some(SimulatedEvent {
            tag: *handles.get(event.tag.as_str())?,
            at_seconds: event.at_seconds,
            value: event.value.map(|(value, over)| ((value - offset) / factor, over)),
        })
    });
    let own = scenario.link_faults.iter().filter(|fault| fault.plugin == name);
    let link_faults = own.map(|fault| SimulatedLinkFault {
        kind: fault.kind,
        at_seconds: fault.at_seconds,
        for_seconds: fault.for_seconds,
    });
    DeviceScenario { begun, events: events.collect(), link_faults: link_faults.collect() }
}

/// Returns factor and offset from device units to the host's.
fn scale(tag: &TagConfig) -> [f64; 2] {
    tag.scale.filter(|[factor, _]| *factor != 0.0).unwrap_or([1.0, 0.0])
}

/// Returns the value generator of a tag in device units: the host's scale is inverted.
fn behavior(tag: &TagConfig) -> SimulatedBehavior {
    let simulate = &tag.simulate;
    let [factor, offset] = scale(tag);
    SimulatedBehavior {
        shape: simulate.shape,
        base: (simulate.base - offset) / factor,
        amplitude: (simulate.amplitude / factor).abs(),
        period: Duration::from_secs_f64(simulate.period_seconds),
    }
}
