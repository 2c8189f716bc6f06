//! Simulated devices of a scene, served by `busbar simulate`.

use std::io::ErrorKind;
use std::net::TcpListener;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail};

use crate::process::Process;
use crate::workspace::{Profile, Workspace};

/// TCP ports of the simulated devices: that of `config/demo.json`, and the first gateway of the
/// station.
const DEMO_PORT: u16 = 15_020;
const STATION_PORT: u16 = 15_021;
/// Number of the station's gateways.
const STATION_GATEWAYS: u16 = 5;
/// Longest time from the simulator's start until it listens.
const MAX_START: Duration = Duration::from_secs(20);

/// Starts the device of `config/demo.json`, or of a scene made of it; it listens when this
/// returns, and ends when dropped.
pub(crate) fn start_demo(workspace: &Workspace, profile: Profile, scene: &Path) -> Result<Process> {
    start((workspace, profile), scene, None, DEMO_PORT..DEMO_PORT + 1)
}

/// Starts the gateways of the generated station, with the events of a scenario.
pub(crate) fn start_station(
    workspace: &Workspace,
    profile: Profile,
    scene: &Path,
    scenario: Option<&Path>,
) -> Result<Process> {
    start((workspace, profile), scene, scenario, STATION_PORT..STATION_PORT + STATION_GATEWAYS)
}

fn start(
    (workspace, profile): (&Workspace, Profile),
    scene: &Path,
    scenario: Option<&Path>,
    ports: std::ops::Range<u16>,
) -> Result<Process> {
    for port in ports.clone() {
        ensure_free(&format!("127.0.0.1:{port}"))?;
    }
    let mut command = Command::new(workspace.program(profile, "busbar"));
    command.current_dir(&workspace.root);
    command.arg("simulate").arg(scene);
    if let Some(scenario) = scenario {
        command.arg("--scenario").arg(scenario);
    }
    let mut simulator = Process::start_listening(&mut command)?;
    simulator
        .wait_for_line(MAX_START, |line| line == "ready")
        .context("the simulator did not start; see its messages above")?;
    println!("{} simulated devices from port {} on", ports.len(), ports.start);
    Ok(simulator)
}

fn ensure_free(address: &str) -> Result<()> {
    match TcpListener::bind(address) {
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::AddrInUse => bail!(
            "{address} is taken by another program: end that program \
             (as root, `ss -tlnp` names it), then try again"
        ),
        Err(error) => Err(error).with_context(|| format!("cannot listen on {address}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_taken_port_is_named_with_the_remedy() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let error = ensure_free(&address).unwrap_err().to_string();
        assert!(error.contains(&address) && error.contains("end that program"));
        drop(listener);
        ensure_free(&address).unwrap();
    }
}
