//! Samples of each transformer in the order of time: changes and rates between them.

use std::collections::{HashMap, VecDeque};

use dga::Sample;
use dga::c57_104::{GASES, History, Span};
use dga::rates::{REGRESSION_READINGS, Reading, regression};
use time::format_description::well_known::{Iso8601, Rfc3339};
use time::{Date, OffsetDateTime};

/// Transformers of one file: for each its last samples are kept.
pub(crate) const MAX_EQUIPMENT: usize = 20_000;
/// Samples that are kept of each.
pub(crate) const MAX_KEPT: usize = *REGRESSION_READINGS.end();
const NANOS_A_DAY: f64 = 86_400e9;
/// Julian day number of 1970-01-01, as dates are counted here.
const EPOCH_DAY: f64 = 2_440_588.0;
/// Columns of history, after the results.
pub(crate) const COLUMNS: [&str; 1 + GASES.len()] = [
    "c57_status_history",
    "h2_rate",
    "ch4_rate",
    "c2h6_rate",
    "c2h4_rate",
    "c2h2_rate",
    "co_rate",
    "co2_rate",
];

/// Last samples by equipment.
#[derive(Default)]
pub(crate) struct Book(HashMap<String, VecDeque<Entry>>);

struct Entry {
    day: f64,
    ppm: [Option<f64>; GASES.len()],
}

/// Trend that a sample gives with those before it.
#[derive(Debug, PartialEq)]
pub(crate) struct Trend {
    pub(crate) history: History,
    /// Rates, ppm a year, over whatever time the samples span.
    pub(crate) rates: [Option<f64>; GASES.len()],
}

impl Book {
    /// Takes the next sample of a transformer.
    ///
    /// # Errors
    /// Why it cannot be put in order, in words.
    pub(crate) fn add(
        &mut self,
        equipment: &str,
        time: &str,
        sample: &Sample,
    ) -> Result<Trend, String> {
        let day = day_of(time)?;
        if equipment.is_empty() {
            return Err("equipment: it is not named".into());
        }
        if !self.0.contains_key(equipment) && self.0.len() >= MAX_EQUIPMENT {
            return Err(format!("more than {MAX_EQUIPMENT} transformers in one file"));
        }
        let kept = self.0.entry(equipment.to_owned()).or_default();
        if kept.back().is_some_and(|last| last.day >= day) {
            return Err(format!("time: '{time}' is not after the sample before of '{equipment}'"));
        }
        Ok(push(kept, day, sample))
    }
}

/// Last samples of one transformer, in the order of time.
#[derive(Default)]
pub(crate) struct Page(VecDeque<Entry>);

impl Page {
    /// Takes the next one; what it adds to those before.
    pub(crate) fn add(&mut self, unix_nanos: i64, sample: &Sample) -> Trend {
        push(&mut self.0, unix_nanos as f64 / NANOS_A_DAY, sample)
    }
}

fn push(kept: &mut VecDeque<Entry>, day: f64, sample: &Sample) -> Trend {
    while kept.len() >= MAX_KEPT {
        kept.pop_front();
    }
    kept.push_back(Entry { day, ppm: GASES.map(|gas| sample.ppm(gas)) });
    trend(kept)
}

fn trend(kept: &VecDeque<Entry>) -> Trend {
    let mut trend = Trend { history: History::default(), rates: [None; GASES.len()] };
    for gas in 0..GASES.len() {
        let readings: Vec<_> = kept
            .iter()
            .filter_map(|entry| Some(Reading { day: entry.day, ppm: entry.ppm[gas]? }))
            .collect();
        let mut latest = kept.iter().rev().map(|entry| entry.ppm[gas]);
        let (last, before) = (latest.next().flatten(), latest.next().flatten());
        trend.history.deltas[gas] = last.zip(before).map(|(last, before)| last - before);
        if let Ok((rate, months)) = regression(&readings) {
            trend.rates[gas] = Some(rate);
            trend.history.rates[gas] = Span::of_months(months).map(|span| (rate, span));
        }
    }
    trend
}

/// The instant that a text is, nanoseconds since 1970-01-01 UTC, to the second.
///
/// # Errors
/// Returns the errors of [`day_of`].
pub(crate) fn unix_nanos_of(text: &str) -> Result<i64, String> {
    let seconds = ((day_of(text)? - EPOCH_DAY) * 86_400.0).round() as i64;
    Ok(seconds.saturating_mul(1_000_000_000))
}

/// Days since some day long ago; a date alone is its beginning.
fn day_of(text: &str) -> Result<f64, String> {
    const SECONDS_A_DAY: f64 = 86_400.0;
    const DATE_BYTES: usize = "2026-01-31".len();
    // The parser of dates would take, and forget, a time behind one.
    if text.len() == DATE_BYTES
        && let Ok(date) = Date::parse(text, &Iso8601::DATE)
    {
        return Ok(f64::from(date.to_julian_day()));
    }
    let instant = OffsetDateTime::parse(text, &Rfc3339).map_err(|_| {
        const SHOWN: usize = 40;
        let shown = &text[..text.floor_char_boundary(SHOWN)];
        format!("time: '{shown}' is no time; write 2026-01-31 or 2026-01-31T12:00:00Z")
    })?;
    let utc = instant.to_offset(time::UtcOffset::UTC);
    let seconds = (utc - utc.replace_time(time::Time::MIDNIGHT)).as_seconds_f64();
    Ok(f64::from(utc.date().to_julian_day()) + seconds / SECONDS_A_DAY)
}

#[cfg(test)]
mod tests {
    use dga::c57_104::{Age, Status, status_with};
    use dga::{Concentration, Gas};

    use super::*;

    fn sample(h2: f64) -> Sample {
        let of = |ppm| Concentration::measured(ppm).unwrap();
        let sealed = Sample::new().with(Gas::O2, of(100.0)).with(Gas::N2, of(50_000.0));
        sealed.with(Gas::H2, of(h2))
    }

    #[test]
    fn changes_and_rates_of_each_transformer() {
        let mut book = Book::default();
        let mut add =
            |equipment: &str, time: &str, h2| book.add(equipment, time, &sample(h2)).unwrap();
        let first = add("A", "2025-01-01", 10.0);
        assert_eq!((first.history, first.rates), (History::default(), [None; GASES.len()]));
        assert_eq!(add("B", "2024-01-01", 70.0).history.deltas[0], None);
        let second = add("A", "2025-04-01T00:00:00Z", 25.0);
        assert_eq!((second.history.deltas[0], second.rates[0]), (Some(15.0), None));
        // Three samples within half a year, 60 ppm a year: above the 50 of table 4.
        let third = add("A", "2025-07-02T00:00:00+00:00", 40.0);
        let (rate, span) = third.history.rates[0].unwrap();
        assert!((rate - 60.0).abs() < 0.5 && span == Span::Months4To9, "{rate} {span:?}");
        assert_eq!(third.rates[0], Some(rate));
        let status = |history| status_with(&sample(40.0), Age::Unknown, &history);
        assert_eq!(status(third.history), Some(Status::Three));
        assert_eq!(status(second.history), Some(Status::One));
        // CH4 was never measured.
        assert_eq!((third.history.deltas[1], third.rates[1]), (None, None));
    }

    #[test]
    fn only_the_last_samples_are_kept() {
        let mut book = Book::default();
        for month in 1..=12 {
            book.add("A", &format!("2025-{month:02}-01"), &sample(5.0)).unwrap();
        }
        assert_eq!(book.0["A"].len(), MAX_KEPT);
        assert_eq!(book.0["A"][0].day, day_of("2025-07-01").unwrap());
    }

    #[test]
    fn what_has_no_order_is_refused() {
        let mut book = Book::default();
        book.add("A", "2025-02-28", &sample(1.0)).unwrap();
        let mut fault = |equipment, time| book.add(equipment, time, &sample(1.0)).unwrap_err();
        assert!(fault("A", "2025-02-28").contains("is not after the sample before of 'A'"));
        assert!(fault("A", "2025-02-27T23:59:59Z").contains("is not after"));
        for time in [
            "",
            "yesterday",
            "2025-02-30",
            "28.02.2025",
            "2025-03-01T12:00",
            "2025-02-28T25:00:00Z",
        ] {
            assert!(fault("A", time).contains("is no time; write 2026-01-31"), "{time}");
        }
        assert!(fault("", "2025-03-01").contains("not named"));
        // Half a day later.
        let (noon, day) = (day_of("2025-03-01T12:00:00Z").unwrap(), day_of("2025-03-01").unwrap());
        assert_eq!(noon - day, 0.5);
        assert_eq!(day_of("2025-03-01T14:00:00+02:00").unwrap(), noon);
        for i in 1..MAX_EQUIPMENT {
            book.add(&i.to_string(), "2025-01-01", &sample(1.0)).unwrap();
        }
        assert!(book.add("more", "2025-01-01", &sample(1.0)).unwrap_err().contains("more than"));
    }
}
