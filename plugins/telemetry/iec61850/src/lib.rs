//! IEC 61850 telemetry over MMS: reads the data of one server, by polling and by reports.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One
//! thread serves the connection. It reads, and writes nothing but the attributes of the
//! report control blocks that the settings name.

mod addressing;
mod block;
mod browse;
mod control;
mod convert;
mod link;
mod locate;
#[cfg(test)]
mod message_matrix;
mod point_states;
mod points;
pub mod probe;
mod report_reader;
mod scl;
mod server;
mod service;
mod session;
mod settings;
#[cfg(test)]
mod tests;
mod units;

use std::sync::Arc;

use busbar_link::{IoLoop, TcpDial, TlsClient};
use busbar_plugin_sdk::{
    Command, CommandExit, CommandInfo, Error, Host, LogLevel, Plugin, SampleSink, Streams, TagSpec,
    Telemetry, Worker, export_plugin,
};

use crate::block::ReportBlock;
use crate::link::Link;
use crate::points::Points;
use crate::server::Server;
use crate::settings::Config;
pub use crate::settings::Settings;

/// Telemetry plugin for IEC 61850 MMS.
pub struct Iec61850 {
    /// Or what is wrong with it, where there is no server and only its command is wanted.
    config: Result<Config, Error>,
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
        let has_server = settings.has_server();
        let config = settings.parse();
        match config {
            Err(fault) if has_server => Err(fault),
            config => Ok(Self { config, host, worker: None }),
        }
    }
}

impl Telemetry for Iec61850 {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        self.config.as_ref().map_err(Clone::clone)?;
        Points::parse(tags).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let config = self.config.clone()?;
        let points = Points::parse(&tags)?;
        let tls = load_tls(&config)?;
        if points.all().is_empty() {
            return Ok(());
        }
        for text in freshness_warnings(&config, &tags) {
            self.host.log(LogLevel::Info, &format!("{}: {text}", config.endpoints[0]));
        }
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

impl Command for Iec61850 {
    const COMMANDS: &'static [CommandInfo] = &[
        CommandInfo {
            name: "scl",
            help: "list what an IED of an SCL file has (IEC 61850-6), as points for `busbar import`",
        },
        CommandInfo {
            name: "points",
            help: "list what the server has, as points for `busbar import`",
        },
    ];

    fn run(
        &self,
        name: &str,
        arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error> {
        match (name, &self.config) {
            ("points", Ok(config)) => browse::run(config, arguments, streams),
            ("points", Err(fault)) => {
                streams.diagnose(LogLevel::Error, None, fault.message());
                Ok(CommandExit::InputAtFault)
            }
            _ => scl::run(arguments, streams),
        }
    }
}

fn load_tls(config: &Config) -> Result<Option<TlsClient>, Error> {
    let load = |files| TlsClient::load(files, &config.endpoints);
    config.tls.as_ref().map(load).transpose().map_err(|fault| Error::settings(fault.to_string()))
}

/// Warns of tags that only change reports serve: they go stale while nothing changes.
fn freshness_warnings(config: &Config, tags: &[TagSpec]) -> Vec<String> {
    let shortest = tags.iter().map(|tag| tag.freshness).min();
    let remedy = "set integrity_seconds below the freshness_seconds of its tags";
    let warning = |block: &ReportBlock| match block.integrity {
        None => Some(format!(
            "{}: without integrity_seconds the block says how often it repeats what did not \
             change; else its tags go stale: {remedy}",
            block.reference()
        )),
        Some(period) => shortest.filter(|shortest| *shortest < period).map(|_| {
            format!(
                "{}: it repeats what did not change every {} ms, which is longer than some tags \
                 stay fresh: {remedy}",
                block.reference(),
                period.as_millis()
            )
        }),
    };
    config.reports.iter().filter_map(warning).collect()
}

export_plugin!(Iec61850: telemetry, command);
