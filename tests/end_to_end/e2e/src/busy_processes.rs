//! Busy processes beside the program.

use std::process::{Child, Command, Stdio};

/// Processes that do nothing but use CPUs, until this is dropped.
pub struct BusyProcesses(Vec<Child>);

impl BusyProcesses {
    /// Starts so many processes.
    ///
    /// # Panics
    /// When there is no shell.
    pub fn start(count: usize) -> Self {
        let busy = |_| {
            let mut command = Command::new("sh");
            command.args(["-c", "while :; do :; done"]).stdin(Stdio::null());
            command.spawn().expect("a shell runs")
        };
        Self((0..count).map(busy).collect())
    }
}

impl Drop for BusyProcesses {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
