//! IEC 61850 telemetry over MMS: reads the data of one server, by polling and by reports.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One
//! thread serves the connection. It reads, and writes nothing but the attributes of the
//! report control blocks that the settings name.

mod addressing;
mod block;
mod board;
mod control;
mod convert;
mod link;
mod locate;
mod points;
pub mod probe;
mod server;
mod service;
mod session;
mod settings;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use busbar_link::{IoLoop, TcpDial, TlsClient};
use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, TagSpec, Telemetry, Worker, export_plugin,
};

use crate::link::Link;
use crate::points::Points;
use crate::server::Server;
use crate::settings::Config;
pub use crate::settings::Settings;

/// The plugin.
pub struct Iec61850 {
    config: Config,
    host: Host,
    /// Serves the connection; dropped to end that.
    worker: Option<Worker>,
}

impl Plugin for Iec61850 {
    const ID: &'static str = "iec61850";
    const NAME: &'static str = "IEC 61850 MMS";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads an IED over IEC 61850 MMS, by polling and reports.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, worker: None })
    }
}

impl Telemetry for Iec61850 {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        Points::parse(tags).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = Points::parse(&tags)?;
        let tls = self.load_tls()?;
        if points.all().is_empty() {
            return Ok(());
        }
        self.warn_of_freshness(&tags);
        let config = self.config.clone();
        let io_loop = IoLoop::new(1)
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let name = format!("iec61850:{}", config.endpoints[0].port);
        let server = Server::new(&config, points, sink.clone(), self.host.clone());
        let link = Link { server, config, sink, dial: Arc::new(TcpDial { tls }) };
        self.worker = Some(Worker::start(&self.host, &name, move |running| {
            io_loop.run_until(running.stopped(), async {
                link.run().await;
            });
        })?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

impl Iec61850 {
    fn load_tls(&self) -> Result<Option<TlsClient>, Error> {
        let Config { tls, endpoints, .. } = &self.config;
        let load = |files| TlsClient::load(files, endpoints);
        tls.as_ref().map(load).transpose().map_err(|fault| Error::settings(fault.to_string()))
    }

    /// What a block reports on change alone goes stale while nothing changes.
    fn warn_of_freshness(&self, tags: &[TagSpec]) {
        let shortest = tags.iter().map(|tag| tag.freshness).min();
        for block in &self.config.reports {
            let is_late = |period| shortest.is_some_and(|shortest| shortest < period);
            let remedy = "set integrity_millis below the freshness_millis of its tags";
            let text = match block.integrity {
                None => format!(
                    "{}: without integrity_millis the block says how often it repeats what did \
                     not change; else its tags go stale: {remedy}",
                    block.reference()
                ),
                Some(period) if is_late(period) => format!(
                    "{}: it repeats what did not change every {} ms, which is longer than some \
                     tags stay fresh: {remedy}",
                    block.reference(),
                    period.as_millis()
                ),
                Some(_) => continue,
            };
            self.host.log(LogLevel::Info, &format!("{}: {text}", self.config.endpoints[0]));
        }
    }
}

export_plugin!(Iec61850: telemetry);
