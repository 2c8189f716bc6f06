//! Status of a plugin's process, with counters.

use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::time::Duration;

/// Status of a plugin's process.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PluginStatus {
    /// Phase of the process.
    pub state: PluginState,
    /// Times that its process ended or was killed.
    pub deaths: u64,
    /// Reason of the last exit.
    pub last_death: Option<String>,
    /// Id of its process.
    pub pid: Option<u32>,
    /// Memory that its process has in RAM, bytes.
    pub memory_bytes: Option<u64>,
}

/// Phases of a plugin's process.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PluginState {
    /// Plugin runs in the viewer's own process.
    #[default]
    InProcess,
    /// The process is running.
    Running,
    /// Process is being started.
    Starting,
    /// Process crashed and is restarted after a delay.
    Restarting {
        /// Time until the restart.
        after: Duration,
    },
    /// Process crashed too often and stays ended until somebody restarts it.
    Quarantined,
    /// Process has ended for good.
    Ended,
}

impl PluginState {
    /// One word for it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::InProcess => "in process",
            Self::Running => "running",
            Self::Starting => "starting",
            Self::Restarting { .. } => "restarting",
            Self::Quarantined => "quarantined",
            Self::Ended => "ended",
        }
    }
}

/// Describes the exit of a process: `killed by SIGSEGV`, `exited with code 3`.
pub(crate) fn ending(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("killed by {}", signal_name(signal)),
        (None, Some(code)) => format!("exited with code {code}"),
        (None, None) => "ended".into(),
    }
}

fn signal_name(signal: i32) -> String {
    let name = match signal {
        libc::SIGABRT => "SIGABRT",
        libc::SIGALRM => "SIGALRM",
        libc::SIGBUS => "SIGBUS",
        libc::SIGFPE => "SIGFPE",
        libc::SIGHUP => "SIGHUP",
        libc::SIGILL => "SIGILL",
        libc::SIGINT => "SIGINT",
        libc::SIGKILL => "SIGKILL",
        libc::SIGPIPE => "SIGPIPE",
        libc::SIGQUIT => "SIGQUIT",
        libc::SIGSEGV => "SIGSEGV",
        libc::SIGSYS => "SIGSYS",
        libc::SIGTERM => "SIGTERM",
        libc::SIGTRAP => "SIGTRAP",
        libc::SIGXCPU => "SIGXCPU",
        libc::SIGXFSZ => "SIGXFSZ",
        other => return format!("signal {other}"),
    };
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_are_named() {
        assert_eq!(ending(ExitStatus::from_raw(11)), "killed by SIGSEGV");
        assert_eq!(ending(ExitStatus::from_raw(128 + 6)), "killed by SIGABRT", "with a core file");
        assert_eq!(ending(ExitStatus::from_raw(34)), "killed by signal 34");
        assert_eq!(ending(ExitStatus::from_raw(3 << 8)), "exited with code 3");
    }
}
