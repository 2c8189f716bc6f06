//! The simulated device that the demo scene reads: `busbar simulate` is it.

use std::io::ErrorKind;
use std::net::TcpListener;
use std::time::Duration;

use anyhow::{Context, Result, bail};

use crate::demo::{SCENE, busbar};
use crate::process::Process;
use crate::workspace::Workspace;

/// Where `config/demo.json` expects the device.
const ADDRESS: &str = "127.0.0.1:15020";
/// From its start until it listens.
const MAX_START: Duration = Duration::from_secs(20);

/// Starts the simulator; it listens when this returns, and ends when dropped.
pub(crate) fn start(workspace: &Workspace) -> Result<Process> {
    ensure_free(ADDRESS)?;
    let mut simulator = Process::start_listening(busbar(workspace).args(["simulate", SCENE]))?;
    simulator
        .wait_for_line(MAX_START, |line| line == "ready")
        .context("the simulator did not start; see its messages above")?;
    println!("a simulated device at {ADDRESS}");
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
