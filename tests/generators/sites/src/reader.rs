//! Reader of the values: the plugin in its process, and the tag table, filled once a frame as in a
//! window.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use busbar_plugin_host::{LoadRules, SampleSink, SourcePolicy, TelemetryTag};
use busbar_plugin_process::{
    Confinement, DEFAULT_CONFINEMENT, Isolation, PluginCatalog, PluginOptions, RunningTelemetry,
};
use busbar_tags::{Moment, Sample, TagSet, TagSpec, TagTable};
use busbar_types::{Value, ValueKind};
use serde_json::json;

use crate::generator::now;
use crate::payload::PayloadFormat;

/// Time between two frames of a window.
const FRAME: Duration = Duration::from_millis(16);
/// Longest wait until the plugin is connected.
const PATIENCE: Duration = Duration::from_secs(120);
/// Interval of values for latency: one of so many is sampled.
const SAMPLED: u64 = 97;

/// Running plugin with the tag table.
pub(crate) struct Reader {
    telemetry: RunningTelemetry,
    table: TagTable,
    pub(crate) taken: ReceivedValues,
}

/// Counts and latencies of received values.
#[derive(Debug, Default)]
pub(crate) struct ReceivedValues {
    /// Number of good values.
    pub(crate) values: u64,
    /// Publish times of some values of a frame, nanoseconds since 1970.
    published: Vec<i64>,
    /// Latencies from publication to the table, milliseconds.
    pub(crate) latencies: Vec<f64>,
}

struct Updates<'a> {
    table: &'a mut TagTable,
    taken: &'a mut ReceivedValues,
}

impl SampleSink for Updates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self.table.apply(sample, |_| {});
        if let (Some(Value::I64(published)), true) = (&sample.value, sample.quality.is_good()) {
            self.taken.values += 1;
            if self.taken.values.is_multiple_of(SAMPLED) {
                self.taken.published.push(*published);
            }
        }
    }
}

impl Reader {
    pub(crate) fn start(
        libraries: PathBuf,
        form: PayloadFormat,
        port: u16,
        tags: &[TelemetryTag],
    ) -> Result<Self> {
        let isolation = Isolation::Process;
        let catalog = PluginCatalog::discover(&[libraries], &LoadRules::default(), isolation);
        let confinement = Confinement { network: true, ..DEFAULT_CONFINEMENT };
        let options = PluginOptions { isolation, confinement, ..PluginOptions::default() };
        let settings = json!({
            "host": "127.0.0.1", "port": port, "qos": 0, "keep_alive_seconds": 60,
            "subscriptions": form.subscriptions(),
        });
        let plugin = catalog.create("sites", "mqtt", &settings, &options)?;
        let telemetry = RunningTelemetry::start(&plugin, tags, SourcePolicy::default())?;
        let spec = |tag: &TelemetryTag| TagSpec {
            id: tag.id.clone(),
            name: tag.id.clone(),
            kind: ValueKind::I64,
            unit: String::new(),
            range: None,
            freshness: tag.freshness,
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let set = TagSet::new(tags.iter().map(spec).collect()).ok().context("tags of one id")?;
        let table = TagTable::new(Arc::new(set), Moment::now());
        let mut reader = Self { telemetry, table, taken: ReceivedValues::default() };
        let start = Instant::now();
        while !reader.telemetry.link().message.ends_with("connected") {
            ensure!(start.elapsed() < PATIENCE, "no connection: {:?}", reader.telemetry.link());
            reader.frame();
        }
        Ok(reader)
    }

    /// Waits for one frame, then applies all values that came.
    pub(crate) fn frame(&mut self) {
        std::thread::sleep(FRAME);
        self.telemetry.drain(&mut Updates { table: &mut self.table, taken: &mut self.taken });
        self.table.advance(Moment::now(), |_| {});
        let there = now();
        let millis = |published: i64| (there - published) as f64 / 1e6;
        self.taken.latencies.extend(self.taken.published.drain(..).map(millis));
    }

    /// Returns the number of values that were overtaken or refused in the ring.
    pub(crate) fn lost(&self) -> u64 {
        let link = self.telemetry.link();
        link.dropped + link.rejected
    }
}
