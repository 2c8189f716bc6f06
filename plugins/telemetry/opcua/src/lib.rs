//! OPC UA telemetry: reads the values and alarm conditions of one server.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One
//! thread serves a server. It writes no value, and calls no method but the one that has a
//! server tell its alarm conditions anew.

mod client;
mod condition_values;
mod conditions;
mod convert;
mod engineering_units;
mod fault;
mod guard;
mod identity;
mod import;
mod link;
mod mirror;
mod namespaces;
mod node;
mod point_states;
mod points;
pub mod probe;
mod security;
mod sequence;
mod session;
mod settings;
mod subscription;
mod subscriptions;
#[cfg(test)]
mod tests;
mod url;
mod watch;
mod world;

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::SystemTime;

use busbar_link::{IoLoop, TcpDial};
use busbar_plugin_sdk::{
    AlarmReport, Alarms, Command, CommandExit, CommandInfo, Error, Host, Plugin, SampleSink,
    Streams, TagSpec, Telemetry, Worker, export_plugin,
};
use tokio::time::sleep;

use crate::link::{CLOSE_LIMIT, Link};
use crate::mirror::Mirror;
use crate::point_states::PointStates;
use crate::points::Points;
use crate::settings::Config;
pub use crate::settings::Settings;
use crate::world::World;

/// OPC UA plugin, a client of one server or of a redundant set.
pub struct OpcUa {
    config: Config,
    host: Host,
    /// The server's alarms, where the settings ask for them.
    mirror: Option<Mirror>,
    /// Thread that serves the server; dropped to end the connection.
    worker: Option<Worker>,
}

impl Plugin for OpcUa {
    const ID: &'static str = "opcua";
    const NAME: &'static str = "OPC UA";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads an OPC UA server by subscriptions.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        let config = settings.parse()?;
        let mirror = config.alarms.then(Mirror::default);
        Ok(Self { config, host, mirror, worker: None })
    }
}

impl Telemetry for OpcUa {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        Points::parse(tags, &self.config).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = Points::parse(&tags, &self.config)?;
        if points.all.is_empty() && self.mirror.is_none() {
            return Ok(());
        }
        let io_loop = IoLoop::new(self.config.servers.len())
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let name = format!("opcua:{}", self.config.servers[0].endpoint.port);
        let (config, host) = (self.config.clone(), self.host.clone());
        let mirror = self.mirror.clone();
        let world = World { dial: Arc::new(TcpDial { tls: None }), wall_clock: SystemTime::now };
        self.worker = Some(Worker::start(&self.host, &name, move |running| {
            let (stop, stopped) = tokio::sync::watch::channel(false);
            let point_states = PointStates::new(points, &config, sink.clone(), host.clone());
            let point_states = Rc::new(RefCell::new(point_states.with_mirror(mirror.clone())));
            let link = Link {
                config,
                point_states,
                sink,
                host,
                world,
                stop: stopped,
                namespaces: RefCell::default(),
            };
            let ended = async {
                running.stopped().await;
                // The link says goodbye, which ends its work first.
                stop.send_replace(true);
                sleep(CLOSE_LIMIT).await;
            };
            io_loop.run_until(ended, link.run());
        })?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
        if let Some(mirror) = &self.mirror {
            mirror.lose("the plugin does not serve");
        }
    }
}

impl Alarms for OpcUa {
    fn alarms(&mut self, known_revision: u64) -> Result<AlarmReport, Error> {
        let none = || Error::failed("it mirrors no alarms: add \"alarms\": true to its settings");
        Ok(self.mirror.as_ref().ok_or_else(none)?.report(known_revision))
    }
}

impl Command for OpcUa {
    const COMMANDS: &'static [CommandInfo] = &[CommandInfo {
        name: "points",
        help: "list the variables of the server as points for `busbar import`",
    }];

    fn run(
        &self,
        _name: &str,
        arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error> {
        import::run(&self.config, arguments, streams)
    }
}

export_plugin!(OpcUa: telemetry, alarms, command);
