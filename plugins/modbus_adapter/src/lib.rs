//! Modbus TCP telemetry: reads registers and bits of one device or gateway.
//!
//! The JSON of settings and tag addresses is described in the crate's
//! README.md. One thread serves one connection; it only ever reads.

mod address;
mod backoff;
mod connection;
mod decode;
mod plan;
mod session;
mod settings;
mod simulator;
#[cfg(test)]
mod tests;

use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, Simulation, SimulationStatus, Simulator, TagSpec,
    Telemetry, export_plugin,
};
use device_server::DeviceServer;
use tokio::sync::oneshot;

use crate::session::Session;
use crate::settings::Config;
pub use crate::settings::Settings;

/// How long `stop` waits for the thread.
const STOP_LIMIT: Duration = Duration::from_millis(1500);
/// How often `stop` looks whether the thread has ended.
const STOP_CHECK: Duration = Duration::from_millis(2);
/// How long the thread waits for a name lookup that hangs in the system.
const LOOKUP_LIMIT: Duration = Duration::from_millis(500);

/// The plugin.
pub struct ModbusAdapter {
    config: Config,
    host: Host,
    running: Option<Running>,
    device: Option<DeviceServer>,
}

struct Running {
    /// Dropped to end the thread.
    stop: oneshot::Sender<()>,
    thread: JoinHandle<()>,
}

impl Plugin for ModbusAdapter {
    const ID: &'static str = "modbus_adapter";
    const NAME: &'static str = "Modbus TCP";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads registers, coils and inputs over Modbus TCP.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, running: None, device: None })
    }
}

impl Telemetry for ModbusAdapter {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        address::parse(tags, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = address::parse(&tags, &self.config)?;
        if points.is_empty() {
            return Ok(());
        }
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(1)
            .build()
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let session = Session::new(self.config.clone(), points, sink, self.host.clone());
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new()
            .name(format!("modbus:{}", self.config.port))
            .spawn(move || {
                runtime.block_on(async {
                    tokio::select! {
                        biased;
                        _ = stopped => {}
                        () = session.run() => {}
                    }
                });
                runtime.shutdown_timeout(LOOKUP_LIMIT);
            })
            .map_err(|error| Error::failed(format!("cannot start a thread: {error}")))?;
        self.running = Some(Running { stop, thread });
        Ok(())
    }

    fn stop(&mut self) {
        let Some(Running { stop, thread }) = self.running.take() else {
            return;
        };
        drop(stop);
        let deadline = Instant::now() + STOP_LIMIT;
        while !thread.is_finished() && Instant::now() < deadline {
            std::thread::sleep(STOP_CHECK);
        }
        let endpoint = self.config.endpoint();
        if !thread.is_finished() {
            let message = format!("{endpoint}: the thread did not end in time; left behind");
            self.host.log(LogLevel::Error, &message);
        } else if thread.join().is_err() {
            let message = format!("{endpoint}: the thread had panicked; please report this");
            self.host.log(LogLevel::Error, &message);
        }
    }
}

impl Simulator for ModbusAdapter {
    fn start_simulation(&mut self, simulation: Simulation) -> Result<(), Error> {
        self.device = Some(simulator::start(&self.config, simulation, &self.host)?);
        Ok(())
    }

    fn stop_simulation(&mut self) {
        self.device = None;
    }

    fn simulation_status(&self) -> SimulationStatus {
        self.device.as_ref().map(DeviceServer::status).unwrap_or_default()
    }
}

impl Drop for ModbusAdapter {
    fn drop(&mut self) {
        self.stop();
    }
}

export_plugin!(ModbusAdapter: telemetry, simulator);
