//! Sampling rates and sample times (7.4.8).

use super::cfg_error::CfgError;
use super::fields::{Fields, Lines};

/// Sample rates of one file.
pub const MAX_RATES: u64 = 1024;
/// The last sample number that the format can write (7.4.8).
const MAX_SAMPLES: u64 = 9_999_999_999;
/// No two samples are closer than a nanosecond.
const MAX_HERTZ: f64 = 1e9;
const NANOS_PER_SECOND: f64 = 1e9;
/// Times beyond are refused: a century.
const MAX_NANOS: f64 = 3.2e18;

/// Sequence of the samples: by rates or by time stamps.
#[derive(Clone, Debug, PartialEq)]
pub enum Sampling {
    /// At rates, one after another.
    Rates(Vec<Rate>),
    /// At the time that each record says.
    Timestamps,
}

/// Sampling rate of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Sampling rate, samples a second.
    pub hertz: f64,
    /// Number of the last sample at this rate.
    pub last: u64,
    /// Number of the sample that times are counted from: the last one before.
    from: u64,
    /// Time at which the section begins, seconds.
    from_seconds: f64,
}

impl Sampling {
    /// Reads the number of rates and the rates; and the number of samples, which
    /// nobody need believe.
    pub(super) fn parse(
        lines: &mut Lines<'_>,
        remarks: &mut Vec<String>,
    ) -> Result<(Self, u64), CfgError> {
        let fields = lines.next("the number of sample rates")?;
        let count = fields.whole(0, "number of sample rates")?.unwrap_or(0);
        if count > MAX_RATES {
            return Err(fields.fault(format!("{count} sample rates; at most {MAX_RATES} are read")));
        }
        let mut rates: Vec<Rate> = Vec::new();
        // Without rates there is one line all the same, which has the last number.
        for index in 1..=count.max(1) {
            if lines.peek().is_some_and(is_stamp) {
                remarks.push(format!("{} sample rates of {count} are there", index - 1));
                break;
            }
            let fields = lines.next(&format!("sample rate {index}"))?;
            let (hertz, last) = parse_rate(&fields, index, rates.last())?;
            if hertz == 0.0 {
                skip_rates(lines, remarks);
                return Ok((Self::Timestamps, last));
            }
            let previous = rates.last().map_or(0, |rate| rate.last);
            if last <= previous && (index > 1 || index < count) {
                remarks.push(format!(
                    "sample rate {index}: its last sample, {last}, does not come after sample \
                     {previous}: it has no samples"
                ));
                continue;
            }
            rates.push(next_rate(hertz, last, rates.last()));
        }
        skip_rates(lines, remarks);
        if count == 0 || rates.is_empty() {
            return Ok((Self::Timestamps, rates.last().map_or(0, |rate| rate.last)));
        }
        let last = rates.last().map_or(0, |rate| rate.last);
        Ok((Self::Rates(rates), last))
    }

    /// The time of a sample, nanoseconds from the first; nothing where records say
    /// it themselves. Samples after the last go on at the last rate.
    pub fn nanos(&self, sample: u64) -> Option<i64> {
        let Self::Rates(rates) = self else { return None };
        let index = rates.partition_point(|rate| rate.last < sample);
        let rate = rates.get(index).or(rates.last())?;
        let steps = sample as f64 - rate.from as f64;
        to_nanos(rate.from_seconds + steps / rate.hertz)
    }
}

/// Reports a line of a time stamp, where one of a rate could be.
fn is_stamp(line: &str) -> bool {
    line.contains(['/', ':']) || line.trim_matches([',', ' ', '\r', '\t']).is_empty()
}

/// Passes over rates beyond their number.
fn skip_rates(lines: &mut Lines<'_>, remarks: &mut Vec<String>) {
    let mut skipped = 0;
    while skipped < MAX_RATES && lines.peek().is_some_and(|line| !is_stamp(line) && is_rate(line)) {
        lines.next_if_any();
        skipped += 1;
    }
    if skipped > 0 {
        remarks.push(format!("{skipped} sample rates more than the file says are left out"));
    }
}

fn is_rate(line: &str) -> bool {
    let numbers: Vec<&str> = line.trim().trim_end_matches(',').split(',').map(str::trim).collect();
    numbers.len() == 2 && numbers.iter().all(|number| number.parse::<f64>().is_ok())
}

fn to_nanos(seconds: f64) -> Option<i64> {
    let nanos = (seconds * NANOS_PER_SECOND).round();
    (nanos.abs() < MAX_NANOS).then_some(nanos as i64)
}

fn parse_rate(
    fields: &Fields<'_>,
    index: u64,
    before: Option<&Rate>,
) -> Result<(f64, u64), CfgError> {
    let hertz = fields.number(0, "sample rate")?.unwrap_or(0.0);
    let last = fields.whole(1, "last sample number")?.unwrap_or(0);
    if !(0.0..=MAX_HERTZ).contains(&hertz) || (hertz == 0.0 && before.is_some()) {
        return Err(fields.fault(format!(
            "sample rate {index}: {hertz} Hz is not within 0 to {MAX_HERTZ}, 0 the first alone"
        )));
    }
    if last > MAX_SAMPLES {
        return Err(fields.fault(format!(
            "sample rate {index}: its last sample is {last}; it can be {MAX_SAMPLES} at most"
        )));
    }
    Ok((hertz, last))
}

/// Each sample is an interval of its own rate after the one before.
fn next_rate(hertz: f64, last: u64, before: Option<&Rate>) -> Rate {
    let (from, from_seconds) = before.map_or((1, 0.0), |rate| {
        (rate.last, rate.from_seconds + (rate.last as f64 - rate.from as f64) / rate.hertz)
    });
    Rate { hertz, last, from, from_seconds }
}
