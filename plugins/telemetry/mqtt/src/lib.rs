//! MQTT telemetry, 3.1.1 and 5: plain topics, and Sparkplug B.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One thread
//! serves one broker of a cluster at a time. It subscribes, and sends nothing else but,
//! where the settings want it, requests for births and the state of a primary host.

mod availability;
mod availability_settings;
mod convert;
mod document;
mod line_budget;
mod link;
#[cfg(test)]
mod message_matrix;
mod names;
mod payload_format;
mod point_states;
mod points;
pub mod probe;
mod session;
mod settings;
mod source_time;
mod sparkplug;
mod subscriber;
#[cfg(test)]
mod tests;
mod topics;
#[cfg(test)]
mod unit_tests;

use std::sync::Arc;
use std::time::SystemTime;

use busbar_link::{IoLoop, TcpDial, TlsClient};
use busbar_plugin_sdk::{
    Error, Host, LinkState, LogLevel, Plugin, Reason, SampleSink, TagSpec, Telemetry, Worker,
    export_plugin,
};

use crate::link::{Link, World};
use crate::settings::Config;
pub use crate::settings::Settings;
use crate::subscriber::{Plan, Subscriber};

/// MQTT and Sparkplug B plugin, a client of one cluster of brokers.
pub struct Mqtt {
    config: Config,
    host: Host,
    /// Thread that serves the cluster; dropped to end the connection.
    worker: Option<Worker>,
}

impl Plugin for Mqtt {
    const ID: &'static str = "mqtt";
    const NAME: &'static str = "MQTT and Sparkplug B";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads topics and Sparkplug B metrics of an MQTT broker.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, worker: None })
    }
}

impl Telemetry for Mqtt {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        Plan::new(points::parse(tags.iter())?, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        if tags.is_empty() {
            return Ok(());
        }
        let tls = self.load_tls()?;
        let handles: Vec<u32> = tags.iter().map(|tag| tag.tag).collect();
        let plan = Plan::new(points::parse(tags.into_iter())?, &self.config)?;
        if tls.is_none() && self.config.login.is_some() {
            let text = "name and password are sent unencrypted: set tls";
            self.host.log(LogLevel::Warning, text);
        }
        let subscriber = Subscriber::new(plan, &self.config, sink.clone(), self.host.clone());
        let io_loop = IoLoop::new(1)
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let link = Link {
            subscriber,
            config: self.config.clone(),
            client_id: self.config.client_id.clone().unwrap_or_else(random_id),
            world: World { dial: Arc::new(TcpDial { tls }), wall_clock: SystemTime::now },
        };
        let name = format!("mqtt:{}", self.config.brokers[0].port);
        self.worker = Some(Worker::start(&self.host, &name, move |running| {
            // Tags must not stay good when a fault of ours ends the thread.
            let _ended = MarkAtPanic { handles, sink };
            io_loop.run_until(running.stopped(), async { match link.run().await {} });
        })?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

impl Mqtt {
    fn load_tls(&self) -> Result<Option<TlsClient>, Error> {
        let Config { tls, brokers, .. } = &self.config;
        let load = |files| TlsClient::load(files, brokers);
        tls.as_ref().map(load).transpose().map_err(|fault| Error::settings(fault.to_string()))
    }
}

/// Creates a random client id, unique among the clients of a broker.
fn random_id() -> String {
    format!("busbar{:016x}", fastrand::u64(..))
}

/// Makes all tags bad where the thread panics.
struct MarkAtPanic {
    handles: Vec<u32>,
    sink: SampleSink,
}

impl Drop for MarkAtPanic {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.sink.publish_bad(self.handles.iter().copied(), Reason::Communication);
            self.sink.report_link(LinkState::Down, "a fault of the plugin ended it");
        }
    }
}

export_plugin!(Mqtt: telemetry);
