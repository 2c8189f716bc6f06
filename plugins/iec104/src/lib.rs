//! IEC 60870-5-104 telemetry: reads the values of one controlled station.
//!
//! The JSON of settings and tag addresses is described in the crate's
//! README.md. One thread serves all connections of a station. It asks for
//! values, and sends nothing else but, where the settings want it, the time.

mod backoff;
#[warn(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::indexing_slicing)]
#[cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::indexing_slicing))]
pub mod codec;
mod convert;
mod hub;
mod link;
mod points;
mod requests;
pub mod session;
mod settings;
mod simulator;
mod station;
#[cfg(test)]
mod tests;
mod tls;

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, Simulation, SimulationStatus, Simulator, TagSpec,
    Telemetry, export_plugin,
};
use device_server::DeviceServer;
use tokio::sync::oneshot;
use tokio::task::{JoinSet, LocalSet};

use crate::hub::Hub;
use crate::link::Link;
use crate::points::Points;
use crate::settings::Config;
pub use crate::settings::Settings;
use crate::station::{Station, freshness_warning};
use crate::tls::Tls;

/// How long `stop` waits for the thread.
const STOP_LIMIT: Duration = Duration::from_millis(1500);
/// How often `stop` looks whether the thread has ended.
const STOP_CHECK: Duration = Duration::from_millis(2);
/// How long the thread waits for a name lookup that hangs in the system.
const LOOKUP_LIMIT: Duration = Duration::from_millis(500);

/// The plugin.
pub struct Iec104 {
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

impl Plugin for Iec104 {
    const ID: &'static str = "iec104";
    const NAME: &'static str = "IEC 60870-5-104";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads a controlled station over IEC 60870-5-104.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, running: None, device: None })
    }
}

impl Telemetry for Iec104 {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        Points::parse(tags, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = Points::parse(&tags, &self.config)?;
        let tls = Tls::load(&self.config)?;
        if points.all().is_empty() {
            return Ok(());
        }
        let endpoint = &self.config.endpoints[0];
        if let Some(text) = freshness_warning(&self.config, &tags) {
            self.host.log(LogLevel::Info, &format!("{endpoint}: {text}"));
        }
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(self.config.endpoints.len())
            .build()
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let (config, host) = (self.config.clone(), self.host.clone());
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new()
            .name(format!("iec104:{}", endpoint.port))
            .spawn(move || {
                runtime.block_on(LocalSet::new().run_until(async {
                    tokio::select! {
                        biased;
                        _ = stopped => {}
                        () = serve(config, points, sink, host, tls) => {}
                    }
                }));
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
        let endpoint = &self.config.endpoints[0];
        if !thread.is_finished() {
            let message = format!("{endpoint}: the thread did not end in time; left behind");
            self.host.log(LogLevel::Error, &message);
        } else if thread.join().is_err() {
            let message = format!("{endpoint}: the thread had panicked; please report this");
            self.host.log(LogLevel::Error, &message);
        }
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

impl Drop for Iec104 {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Serves all connections of a station for ever.
async fn serve(config: Config, points: Points, sink: SampleSink, host: Host, tls: Option<Tls>) {
    let station = Station::new(config.clone(), points, sink.clone(), host.clone());
    let hub = Rc::new(RefCell::new(Hub::new(station, &config.endpoints, sink, host)));
    hub.borrow().open();
    let mut links: JoinSet<Infallible> = JoinSet::new();
    for (index, endpoint) in config.endpoints.iter().cloned().enumerate() {
        let (hub, config, tls) = (Rc::clone(&hub), config.clone(), tls.clone());
        let link = Link { hub, index, endpoint, config, tls };
        links.spawn_local(link.run());
    }
    // None ends but by a panic, which is for `stop` to tell.
    while let Some(Err(error)) = links.join_next().await {
        if let Ok(panic) = error.try_into_panic() {
            std::panic::resume_unwind(panic);
        }
    }
}

export_plugin!(Iec104: telemetry, simulator);
