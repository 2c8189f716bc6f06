//! Request rates of the adapters beside the peers' own clients, at the same servers.

mod iec104;
mod modbus;
mod peer;
mod wire;

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use busbar_plugin_host::{
    DeviceScenario, SimulatedBehavior, SimulatedTag, Simulation, TelemetryTag,
};
use busbar_plugin_process::{RunningSimulator, RunningTelemetry};
use busbar_tags::Sample;
use busbar_types::SignalShape;
use serde::Serialize;
use serde_json::Value;

use crate::scene::GeneratedScene;

pub(crate) use iec104::{Interrogations, POINTS};
pub(crate) use wire::REGISTERS;

/// Number of alternating rounds of each client.
const ROUNDS: u64 = 5;
/// Longest wait until an adapter has its first values.
const PATIENCE: Duration = Duration::from_secs(60);
/// Update period above that of any measurement, so that values stand still.
const UPDATE: Duration = Duration::from_secs(3600);

/// Python with the peers' packages, and the folder of their scripts.
pub(crate) struct Peers {
    pub(crate) python: PathBuf,
    pub(crate) scripts: PathBuf,
}

/// Rates of a client at a server, by the adapter and by the peer, one for each round.
#[derive(Debug, Serialize)]
pub(crate) struct Rates {
    pub(crate) server: &'static str,
    pub(crate) ours: Vec<f64>,
    pub(crate) peers: Vec<f64>,
}

/// Results of the measurement.
#[derive(Debug, Serialize)]
pub(crate) struct Requests {
    /// Rates of Modbus, requests a second.
    pub(crate) modbus: Vec<Rates>,
    /// Rate of exchanges of as many bytes on a bare connection, a second.
    pub(crate) wire: f64,
    /// Rates of IEC 60870-5-104, points a second.
    pub(crate) iec104: Vec<Rates>,
    pub(crate) interrogations: Vec<Interrogations>,
}

pub(crate) fn measure(site: &GeneratedScene, peers: &Peers) -> Result<Requests> {
    let (iec104, interrogations) = iec104::measure(site, peers).context("IEC 104")?;
    Ok(Requests {
        modbus: modbus::measure(site, peers).context("Modbus")?,
        wire: wire::exchanges_per_second(Duration::from_secs(3) / site.divisor as u32)?,
        iec104,
        interrogations,
    })
}

/// Returns a port that was free a moment ago.
fn free_port() -> Result<u16> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}

/// Starts a simulated device of the plugin's tags, whose values stand still.
fn device(
    site: &GeneratedScene,
    plugin: &str,
    settings: &Value,
    tags: &[TelemetryTag],
) -> Result<RunningSimulator> {
    let simulated = |tag: &TelemetryTag| SimulatedTag {
        tag: tag.clone(),
        behavior: SimulatedBehavior {
            shape: SignalShape::Constant,
            base: f64::from(tag.tag.0 % 100),
            amplitude: 0.0,
            period: UPDATE,
        },
    };
    let simulation = Simulation {
        seed: 1,
        update: UPDATE,
        faults: Vec::new(),
        fault_period: 2 * UPDATE,
        fault_length: UPDATE,
    };
    let plugin = site.plugin(plugin, settings)?;
    let tags = tags.iter().map(simulated).collect();
    Ok(RunningSimulator::start(&plugin, tags, &simulation, DeviceScenario::NONE)?)
}

/// Counts the good values that came since the last call.
fn good(telemetry: &RunningTelemetry) -> u32 {
    let mut count = 0;
    telemetry.drain(&mut |sample: &Sample| count += u32::from(sample.quality.is_good()));
    count
}

fn ensure_none_lost(telemetry: &RunningTelemetry) -> Result<()> {
    let link = telemetry.link();
    ensure!(link.dropped == 0 && link.rejected == 0, "values were lost: {link:?}");
    Ok(())
}

impl Peers {
    fn start(&self, script: &str, arguments: &[String]) -> Result<peer::Peer> {
        peer::Peer::start(&self.python, &Path::join(&self.scripts, script), arguments)
    }
}
