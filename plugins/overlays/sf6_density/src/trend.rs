//! Leak rate of a compartment: Theil-Sen slope of medians over whole days, without refills
//! and outliers.

use std::collections::VecDeque;

use busbar_plugin_sdk::{Origin, StoredState};

use crate::theil_sen::{Slope, estimate_slope, median_of};

/// Buckets that a window is divided into at most.
const MAX_BUCKETS: i64 = 120;
/// Closed buckets that are kept at most, those of a window's ends included.
const MAX_KEPT_BUCKETS: usize = MAX_BUCKETS as usize + 8;
/// Index of a kept bucket at most: those of any clock are less.
const MAX_INDEX: i64 = 1 << 40;
/// Gas of a kept sample at most, % of the filling.
const MAX_PERCENT: f64 = 1e4;
/// Temperature of a kept sample at most, °C.
const MAX_CELSIUS: f64 = 1e3;
/// Samples of a bucket: more come too soon after each other.
const MAX_SAMPLES: usize = 96;
/// Share of the window that must be covered before a rate is told.
const LEAST_SHARE: f64 = 0.25;
/// Buckets that must be there before a rate is told.
const LEAST_BUCKETS: usize = 7;
/// Days of a window from which on buckets are whole days.
const LEAST_DAYS: f64 = 2.0;
/// Nanoseconds of a day.
pub(crate) const NANOS_A_DAY: f64 = 86_400e9;
const NANOS_A_YEAR: f64 = 365.25 * NANOS_A_DAY;
/// Rise from bucket to bucket that is a refill, % of the filling.
const REFILL_STEP: f64 = 2.0;
/// Buckets on either side whose medians a refill parts.
const REFILL_REACH: usize = 3;
/// Buckets on either side of one whose median tells whether it is an outlier.
const OUTLIER_REACH: usize = 4;
/// Median deviations from the line beyond which a bucket is an outlier.
const OUTLIER_DEVIATIONS: f64 = 6.0;
/// Distance from the line, % of the filling, within which nothing is an outlier.
const OUTLIER_FLOOR: f64 = 0.5;

/// Sample of a compartment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Gas that is there, % of the filling.
    pub percent: f64,
    /// Temperature that it was compensated from, °C.
    pub celsius: f64,
}

/// Loss of gas from a compartment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Loss, % of the filling a year.
    pub percent_a_year: f64,
    /// Loss that is certain at 95 %, with the error of compensation, %/a.
    pub certain: f64,
    /// Reports whether it is of whole days.
    pub is_daily: bool,
    /// Buckets that were cut out as outliers.
    pub outliers: usize,
    /// Refills that part the window.
    pub refills: usize,
}

/// Closed bucket: medians of its samples.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    index: i64,
    median: Sample,
}

/// Bucket that samples go into.
#[derive(Clone, Debug)]
struct OpenBucket {
    index: i64,
    last: i64,
    samples: Vec<Sample>,
}

/// Medians and samples of a trend as they are kept across restarts, in numbers that are
/// rounded to 0.00001 % and 0.001 K.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct KeptTrend {
    /// Scene time of the newest sample, nanoseconds since 1970-01-01 UTC.
    pub(crate) unix_nanos: i64,
    /// Parameters that the trend belongs to.
    pub(crate) parameters: String,
    /// Origins of its samples that are of another plant than the real one.
    #[serde(default)]
    unreal: u8,
    /// Closed buckets: index, %, °C.
    buckets: Vec<(i64, f64, f64)>,
    /// Index of the open bucket, and its samples: %, °C.
    open: (i64, Vec<(f64, f64)>),
}

impl StoredState for KeptTrend {
    fn is_plausible(&self) -> bool {
        let is_sample = |&(percent, celsius): &(f64, f64)| {
            (0.0..=MAX_PERCENT).contains(&percent) && (-273.15..=MAX_CELSIUS).contains(&celsius)
        };
        let (open, samples) = &self.open;
        let indices = self.buckets.iter().map(|bucket| bucket.0).chain([*open]);
        let median = |bucket: &(i64, f64, f64)| (bucket.1, bucket.2);
        self.buckets.len() <= MAX_KEPT_BUCKETS
            && (1..=MAX_SAMPLES).contains(&samples.len())
            && indices.clone().is_sorted_by(|a, b| a < b)
            && indices.clone().all(|index| (-MAX_INDEX..=MAX_INDEX).contains(&index))
            && self.buckets.iter().map(median).all(|sample| is_sample(&sample))
            && samples.iter().all(is_sample)
    }
}

/// Compensated densities over a window of time.
#[derive(Clone, Debug)]
pub struct Trend {
    window_nanos: i64,
    bucket_nanos: i64,
    /// Error of the compensation, % a kelvin.
    compensation_error: f64,
    buckets: VecDeque<Bucket>,
    open: Option<OpenBucket>,
    loss: Option<Loss>,
    is_due: bool,
    /// Origins of its samples that are of another plant than the real one.
    unreal: Origin,
}

impl Trend {
    /// Empty trend over a window of so many seconds, of densities whose compensation errs by
    /// a share, % a kelvin.
    pub fn new(window_seconds: f64, compensation_error: f64) -> Self {
        let window_nanos = (window_seconds * 1e9) as i64;
        let days = window_nanos as f64 / NANOS_A_DAY;
        let bucket_nanos = if days >= LEAST_DAYS {
            (days / MAX_BUCKETS as f64).ceil() as i64 * NANOS_A_DAY as i64
        } else {
            (window_nanos / MAX_BUCKETS).max(1)
        };
        Self {
            window_nanos,
            bucket_nanos,
            compensation_error,
            buckets: VecDeque::new(),
            open: None,
            loss: None,
            is_due: false,
            unreal: Origin::LIVE,
        }
    }

    /// Begins anew where the next sample is of another origin: simulated, recorded and test values
    /// are of another plant than live ones.
    pub fn follow_origin(&mut self, origin: Origin) {
        if std::mem::replace(&mut self.unreal, origin.unreal()) != origin.unreal() {
            self.buckets.clear();
            self.open = None;
            self.loss = None;
            self.is_due = false;
        }
    }

    /// Takes a sample at an instant of the scene clock. A clock that is set back by more
    /// than a bucket begins anew; by less, the sample is left out.
    pub fn push(&mut self, nanos: i64, sample: Sample) {
        let index = nanos.div_euclid(self.bucket_nanos);
        let newest = self.open.as_ref().map(|open| open.index);
        if newest.is_some_and(|newest| index.saturating_add(1) < newest) {
            self.buckets.clear();
            self.open = None;
            self.loss = None;
        } else if newest.is_some_and(|newest| index < newest) {
            return;
        }
        if self.open.as_ref().is_some_and(|open| open.index != index) {
            self.close(nanos);
        }
        let gap = self.bucket_nanos / MAX_SAMPLES as i64;
        match &mut self.open {
            Some(open) if nanos.saturating_sub(open.last) >= gap.max(1) => {
                open.last = nanos;
                if open.samples.len() < MAX_SAMPLES {
                    open.samples.push(sample);
                }
            }
            Some(_) => {}
            none => *none = Some(OpenBucket { index, last: nanos, samples: vec![sample] }),
        }
    }

    fn close(&mut self, nanos: i64) {
        let Some(open) = self.open.take() else { return };
        let percent = median_of(open.samples.iter().map(|sample| sample.percent).collect());
        let celsius = median_of(open.samples.iter().map(|sample| sample.celsius).collect());
        if let (Some(percent), Some(celsius)) = (percent, celsius) {
            let median = Sample { percent, celsius };
            self.buckets.push_back(Bucket { index: open.index, median });
        }
        let oldest = nanos.saturating_sub(self.window_nanos).div_euclid(self.bucket_nanos);
        while self.buckets.front().is_some_and(|bucket| bucket.index < oldest) {
            self.buckets.pop_front();
        }
        self.is_due = true;
    }

    /// Returns the trend as it is kept across restarts; `None` without any sample.
    pub(crate) fn to_kept(&self, parameters: String) -> Option<KeptTrend> {
        let open = self.open.as_ref()?;
        let percent = |sample: &Sample| (sample.percent * 1e5).round() / 1e5;
        let celsius = |sample: &Sample| (sample.celsius * 1e3).round() / 1e3;
        let bucket = |of: &Bucket| (of.index, percent(&of.median), celsius(&of.median));
        let samples = open.samples.iter().map(|sample| (percent(sample), celsius(sample)));
        Some(KeptTrend {
            unix_nanos: open.last,
            parameters,
            unreal: self.unreal.bits(),
            buckets: self.buckets.iter().map(bucket).collect(),
            open: (open.index, samples.collect()),
        })
    }

    /// Takes what was kept of a trend over the same window.
    pub(crate) fn restore(&mut self, kept: KeptTrend) {
        let KeptTrend { unix_nanos, unreal, buckets, open: (index, samples), .. } = kept;
        self.unreal = Origin::from_bits(unreal);
        let bucket =
            |(index, percent, celsius)| Bucket { index, median: Sample { percent, celsius } };
        self.buckets = buckets.into_iter().map(bucket).collect();
        let sample = |(percent, celsius)| Sample { percent, celsius };
        let samples = samples.into_iter().map(sample).collect();
        self.open = Some(OpenBucket { index, last: unix_nanos, samples });
        self.is_due = true;
    }

    /// Reports whether a bucket was closed since the loss was worked out.
    pub fn is_due(&self) -> bool {
        self.is_due
    }

    /// Works out the loss of the closed buckets: at most 7,140 slopes.
    pub fn update(&mut self) {
        self.is_due = false;
        self.loss = self.estimate();
    }

    /// Loss as it was last worked out; `None` before a quarter of the window is covered.
    pub fn loss(&self) -> Option<Loss> {
        self.loss
    }

    fn estimate(&self) -> Option<Loss> {
        let years = |index: i64| index as f64 * (self.bucket_nanos as f64 / NANOS_A_YEAR);
        let first = self.buckets.front()?.index;
        let steady = self.steady_buckets();
        let (segments, refills) = segments(&steady);
        let points = |value: fn(Sample) -> f64| -> Vec<Vec<[f64; 2]>> {
            let point = |bucket: &Bucket| [years(bucket.index - first), value(bucket.median)];
            segments.iter().map(|segment| segment.iter().map(point).collect()).collect()
        };
        let mut percents = points(|sample| sample.percent);
        let span = |points: &Vec<[f64; 2]>| {
            points.last().zip(points.first()).map_or(0.0, |(last, first)| last[0] - first[0])
        };
        let covered: f64 = percents.iter().map(span).sum();
        let window = self.window_nanos as f64 / NANOS_A_YEAR;
        if self.buckets.len() < LEAST_BUCKETS || covered < LEAST_SHARE * window {
            return None;
        }
        let rough = estimate_slope(&percents)?;
        let outliers =
            self.buckets.len() - steady.len() + remove_outliers(&mut percents, rough.median);
        let Slope { median, high, .. } = estimate_slope(&percents)?;
        // Drift of the temperature leaves an error of compensation behind.
        let drift = estimate_slope(&points(|sample| sample.celsius))?.median.abs();
        Some(Loss {
            percent_a_year: -median,
            certain: -high - drift * self.compensation_error,
            is_daily: self.bucket_nanos >= NANOS_A_DAY as i64,
            outliers,
            refills,
        })
    }

    /// Buckets without those far from the median around them: short runs of outliers, unlike
    /// what stays after a refill.
    fn steady_buckets(&self) -> Vec<Bucket> {
        let all: Vec<Bucket> = self.buckets.iter().copied().collect();
        let is_steady = |(place, bucket): &(usize, &Bucket)| {
            let around =
                place.saturating_sub(OUTLIER_REACH)..all.len().min(place + OUTLIER_REACH + 1);
            let around = all[around].iter().map(|bucket| bucket.median.percent).collect();
            median_of(around)
                .is_none_or(|median| (bucket.median.percent - median).abs() <= REFILL_STEP)
        };
        all.iter().enumerate().filter(is_steady).map(|(_, bucket)| *bucket).collect()
    }
}

/// Buckets between refills, and the number of refills.
fn segments(buckets: &[Bucket]) -> (Vec<Vec<Bucket>>, usize) {
    let percents: Vec<f64> = buckets.iter().map(|bucket| bucket.median.percent).collect();
    let mut segments: Vec<Vec<Bucket>> = vec![Vec::new()];
    let mut refills = 0;
    for (place, bucket) in buckets.iter().enumerate() {
        let (before, after) = percents.split_at(place);
        let step = before.last().map_or(0.0, |last| after[0] - last);
        if step > REFILL_STEP {
            let before = &before[before.len().saturating_sub(REFILL_REACH)..];
            let after = &after[..after.len().min(REFILL_REACH)];
            let rises = median_of(after.to_vec())
                .zip(median_of(before.to_vec()))
                .is_some_and(|(after, before)| after - before > REFILL_STEP);
            // The newest alone may as well be an outlier.
            let is_sure = after.len() > 1 && before.len() > 1;
            refills += usize::from(rises && is_sure);
            if rises {
                segments.push(Vec::new());
            }
        }
        if let Some(segment) = segments.last_mut() {
            segment.push(*bucket);
        }
    }
    (segments, refills)
}

/// Cuts points out that lie far from the line of their segment; returns their number.
fn remove_outliers(segments: &mut [Vec<[f64; 2]>], slope: f64) -> usize {
    let rest = |[x, y]: &[f64; 2]| y - slope * x;
    let centers: Vec<f64> = segments
        .iter()
        .map(|points| median_of(points.iter().map(rest).collect()).unwrap_or(0.0))
        .collect();
    let deviations = segments
        .iter()
        .zip(&centers)
        .flat_map(|(points, center)| points.iter().map(move |point| (rest(point) - center).abs()));
    let limit =
        OUTLIER_FLOOR.max(OUTLIER_DEVIATIONS * median_of(deviations.collect()).unwrap_or(0.0));
    let before: usize = segments.iter().map(Vec::len).sum();
    for (points, center) in segments.iter_mut().zip(&centers) {
        points.retain(|point| (rest(point) - center).abs() <= limit);
    }
    before - segments.iter().map(Vec::len).sum::<usize>()
}

#[cfg(test)]
#[path = "trend_tests.rs"]
mod tests;
