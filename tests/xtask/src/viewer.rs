//! Viewer that is measured, on a display in memory.

use std::ffi::OsStr;
use std::process::Command;
use std::time::Duration;

use anyhow::Result;

use crate::process::Process;
use crate::workspace::{Profile, Workspace};

/// Longest time from the start of a viewer to its first picture.
const MAX_START: Duration = Duration::from_secs(120);

/// Starts `busbar` with arguments on a display, and waits for a line of its output that `is_ready`
/// accepts.
pub(crate) fn start(
    workspace: &Workspace,
    profile: Profile,
    display: &str,
    arguments: &[&OsStr],
    is_ready: impl Fn(&str) -> bool,
) -> Result<Process> {
    let mut command = Command::new(workspace.program(profile, "busbar"));
    command.current_dir(&workspace.root).env("DISPLAY", display).args(arguments);
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let mut viewer = Process::start_listening(&mut command)?;
    viewer.wait_for_line(MAX_START, is_ready)?;
    Ok(viewer)
}
