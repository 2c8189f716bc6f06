//! Independent Modbus server (pymodbus) in a process of its own.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::{Process, available, workspace_path};

/// Modbus TCP server that is killed when dropped.
pub struct Peer {
    /// Process of the server, to stop or kill.
    pub process: Process,
    /// Port that the server listens at.
    pub port: u16,
    answers: usize,
}

impl Peer {
    /// Starts a server with these values, such as `{"holding": {"0": [1, 2]}}`;
    /// none where there is no pymodbus (see [`available`]).
    pub fn start(values: &Value) -> Option<Self> {
        Self::start_with(&[], values)
    }

    /// Starts a server at a serial line.
    pub fn start_serial(device: &Path, values: &Value) -> Option<Self> {
        Self::start_with(&["--serial".as_ref(), device.as_os_str()], values)
    }

    fn start_with(arguments: &[&OsStr], values: &Value) -> Option<Self> {
        let python = python("pymodbus")?;
        let script = workspace_path("tests/end_to_end/peers/pymodbus_server.py");
        let mut command = Command::new(python);
        command.arg(script).args(arguments).arg(values.to_string());
        let process = Process::start(&mut command);
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port, answers: 0 })
    }

    /// Sets registers or bits from an address on.
    ///
    /// # Panics
    /// When the server refuses.
    pub fn set(&mut self, table: &str, address: u16, values: &[u16]) {
        let values: Vec<_> = values.iter().map(ToString::to_string).collect();
        self.process.write_line(&format!("set {table} {address} {}", values.join(" ")));
        self.answers += 1;
        let mut left = self.answers;
        let answer = self.process.wait_for_line(|line| {
            let is_answer = line == "OK" || line.starts_with("ERROR");
            left -= usize::from(is_answer && left > 0);
            (is_answer && left == 0).then(|| line.to_owned())
        });
        assert_eq!(answer, "OK");
    }
}

/// Returns the two registers of a 32-bit float, high word first.
pub fn f32_registers(value: f32) -> [u16; 2] {
    let bits = value.to_bits();
    [(bits >> 16) as u16, bits as u16]
}

/// Returns the interpreter that has the peers' packages, if `import NAME` works there.
pub fn python(import: &str) -> Option<PathBuf> {
    let path = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| workspace_path("target/venv/bin/python"), PathBuf::from);
    let mut command = Command::new(&path);
    command.args(["-c", &format!("import {import}")]).stderr(Stdio::null());
    let has_it = command.status().is_ok_and(|status| status.success());
    let remedy = format!(
        "no {import}: run `cargo xtask test`, or set BUSBAR_PYTHON to an interpreter with \
         tests/end_to_end/peers/requirements.txt installed"
    );
    available(has_it, &remedy).then_some(path)
}

/// Returns registers and inputs of the demo's bay in normal operation.
pub fn normal_values() -> Value {
    let mut holding = vec![0; 100];
    // Top oil, hot-spot, one other, oil level, tap, fans, SF6.
    holding.extend([559, 600, 0, 583, 9, 2, 644]);
    json!({ "holding": { "0": holding }, "discrete": {"0": [0, 1, 0, 1, 0, 0, 0, 0]} })
}
