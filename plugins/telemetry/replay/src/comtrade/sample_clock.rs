//! Counting of samples, and their times, where sample numbers wrap, start at 0 or jump.
//!
//! A recorder's sample number has as many digits or bits as its maker gave it. The time stamps of
//! the records tell a wrap from a record that is out of order, and a gap from a jump.

use super::cfg::{Cfg, DataType};
use super::sampling::Sampling;

/// Sample numbers after which counters of 15, 16, 31 and 32 bits begin again.
const BINARY_ENDS: [u64; 4] = [0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF];
/// Decimal digits, 4 to 10, after whose greatest number counters begin again.
const DECIMAL_ENDS: std::ops::RangeInclusive<u32> = 4..=10;
/// Values of a time stamp of 32 bits.
const STAMPS: f64 = 4_294_967_296.0;
/// Share of a sampling interval by which a time stamp may be off.
const MAX_JITTER: f64 = 0.5;

/// Counter of the samples of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SampleClock {
    /// Added to a sample number, so that the first sample is 1.
    offset: i128,
    is_started: bool,
    /// Number, count and time stamp of the record before.
    last: Option<(u64, u64, Option<f64>)>,
    /// Added to time stamps, which began again at 0.
    stamp_base: f64,
    /// Time stamp between the last two records, for recordings without rates.
    step: Option<f64>,
}

/// Place of a record in its recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SamplePlace {
    /// Number of the sample, the first being 1.
    pub(crate) count: u64,
    /// Time from the start of the recording, nanoseconds.
    pub(crate) nanos: i64,
    /// Remark on what was odd.
    pub(crate) remark: Option<String>,
}

impl SampleClock {
    /// Counts a record of the recording.
    ///
    /// # Errors
    /// That it has no time, or is earlier than the one before it.
    pub(crate) fn count(
        &mut self,
        cfg: &Cfg,
        number: u64,
        stamp: Option<f64>,
    ) -> Result<SamplePlace, String> {
        let stamp = self.unwrap_stamp(cfg, stamp);
        let (count, remark) = match self.last {
            None if self.is_started => (self.shifted(number), None),
            None => self.begin(cfg, number, stamp),
            Some(last) => self.follow(cfg, number, stamp, last)?,
        };
        let count = count.ok_or_else(|| format!("sample {number} has no place"))?;
        let nanos =
            cfg.nanos(count, stamp).ok_or_else(|| format!("sample {number} has no time"))?;
        if let (Some((.., Some(before))), Some(now)) = (self.last, stamp) {
            self.step = Some(now - before).filter(|step| *step > 0.0).or(self.step);
        }
        self.offset = i128::from(count) - i128::from(number);
        (self.is_started, self.last) = (true, Some((number, count, stamp)));
        Ok(SamplePlace { count, nanos, remark })
    }

    /// Goes on from another record: the one before it is not known.
    pub(crate) fn forget_last(&mut self) {
        (self.last, self.step) = (None, None);
    }

    /// The count of a record without going on; nothing before the first.
    pub(crate) fn shifted(&self, number: u64) -> Option<u64> {
        let count = i128::from(number) + self.offset;
        u64::try_from(count).ok().filter(|count| *count > 0)
    }

    /// The first record: a recording may begin at 0, or with any number where its time stamp says
    /// that nothing was before.
    fn begin(&self, cfg: &Cfg, number: u64, stamp: Option<f64>) -> (Option<u64>, Option<String>) {
        if number == 1 {
            return (Some(1), None);
        }
        if number == 0 {
            return (Some(1), Some("sample numbers begin at 0: counted from 1".into()));
        }
        let by_number = cfg.sampling.nanos(number);
        let by_stamp = stamp.map(|stamp| stamp * cfg.timestamp_nanos);
        match (by_number, by_stamp) {
            (Some(by_number), Some(by_stamp))
                if by_stamp.abs() < (by_stamp - by_number as f64).abs() =>
            {
                let remark = format!(
                    "sample numbers begin at {number}, the time stamps at the start: counted from 1"
                );
                (Some(1), Some(remark))
            }
            _ => (Some(number), None),
        }
    }

    fn follow(
        &self,
        cfg: &Cfg,
        number: u64,
        stamp: Option<f64>,
        (last, last_count, last_stamp): (u64, u64, Option<f64>),
    ) -> Result<(Option<u64>, Option<String>), String> {
        let shifted = self.shifted(number);
        if number.checked_sub(last) == Some(1) {
            return Ok((shifted, None));
        }
        // Samples that passed by the time stamps.
        let passed = last_stamp.zip(stamp).and_then(|(before, now)| {
            let step = self.interval(cfg, last_count)?;
            Some((now - before) / step)
        });
        if number > last {
            // A gap, unless the stamps say that nothing is missing.
            let is_jump = passed.is_some_and(|passed| (passed - 1.0).abs() < MAX_JITTER);
            return Ok(match is_jump {
                false => (shifted, None),
                true => (
                    last_count.checked_add(1),
                    Some(format!(
                        "sample numbers jump from {last} to {number}, the time stamps do not: \
                         counted on"
                    )),
                ),
            });
        }
        let remark = Some(format!("sample numbers go back from {last} to {number}: counted on"));
        match passed {
            Some(passed) if passed > MAX_JITTER => {
                // Within the reach of a count: a stamp has 32 bits.
                let more = passed.round().max(1.0) as u64;
                Ok((last_count.checked_add(more), remark))
            }
            // Stamps that stand still say nothing.
            _ if number <= 1
                && is_end(last)
                && passed.is_none_or(|passed| passed.abs() < MAX_JITTER) =>
            {
                Ok((last_count.checked_add(1), remark))
            }
            _ if number == last => Ok((shifted, None)),
            _ => Err(format!("sample {number} is earlier than the one before it")),
        }
    }

    /// Time stamp from a sample to the next.
    fn interval(&self, cfg: &Cfg, count: u64) -> Option<f64> {
        let interval = match &cfg.sampling {
            Sampling::Timestamps => self.step?,
            rates @ Sampling::Rates(_) => {
                let (from, to) = (rates.nanos(count)?, rates.nanos(count.checked_add(1)?)?);
                (to - from) as f64 / cfg.timestamp_nanos
            }
        };
        Some(interval).filter(|interval| *interval > 0.0)
    }

    /// A time stamp of 32 bits that began again at 0 goes on.
    fn unwrap_stamp(&mut self, cfg: &Cfg, stamp: Option<f64>) -> Option<f64> {
        let stamp = stamp?;
        if cfg.data != DataType::Ascii
            && let Some((.., Some(before))) = self.last
            && before - self.stamp_base > STAMPS * 0.75
            && stamp < STAMPS * 0.25
        {
            self.stamp_base += STAMPS;
        }
        Some(stamp + self.stamp_base)
    }
}

fn is_end(number: u64) -> bool {
    BINARY_ENDS.contains(&number) || DECIMAL_ENDS.into_iter().any(|d| number == 10_u64.pow(d) - 1)
}

#[cfg(test)]
#[path = "sample_clock_tests.rs"]
mod tests;
