//! IEC 60870-5-104 telemetry: reads the values of one controlled station.
//!
//! The JSON of settings and tag addresses is described in the crate's
//! README.md. One thread serves all connections of a station. It asks for
//! values, and sends nothing else but, where the settings want it, the time.

pub mod apci_session;
#[warn(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::indexing_slicing)]
#[cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::indexing_slicing))]
pub mod codec;
mod convert;
mod hub;
mod link;
#[cfg(test)]
mod message_matrix;
mod points;
pub mod probe;
mod request_schedule;
mod settings;
mod simulator;
mod station;
#[cfg(test)]
mod tests;
mod validity;

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;
use std::sync::Arc;
use std::time::SystemTime;

use busbar_link::{IoLoop, TcpDial, TlsClient};
use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, Simulation, SimulationStatus, Simulator, TagSpec,
    Telemetry, Worker, export_plugin,
};
use device_server::DeviceServer;
use tokio::task::JoinSet;

use crate::hub::Hub;
use crate::link::{Link, World};
use crate::points::Points;
use crate::settings::Config;
pub use crate::settings::Settings;
use crate::station::{Station, freshness_warning};

/// Telemetry plugin for IEC 60870-5-104.
pub struct Iec104 {
    config: Config,
    host: Host,
    /// Serves the station; dropped to end that.
    worker: Option<Worker>,
    device: Option<DeviceServer>,
}

impl Plugin for Iec104 {
    const ID: &'static str = "iec104";
    const NAME: &'static str = "IEC 60870-5-104";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads a controlled station over IEC 60870-5-104.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, worker: None, device: None })
    }
}

impl Telemetry for Iec104 {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        Points::parse(tags, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = Points::parse(&tags, &self.config)?;
        let tls = self.load_tls()?;
        if points.all().is_empty() {
            return Ok(());
        }
        let endpoint = &self.config.endpoints[0];
        if let Some(text) = freshness_warning(&self.config, &tags) {
            self.host.log(LogLevel::Info, &format!("{endpoint}: {text}"));
        }
        let io_loop = IoLoop::new(self.config.endpoints.len())
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let name = format!("iec104:{}", endpoint.port);
        let (config, host) = (self.config.clone(), self.host.clone());
        let world = World { dial: Arc::new(TcpDial { tls }), wall_clock: SystemTime::now };
        self.worker = Some(Worker::start(&self.host, &name, move |running| {
            io_loop.run_until(running.stopped(), serve(config, points, sink, host, world));
        })?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

impl Simulator for Iec104 {
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

impl Iec104 {
    fn load_tls(&self) -> Result<Option<TlsClient>, Error> {
        let Config { tls, endpoints, .. } = &self.config;
        let load = |files| TlsClient::load(files, endpoints);
        tls.as_ref().map(load).transpose().map_err(|fault| Error::settings(fault.to_string()))
    }
}

/// Serves all connections of a station for ever.
async fn serve(config: Config, points: Points, sink: SampleSink, host: Host, world: World) {
    let station = Station::new(config.clone(), points, sink.clone(), host.clone());
    let hub = Rc::new(RefCell::new(Hub::new(station, &config.endpoints, sink, host)));
    hub.borrow().open();
    let mut links: JoinSet<Infallible> = JoinSet::new();
    for (index, endpoint) in config.endpoints.iter().cloned().enumerate() {
        let (hub, config, world) = (Rc::clone(&hub), config.clone(), world.clone());
        let link = Link { hub, index, endpoint, config, world };
        links.spawn_local(link.run());
    }
    // None ends but by a panic, which is for the worker to tell.
    while let Some(Err(error)) = links.join_next().await {
        if let Ok(panic) = error.try_into_panic() {
            std::panic::resume_unwind(panic);
        }
    }
}

export_plugin!(Iec104: telemetry, simulator);
