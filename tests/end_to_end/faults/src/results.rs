//! Results of a run, and their required bars.

use std::collections::BTreeMap;

use report_writer::{Claim, Series, Verdict};
use serde::Serialize;

use crate::injection::{Outcome, Record};
use crate::process_boundary::BoundaryCosts;
use crate::round::Round;

/// Greatest growth of memory from the first round to the last, bytes. Allocators and the software
/// rasteriser have their caches after the first round.
const MAX_GROWTH_BYTES: u64 = 64_000_000;
/// Longest time until a lost plugin is shown as bad, milliseconds.
const MAX_TO_BAD_MILLIS: f64 = 1000.0;
/// Longest time from death to correct data without other load, milliseconds.
const MAX_AWAY_MILLIS: f64 = 100.0;
/// Longest time between frames beside a storm in one plugin, milliseconds.
const MAX_GAP_MILLIS: f64 = 100.0;
/// Lowest rate of samples a second through the process boundary.
const MIN_SAMPLES_PER_SECOND: f64 = 1e6;

/// Resource usage of this process after a round.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Usage {
    pub(crate) resident_bytes: u64,
    pub(crate) descriptors: usize,
    pub(crate) threads: usize,
}

/// Results of a whole run.
#[derive(Debug, Serialize)]
pub(crate) struct Results {
    /// Costs of the process boundary without other load.
    pub(crate) border: Option<BoundaryCosts>,
    /// Number of plugin processes in a scene.
    pub(crate) processes: usize,
    #[serde(skip)]
    pub(crate) records: Vec<Record>,
    pub(crate) rounds: usize,
    pub(crate) seconds: f64,
    /// Resource usage after each round.
    pub(crate) usage: Vec<Usage>,
    #[serde(skip)]
    gaps_millis: Vec<f64>,
    #[serde(skip)]
    load_millis: Vec<f64>,
    #[serde(skip)]
    close_millis: Vec<f64>,
}

impl Results {
    pub(crate) fn new(border: Option<BoundaryCosts>, processes: usize) -> Self {
        Self {
            border,
            processes,
            records: Vec::new(),
            rounds: 0,
            seconds: 0.0,
            usage: Vec::new(),
            gaps_millis: Vec::new(),
            load_millis: Vec::new(),
            close_millis: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, round: Round) {
        self.rounds += 1;
        self.records.extend(round.records);
        self.gaps_millis.extend(round.gaps_millis);
        self.load_millis.push(round.load_millis);
        self.close_millis.push(round.close_millis);
    }

    pub(crate) fn note_usage(&mut self, usage: Usage) {
        self.usage.push(usage);
    }

    /// Counts the injections by outcome.
    pub(crate) fn outcomes(&self) -> BTreeMap<Outcome, usize> {
        let mut counts = BTreeMap::new();
        for record in &self.records {
            *counts.entry(record.outcome.clone()).or_default() += 1;
        }
        counts
    }

    pub(crate) fn to_bad(&self) -> Series {
        Series::from_values(self.records.iter().filter_map(|record| record.to_bad_millis).collect())
    }

    pub(crate) fn to_good(&self) -> Series {
        Series::from_values(
            self.records.iter().filter_map(|record| record.to_good_millis).collect(),
        )
    }

    pub(crate) fn gaps(&self) -> Series {
        Series::from_values(self.gaps_millis.clone())
    }

    pub(crate) fn loads(&self) -> Series {
        Series::from_values(self.load_millis.clone())
    }

    pub(crate) fn closes(&self) -> Series {
        Series::from_values(self.close_millis.clone())
    }

    /// Judges the bars. A run gets this far only where the view survived everything and the healthy
    /// plugin never suffered.
    pub(crate) fn bars(&self) -> Vec<Claim> {
        let bar = |claim: &str, reached: bool, figure: String| Claim {
            claim: claim.to_owned(),
            verdict: Verdict::of_bar(reached),
            figure,
        };
        let mut bars = Vec::new();
        if let Some(border) = &self.border {
            let (to_bad, away, gap) = (self.to_bad(), border.away_millis, border.storm_gap_millis);
            bars.push(bar(
                "a lost plugin is shown as bad within 1 s (p99)",
                to_bad.p99 <= MAX_TO_BAD_MILLIS,
                format!("{:.0} ms", to_bad.p99),
            ));
            bars.push(bar(
                "correct data within 100 ms of a death (p99, no back-off, no other load)",
                away.p99 <= MAX_AWAY_MILLIS,
                format!("{:.1} ms", away.p99),
            ));
            bars.push(bar(
                "frames at most 100 ms apart beside a storm in one plugin (p99, no other load)",
                gap.p99 <= MAX_GAP_MILLIS,
                format!("{:.1} ms, longest {:.1} ms", gap.p99, gap.longest),
            ));
            let isolated = border.modes.iter().filter(|mode| mode.isolation == "process");
            bars.extend(isolated.map(|mode| {
                bar(
                    "1,000,000 samples a second through the border",
                    mode.samples_per_second >= MIN_SAMPLES_PER_SECOND,
                    format!("{:.2} million", mode.samples_per_second / 1e6),
                )
            }));
        }
        if let [first, .., last] = &self.usage[..] {
            let grown = last.resident_bytes.saturating_sub(first.resident_bytes);
            bars.push(bar(
                "memory grows by at most 64 MB after the first round",
                grown <= MAX_GROWTH_BYTES,
                format!("{:.1} MB", grown as f64 / 1e6),
            ));
            bars.push(bar(
                "no descriptor is left behind",
                last.descriptors <= first.descriptors,
                format!(
                    "{} after the first round, {} at the end",
                    first.descriptors, last.descriptors
                ),
            ));
            bars.push(bar(
                "no thread is left behind",
                last.threads <= first.threads,
                format!("{} after the first round, {} at the end", first.threads, last.threads),
            ));
        }
        bars
    }

    /// Returns the bars that were missed, with their figures.
    pub(crate) fn missed_bars(&self) -> Vec<String> {
        let bars = self.bars().into_iter();
        let missed = bars.filter(|bar| bar.verdict == Verdict::Missed);
        missed.map(|bar| format!("{} ({})", bar.claim, bar.figure)).collect()
    }
}
