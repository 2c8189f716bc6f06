//! X server with a display in memory (Xvfb).

use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result};

use crate::process::Process;

/// Longest time from the server's start until it takes clients.
const MAX_START: Duration = Duration::from_secs(20);

/// Running Xvfb that is ended when dropped.
pub(crate) struct XServer {
    _process: Process,
    /// Value of the `DISPLAY` variable.
    pub(crate) display: String,
}

impl XServer {
    /// Starts a server with one screen of `size`, as in `1280x720`, on a free
    /// display.
    pub(crate) fn start(size: &str) -> Result<Self> {
        let mut command = Command::new("Xvfb");
        // It writes the display's number to standard output when it is ready.
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"]);
        command.args(["-screen", "0", &format!("{size}x24")]);
        let mut process = Process::start_listening(&mut command)?;
        let number = process
            .wait_for_line(MAX_START, |line| line.parse::<u32>().is_ok())
            .context("no X display in memory; see the messages of Xvfb above")?;
        Ok(Self { _process: process, display: format!(":{number}") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs where Xvfb is installed, which `cargo xtask test` sees to.
    #[test]
    fn servers_get_displays_of_their_own() {
        if std::env::var_os("BUSBAR_REQUIRE_PEERS").is_none() {
            return;
        }
        let [first, second] = [(); 2].map(|()| XServer::start("64x64").unwrap());
        assert_ne!(first.display, second.display);
    }
}
