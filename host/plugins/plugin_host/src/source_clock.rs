//! Clock of a source against the host's: skew, steps, and times that cannot be used.

use std::fmt;
use std::time::Duration;

use busbar_tags::Moment;
use serde::{Deserialize, Serialize};

/// Farthest that a source's time may be ahead of the host's clock before it makes its
/// value uncertain, nanoseconds.
pub const MAX_CLOCK_AHEAD: i64 = 10 * SECOND;

const SECOND: i64 = 1_000_000_000;
const MINUTE: i64 = 60 * SECOND;
/// Time over which the freshest sample is looked for.
const WINDOW: Duration = Duration::from_secs(1);
/// Consecutive windows that must agree before a skew is reported.
const STEADY_WINDOWS: usize = 3;
/// Difference between windows that agree, nanoseconds.
const MAX_SPREAD: i64 = SECOND / 2;
/// Least skew that is reported, nanoseconds: below it, networks and polling explain it.
const MIN_SKEW: i64 = 5 * SECOND;
/// Least step back that is one: below it, samples overtake each other, nanoseconds.
const MIN_STEP: i64 = SECOND;
/// A skew beyond it is a wrong unit or a clock that was never set: 20 years, nanoseconds.
const MIN_UNIT_SKEW: i64 = 20 * 365 * 86_400 * SECOND;
/// Zones are whole quarters of an hour, up to 14 hours.
const ZONE_STEP: i64 = 15 * MINUTE;
const MIN_ZONE: i64 = ZONE_STEP - MAX_ZONE_ERROR;
const MAX_ZONE: i64 = 14 * 60 * MINUTE + MAX_ZONE_ERROR;
/// Farthest from a zone that a skew still looks like one, nanoseconds.
const MAX_ZONE_ERROR: i64 = 90 * SECOND;

/// Time from which the age of values is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FreshnessBasis {
    /// Time at the source where it gives one, else reception.
    #[default]
    SourceTime,
    /// Reception: for sources whose clock is known to be wrong. What comes out of a buffer
    /// is still judged by its time.
    Reception,
}

/// Findings about the clock of one telemetry instance's source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClockReport {
    /// Steady difference of the source's clock from the host's, nanoseconds; positive where
    /// the source is ahead.
    pub skew_nanos: Option<i64>,
    /// Steps back of the source's clock.
    pub steps: u64,
    /// Samples whose promised time was missing or unreadable.
    pub unusable_times: u64,
    /// Samples whose time was in the future.
    pub future_times: u64,
    /// Time from which the age of values is counted.
    pub basis: FreshnessBasis,
}

/// Estimate of a source's clock from the times of its live samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct SourceClock {
    report: ClockReport,
    window_end: Moment,
    /// Freshest sample of the window: the greatest time ahead of the host, nanoseconds.
    greatest: Option<i64>,
    /// The same of the windows before, the newest last.
    windows: Vec<i64>,
    /// Time ahead of the host after the last step back, nanoseconds.
    stepped_to: Option<i64>,
}

impl SourceClock {
    pub(crate) fn new(basis: FreshnessBasis) -> Self {
        Self { report: ClockReport { basis, ..ClockReport::default() }, ..Self::default() }
    }

    pub(crate) fn report(&self) -> ClockReport {
        self.report
    }

    /// Records by how much the time of a live sample is ahead of the host's clock.
    #[inline(always)]
    pub(crate) fn note(&mut self, ahead: i64, received: Moment) {
        if received >= self.window_end {
            self.finish_window(received);
        }
        self.greatest = self.greatest.max(Some(ahead));
    }

    /// Records the time of a live sample that is older than that of its tag before.
    pub(crate) fn note_older(&mut self, ahead: i64, by: i64) {
        let is_same = self.stepped_to.is_some_and(|to| (ahead - to).abs() < MIN_STEP);
        if by >= MIN_STEP && !is_same {
            self.report.steps += 1;
            self.stepped_to = Some(ahead);
            // What was fresh before the step is no measure any more.
            self.greatest = None;
            self.windows.clear();
        }
    }

    pub(crate) fn note_unusable(&mut self) {
        self.report.unusable_times += 1;
    }

    pub(crate) fn note_future(&mut self) {
        self.report.future_times += 1;
    }

    #[cold]
    fn finish_window(&mut self, received: Moment) {
        self.window_end = received.after(WINDOW);
        let Some(greatest) = self.greatest.take() else { return };
        if self.stepped_to.is_some_and(|to| greatest > to.saturating_add(MIN_STEP)) {
            self.stepped_to = None;
        }
        if self.windows.len() == STEADY_WINDOWS {
            self.windows.remove(0);
        }
        self.windows.push(greatest);
        let (least, most) = self
            .windows
            .iter()
            .fold((i64::MAX, i64::MIN), |(least, most), &w| (least.min(w), most.max(w)));
        let is_steady =
            self.windows.len() == STEADY_WINDOWS && most.saturating_sub(least) <= MAX_SPREAD;
        // A value that nobody measures anew grows older from window to window: no skew.
        if is_steady {
            self.report.skew_nanos = Some(most).filter(|skew| skew.saturating_abs() >= MIN_SKEW);
        } else if most.saturating_abs() < MIN_SKEW {
            self.report.skew_nanos = None;
        }
    }
}

impl ClockReport {
    /// Sentences for operators, with the remedy; none where the clock is as it should be.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Some(skew) = self.skew_nanos {
            let (length, side) = (in_words(skew), if skew > 0 { "ahead of" } else { "behind" });
            let remedy = remedy(skew);
            remarks.push(format!("the source's clock is {length} {side} this machine's: {remedy}"));
        }
        if self.steps > 0 {
            let steps = self.steps;
            let times = if steps == 1 { "once".to_owned() } else { format!("{steps} times") };
            remarks.push(format!("the source's clock was set back {times}"));
        }
        if self.future_times > 0 {
            let count = self.future_times;
            let many = if count == 1 { "value has" } else { "values have" };
            remarks.push(format!(
                "{count} {many} times of the future and are uncertain: correct the clocks, or the \
                 zone or unit of the time's field"
            ));
        }
        if self.unusable_times > 0 {
            let count = self.unusable_times;
            let many = if count == 1 { "value has" } else { "values have" };
            remarks.push(format!(
                "{count} {many} no usable time where one is promised and are uncertain: correct \
                 the time's field or its format"
            ));
        }
        if self.basis == FreshnessBasis::Reception {
            remarks.push("ages count from reception, not from the source's time".to_owned());
        }
        remarks
    }
}

/// Returns the remedy for a skew, by its probable cause.
fn remedy(skew: i64) -> &'static str {
    let size = skew.saturating_abs();
    let from_zone = (size + ZONE_STEP / 2) % ZONE_STEP - ZONE_STEP / 2;
    if size >= MIN_UNIT_SKEW {
        "set the unit of the time's field (seconds, milliseconds), or the source's clock"
    } else if (MIN_ZONE..=MAX_ZONE).contains(&size) && from_zone.abs() <= MAX_ZONE_ERROR {
        "set the zone of the source's times, or the clock of one of them"
    } else {
        "set the source's clock or this machine's (NTP), or count ages from reception"
    }
}

/// Length of time in its two greatest units.
fn in_words(nanos: i64) -> String {
    let seconds = (nanos.unsigned_abs() + SECOND as u64 / 2) / SECOND as u64;
    let (minutes, hours, days) = (seconds / 60, seconds / 3600, seconds / 86_400);
    let years = days / 365;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{minutes} min {} s", seconds % 60),
        3600..86_400 => format!("{hours} h {} min", minutes % 60),
        _ if years == 0 => format!("{days} d {} h", hours % 24),
        _ => format!("{years} years"),
    }
}

impl fmt::Display for FreshnessBasis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SourceTime => "source time",
            Self::Reception => "reception",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Moment = Moment(1 << 60);

    /// A clock after samples each of which came so many milliseconds after the start, so
    /// many seconds ahead.
    fn clock(samples: impl IntoIterator<Item = (u64, f64)>) -> SourceClock {
        let mut clock = SourceClock::new(FreshnessBasis::SourceTime);
        for (millis, ahead) in samples {
            clock.note((ahead * 1e9) as i64, START.after(Duration::from_millis(millis)));
        }
        clock
    }

    fn remark_of(skew: f64) -> String {
        let polls = (0..80).map(|i| (i * 100, skew - 0.01));
        clock(polls).report().remarks().concat()
    }

    #[test]
    fn a_steady_skew_is_told_with_its_remedy() {
        for (skew, words, remedy) in [
            (3600.0, "1 h 0 min ahead", "zone"),
            (-3600.0, "1 h 0 min behind", "zone"),
            (-8.0 * 3600.0, "8 h 0 min behind", "zone"),
            (5.75 * 3600.0, "5 h 45 min ahead", "zone"),
            (-37.0, "37 s behind", "NTP"),
            (1000.0, "16 min 40 s ahead", "NTP"),
            (-56.0 * 365.25 * 86_400.0, "56 years behind", "unit"),
        ] {
            let remark = remark_of(skew);
            assert!(remark.contains(words) && remark.contains(remedy), "{skew}: {remark}");
        }
        for skew in [0.0, 0.8, -0.5, -4.0] {
            assert_eq!(remark_of(skew), "", "{skew}");
        }
    }

    #[test]
    fn a_value_that_nobody_measures_anew_is_no_skew() {
        let repeated = (0..100).map(|i| (i * 100, -3600.0 - i as f64 * 0.1));
        assert_eq!(clock(repeated).report().skew_nanos, None);
        let changes_at_times = (0..200).map(|i| (i * 100, -((i * 100 % 4000) as f64) / 1000.0));
        assert_eq!(clock(changes_at_times).report().skew_nanos, None);
    }

    #[test]
    fn a_corrected_clock_has_no_skew_any_more() {
        let wrong = (0..80).map(|i| (i * 100, 3600.0));
        let right = (80..160).map(|i| (i * 100, 0.0));
        assert!(clock(wrong.clone()).report().skew_nanos.is_some());
        assert_eq!(clock(wrong.chain(right)).report().skew_nanos, None);
    }

    #[test]
    fn a_step_is_counted_once_however_many_tags_it_concerns() {
        let mut clock = clock([(0, 0.0)]);
        for tag in 0..1000 {
            clock.note_older(-2 * SECOND - tag * 1000, 2 * SECOND - tag * 1000);
        }
        assert_eq!(clock.report().steps, 1);
        clock.note_older(-7 * SECOND, 5 * SECOND);
        assert_eq!(clock.report().steps, 2, "another step");
        clock.note_older(-SECOND / 2, SECOND / 2);
        assert_eq!(clock.report().steps, 2, "samples that overtake each other");
    }
}
