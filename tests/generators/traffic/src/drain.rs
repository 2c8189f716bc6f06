//! Cost of draining waiting updates: out of shared memory, checked, into the tag table, counted.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use busbar_plugin_host::SampleSink;
use busbar_tags::{Moment, Sample, TagSet, TagSpec, TagTable};
use busbar_types::ValueKind;
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::scene::{GeneratedScene, tag_id};

/// Number of tags, each updated once a burst.
pub(crate) const TAGS: u32 = 100_000;
/// Time between two bursts.
const PERIOD: Duration = Duration::from_millis(60);
const ROUNDS: u64 = 100;

/// Results of the measurement.
#[derive(Debug, Serialize)]
pub(crate) struct DrainTimes {
    /// Milliseconds for [`TAGS`] updates.
    pub(crate) millis: Series,
    /// Part of that time from shared memory to checked samples that are discarded.
    pub(crate) reading_millis: Series,
}

/// Sink of updates as the viewer has it.
struct Updates<'a> {
    table: &'a mut TagTable,
    count: u32,
    changes: u32,
}

impl SampleSink for Updates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self.count += 1;
        self.table.apply(sample, |_| self.changes += 1);
    }
}

pub(crate) fn measure(site: &GeneratedScene) -> Result<DrainTimes> {
    let rate = f64::from(TAGS) / PERIOD.as_secs_f64();
    let settings = json!({ "updates_per_second": rate, "batch_seconds": PERIOD.as_secs_f64() });
    let telemetry = site.generator(&settings, TAGS)?;
    let spec = |tag| TagSpec {
        id: tag_id(tag),
        name: tag_id(tag),
        kind: ValueKind::F64,
        unit: String::new(),
        range: None,
        freshness: Duration::from_secs(3),
        scale: None,
        dead_band: 0.0,
        expression: None,
    };
    let tags = TagSet::new((0..u64::from(TAGS)).map(spec).collect()).unwrap_or_default();
    let mut table = TagTable::new(Arc::new(tags), Moment::now());
    let (mut all, mut reading) = (Vec::new(), Vec::new());
    let rounds = 2 * (ROUNDS / site.divisor) as usize;
    let started = Instant::now();
    while all.len() + reading.len() < rounds {
        ensure!(started.elapsed() < Duration::from_secs(120), "the generator brings too little");
        std::thread::sleep(PERIOD);
        let into_table = all.len() <= reading.len();
        let mut count = 0;
        let start = Instant::now();
        if into_table {
            let mut updates = Updates { table: &mut table, count: 0, changes: 0 };
            telemetry.drain(&mut updates);
            count = updates.count;
            table.advance(Moment::now(), |_| {});
        } else {
            telemetry.drain(&mut |_: &Sample| count += 1);
        }
        let millis = start.elapsed().as_secs_f64() * 1e3;
        // Bursts that were under way are too few, or too many, to be compared.
        if count >= TAGS / 2 {
            let series = if into_table { &mut all } else { &mut reading };
            series.push(millis * f64::from(TAGS) / f64::from(count));
        }
    }
    let link = telemetry.link();
    ensure!(link.dropped == 0 && link.rejected == 0, "updates were lost: {link:?}");
    Ok(DrainTimes {
        millis: Series::from_values(all),
        reading_millis: Series::from_values(reading),
    })
}
