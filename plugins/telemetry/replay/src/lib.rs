//! Recordings played into tags: COMTRADE (IEEE C37.111, IEC 60255-24) and CSV.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One
//! thread reads the recording as it plays it: memory does not depend on its length.

mod address;
#[warn(clippy::indexing_slicing)]
#[cfg_attr(test, allow(clippy::indexing_slicing))]
pub mod comtrade;
mod decimate;
mod instant;
pub use text_table::lines;
mod open_recording;
mod oscillogram;
mod player;
pub mod probe;
mod recording;
mod remarks;
mod session;
mod settings;
mod table;
#[cfg(test)]
mod tests;

use busbar_plugin_sdk::{
    Error, Host, Plugin, SampleFlags, SampleSink, TagSpec, Telemetry, Worker, export_plugin,
};

use crate::address::Points;
use crate::open_recording::open_recording;
use crate::remarks::Remarks;
use crate::session::Session;
pub use crate::settings::Settings;
use crate::settings::{Config, Format};
/// Telemetry plugin that replays recordings.
pub struct Replay {
    config: Config,
    host: Host,
    worker: Option<Worker>,
}

impl Plugin for Replay {
    const ID: &'static str = "replay";
    const NAME: &'static str = "Replay";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Plays COMTRADE and CSV recordings into tags.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, worker: None })
    }
}

impl Telemetry for Replay {
    const ORIGIN: SampleFlags = SampleFlags::RECORDED;

    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        let points = Points::parse(tags, &self.config)?;
        let mut remarks =
            Remarks::new(Host::clone(&self.host), self.config.file.display().to_string());
        let Err(fault) = open_recording(&self.config, &points, &mut remarks) else {
            return Ok(());
        };
        // An oscillogram is written once: a channel that it lacks is a fault of the address.
        if fault.is_of_tags && self.config.format == Format::Comtrade {
            return Err(Error::settings(fault.to_string()));
        }
        // A file, or a column of an export that is written again and again, is like a device that
        // does not answer: its link is down, and the view goes on.
        Err(Error::failed(fault.to_string()))
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = Points::parse(&tags, &self.config)?;
        if points.0.is_empty() {
            return Ok(());
        }
        let session =
            Session { config: self.config.clone(), points, sink, host: self.host.clone() };
        self.worker =
            Some(Worker::start(&self.host, "replay", move |running| session.run(running))?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

export_plugin!(Replay: telemetry);
