//! Frames beside a million updates a second of a million tags, and without.

use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use busbar_types::Value;
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::scene::{GeneratedScene, frames};

pub(crate) const TAGS: u64 = 1_000_000;
pub(crate) const UPDATES_PER_SECOND: u64 = 1_000_000;
/// Duration of each of the alternating measurements.
const ROUND: Duration = Duration::from_secs(8);
const ROUNDS: usize = 3;
/// Time until the first updates of all tags are in the table.
const SETTLING: Duration = Duration::from_secs(3);

/// Results of the measurement.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Sustained {
    pub(crate) tags: u64,
    /// Seconds from the configuration to the first frame.
    pub(crate) load_seconds: Vec<f64>,
    /// Milliseconds of frames in each quiet round; those of busy rounds follow.
    pub(crate) quiet: Vec<Series>,
    pub(crate) busy: Vec<Series>,
    /// Rate of updates that reached the table in each busy round, a second.
    pub(crate) updates_per_second: Vec<f64>,
    /// Number of updates overtaken or refused.
    pub(crate) lost: u64,
}

pub(crate) fn measure(site: &GeneratedScene) -> Result<Sustained> {
    let tags = TAGS / site.divisor;
    let mut found = Sustained { tags, ..Sustained::default() };
    for _ in 0..ROUNDS {
        for rate in [0, UPDATES_PER_SECOND] {
            let settings = json!({ "updates_per_second": rate, "batch_seconds": 0.005 });
            let (mut viewer, seconds) = site.view(&settings, tags, "i64", 14)?;
            found.load_seconds.push(seconds);
            frames(&mut viewer, SETTLING)?;
            let (before, start) = (rounds_of_all(&viewer), Instant::now());
            let series = Series::from_values(frames(&mut viewer, ROUND / site.divisor as u32)?);
            let seconds = start.elapsed().as_secs_f64();
            if rate == 0 {
                found.quiet.push(series);
                continue;
            }
            found.busy.push(series);
            found.updates_per_second.push((rounds_of_all(&viewer) - before) as f64 / seconds);
            let source = viewer.stats().plugins.into_iter().find(|p| p.name == "source");
            found.lost += source.map_or(0, |source| source.dropped + source.rejected);
        }
    }
    ensure!(found.busy.len() == ROUNDS, "rounds are missing");
    Ok(found)
}

/// Sums up the updates that the tags received; each counts its own.
fn rounds_of_all(viewer: &busbar_viewer::Viewer) -> i64 {
    let of_one = |state: busbar_tags::TagState| match state.value {
        Some(Value::I64(round)) => round + 1,
        _ => 0,
    };
    viewer.tags().states().map(of_one).sum()
}

impl Sustained {
    /// Returns the medians over the rounds of the 99th percentiles, quiet and busy.
    pub(crate) fn p99(&self) -> [f64; 2] {
        [&self.quiet, &self.busy].map(|rounds| median(rounds.iter().map(|series| series.p99)))
    }

    pub(crate) fn slowest(&self) -> f64 {
        self.updates_per_second.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    Series::from_values(values.collect()).p50
}
