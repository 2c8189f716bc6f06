//! Modbus telemetry: reads registers and bits of one device or gateway over TCP or
//! TLS, or of the devices of a serial line over RTU.
//!
//! The JSON of settings and tag addresses is described in the crate's
//! README.md. One thread serves one connection; it only ever reads.

mod address;
mod bus;
mod connection;
mod decode;
mod exceptions;
mod late;
mod marked;
mod plan;
mod poll_group;
mod port;
pub mod probe;
mod session;
mod settings;
mod simulator;
#[cfg(test)]
mod tests;
mod transport;
mod units;

use std::sync::Arc;

use busbar_link::{IoLoop, TcpDial, TlsClient};
use busbar_plugin_sdk::{
    Error, Host, Plugin, SampleSink, Simulation, SimulationStatus, Simulator, TagSpec, Telemetry,
    Worker, export_plugin,
};
use device_server::DeviceServer;

use crate::session::Session;
use crate::settings::Config;
pub use crate::settings::Settings;
use crate::transport::Transport;

/// Telemetry plugin of Modbus devices.
pub struct ModbusAdapter {
    config: Config,
    host: Host,
    /// Serves the tags; dropped to end that.
    worker: Option<Worker>,
    device: Option<DeviceServer>,
}

impl Plugin for ModbusAdapter {
    const ID: &'static str = "modbus_adapter";
    const NAME: &'static str = "Modbus";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Reads registers, coils and inputs over Modbus TCP, TLS and RTU.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, worker: None, device: None })
    }
}

impl Telemetry for ModbusAdapter {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        address::parse(tags, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = address::parse(&tags, &self.config)?;
        let tls = self.load_tls()?;
        if points.is_empty() {
            return Ok(());
        }
        let io_loop = IoLoop::new(1)
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let dial = Arc::new(TcpDial { tls });
        let session = Session::new(self.config.clone(), dial, points, sink, self.host.clone());
        let name = format!("modbus:{}", self.config.transport.short_name());
        self.worker = Some(Worker::start(&self.host, &name, move |running| {
            io_loop.run_until(running.stopped(), session.run());
        })?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
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

impl ModbusAdapter {
    fn load_tls(&self) -> Result<Option<TlsClient>, Error> {
        let Transport::Tcp { endpoint, tls: Some(files) } = &self.config.transport else {
            return Ok(None);
        };
        let tls = TlsClient::load(files, [endpoint]);
        tls.map(Some).map_err(|fault| Error::settings(fault.to_string()))
    }
}

export_plugin!(ModbusAdapter: telemetry, simulator);
