//! Telemetry from databases: polls PostgreSQL and SQLite, and listens to PostgreSQL.
//!
//! The JSON of settings and tag addresses is described in the crate's README.md. One
//! thread and one connection serve an instance. It only reads.

mod answer;
mod cell;
mod convert;
mod payload;
mod point_states;
mod points;
mod postgres;
pub mod probe;
mod schedule;
mod settings;
mod sqlite;
#[cfg(test)]
mod tests;

use std::time::Duration;

use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, TagSpec, Telemetry, Worker, export_plugin,
};
use tokio::sync::oneshot;

use crate::point_states::{PointStates, list};
pub use crate::settings::Settings;
use crate::settings::{Config, Database};

/// Longest wait for a name lookup that hangs in the system.
const LOOKUP_LIMIT: Duration = Duration::from_millis(500);

/// Telemetry plugin for SQL databases.
pub struct SqlAdapter {
    config: Config,
    host: Host,
    running: Option<RunningWorker>,
}

/// Dropped in this order: told to end, then waited for.
struct RunningWorker {
    _stop: oneshot::Sender<()>,
    _worker: Worker,
}

impl Plugin for SqlAdapter {
    const ID: &'static str = "sql_adapter";
    const NAME: &'static str = "SQL";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads values from PostgreSQL and SQLite databases.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, running: None })
    }
}

impl Telemetry for SqlAdapter {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        self.parse(tags).map(|_| ())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = self.parse(&tags)?;
        if tags.is_empty() {
            return Ok(());
        }
        if let Some(text) = self.freshness_warning(&points, &tags) {
            self.host.log(LogLevel::Info, &format!("{}: {text}", self.config.label()));
        }
        let config = self.config.clone();
        let rules = config.times.clone();
        let names = config.queries.iter().map(|query| query.name.clone());
        let named = names.zip(points);
        let point_states = PointStates::new(config.label(), named, rules, sink, self.host.clone());
        let (stop, stopped) = oneshot::channel();
        let worker = match config.database.clone() {
            Database::Sqlite(path) => Worker::start(&self.host, "sqlite", move |running| {
                sqlite::serve(&path, &config, point_states, running);
            }),
            Database::Postgres(server) => {
                let access = postgres::Access::load(*server)?;
                let runtime = tokio::runtime::Builder::new_current_thread()
                    .enable_all()
                    .max_blocking_threads(1)
                    .build()
                    .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
                Worker::start(&self.host, "postgres", move |_| {
                    runtime.block_on(async {
                        tokio::select! {
                            biased;
                            _ = stopped => {}
                            _ = postgres::serve(&access, &config, point_states) => {}
                        }
                    });
                    runtime.shutdown_timeout(LOOKUP_LIMIT);
                })
            }
        }?;
        self.running = Some(RunningWorker { _stop: stop, _worker: worker });
        Ok(())
    }

    fn stop(&mut self) {
        self.running = None;
    }
}

impl SqlAdapter {
    fn parse(&self, tags: &[TagSpec]) -> Result<Vec<points::Points>, Error> {
        let points = points::parse(tags, &self.config)?;
        for channel in &self.config.channels {
            if let points::Shape::Wide(_) = points[channel.query].shape {
                return Err(Error::settings(format!(
                    "listen: '{}' tells of keys, but tags name the values of '{}' by column: \
                     have that query give rows of keys",
                    channel.name, self.config.queries[channel.query].name
                )));
            }
        }
        Ok(points)
    }

    /// Tags whose freshness limit is shorter than the time between two polls.
    fn freshness_warning(&self, points: &[points::Points], tags: &[TagSpec]) -> Option<String> {
        let freshness: std::collections::HashMap<_, _> =
            tags.iter().map(|tag| (tag.tag, tag.freshness)).collect();
        let queries = points.iter().zip(&self.config.queries);
        let short: Vec<_> = queries
            .flat_map(|(points, query)| points.all.iter().map(move |point| (point, query.period)))
            .filter(|(point, period)| {
                period.is_none_or(|period| freshness.get(&point.tag).is_none_or(|f| *f < period))
            })
            .map(|(point, _)| point.id.as_str())
            .collect();
        (!short.is_empty()).then(|| {
            format!(
                "{} will go stale between two polls: set poll_seconds below freshness_seconds",
                list(&short)
            )
        })
    }
}

export_plugin!(SqlAdapter: telemetry);
