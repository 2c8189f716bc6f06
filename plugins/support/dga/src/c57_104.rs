//! Status by IEEE C57.104-2019: tables 1 to 4.
//!
//! Limits depend on O2/N2 (up to 0.2: sealed; above: breathing) and on age. What equals a
//! limit is not above it. Gases that were not measured are not judged.

use std::fmt;

use crate::margin::Limits;
use crate::{Gas, Margin, Ratio, Sample};

/// Source of the tables, for reports.
pub const SOURCE: &str = "IEEE C57.104-2019, tables 1 to 4";

/// Gases with limits, in the order of the tables.
pub const GASES: [Gas; 7] = [Gas::H2, Gas::Ch4, Gas::C2h6, Gas::C2h4, Gas::C2h2, Gas::Co, Gas::Co2];

/// O2/N2 up to which a transformer counts as sealed.
const SEALED: f64 = 0.2;

/// Age of a transformer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Age {
    /// Age that is not known.
    #[default]
    Unknown,
    /// Age of 1 to 9 years.
    UpTo9,
    /// Age of 10 to 30 years.
    From10To30,
    /// Age above 30 years.
    Over30,
}

/// Status of a transformer: 1 is unexceptional, 3 calls for action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// No gas above tables 1, 3 and 4.
    One,
    /// Some gas above table 1 or 3, and none above table 2 or 4.
    Two,
    /// Some gas above table 2 or 4.
    Three,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::One => "1",
            Self::Two => "2",
            Self::Three => "3",
        })
    }
}

type Row = [f64; GASES.len()];

/// Ages in the order of [`Age`]; table 1: 90th percentiles, ppm.
const TABLE_1_SEALED: [Row; 4] = [
    [80.0, 90.0, 90.0, 50.0, 1.0, 900.0, 9000.0],
    [75.0, 45.0, 30.0, 20.0, 1.0, 900.0, 5000.0],
    [75.0, 90.0, 90.0, 50.0, 1.0, 900.0, 10_000.0],
    [100.0, 110.0, 150.0, 90.0, 1.0, 900.0, 10_000.0],
];
const TABLE_1_BREATHING: [Row; 4] = [
    [40.0, 20.0, 15.0, 50.0, 2.0, 500.0, 5000.0],
    [40.0, 20.0, 15.0, 25.0, 2.0, 500.0, 3500.0],
    [40.0, 20.0, 15.0, 60.0, 2.0, 500.0, 5500.0],
    [40.0, 20.0, 15.0, 60.0, 2.0, 500.0, 5500.0],
];
/// Table 2: 95th percentiles, ppm.
const TABLE_2_SEALED: [Row; 4] = [
    [200.0, 150.0, 175.0, 100.0, 2.0, 1100.0, 12_500.0],
    [200.0, 100.0, 70.0, 40.0, 2.0, 1100.0, 7000.0],
    [200.0, 150.0, 175.0, 95.0, 2.0, 1100.0, 14_000.0],
    [200.0, 200.0, 250.0, 175.0, 4.0, 1100.0, 14_000.0],
];
const TABLE_2_BREATHING: [Row; 4] = [
    [90.0, 50.0, 40.0, 100.0, 7.0, 600.0, 7000.0],
    [90.0, 60.0, 30.0, 80.0, 7.0, 600.0, 5000.0],
    [90.0, 60.0, 40.0, 125.0, 7.0, 600.0, 8000.0],
    [90.0, 30.0, 40.0, 125.0, 7.0, 600.0, 8000.0],
];
/// Table 3: change between two samples, ppm; any C2H2 counts.
const TABLE_3_SEALED: Row = [40.0, 30.0, 25.0, 20.0, 0.0, 250.0, 2500.0];
const TABLE_3_BREATHING: Row = [25.0, 10.0, 7.0, 20.0, 0.0, 175.0, 1750.0];
/// Table 4: rate over 4 to 9 and over 10 to 24 months, ppm a year; any C2H2 counts.
const TABLE_4_SEALED: [Row; 2] =
    [[50.0, 15.0, 15.0, 10.0, 0.0, 200.0, 1750.0], [20.0, 10.0, 9.0, 7.0, 0.0, 100.0, 1000.0]];
const TABLE_4_BREATHING: [Row; 2] =
    [[25.0, 4.0, 3.0, 7.0, 0.0, 100.0, 1000.0], [10.0, 3.0, 2.0, 5.0, 0.0, 80.0, 800.0]];

/// Limits at which the status can change at an unknown age; other ages have others.
const LIMITS: Limits = Limits {
    ratios: &[(Gas::O2, Gas::N2, &[SEALED])],
    gases: &[
        (Gas::H2, &[40.0, 75.0, 80.0, 90.0, 100.0, 200.0]),
        (Gas::Ch4, &[20.0, 30.0, 45.0, 50.0, 60.0, 90.0, 100.0, 110.0, 150.0, 200.0]),
        (Gas::C2h6, &[15.0, 30.0, 40.0, 70.0, 90.0, 150.0, 175.0, 250.0]),
        (Gas::C2h4, &[20.0, 25.0, 40.0, 50.0, 60.0, 80.0, 90.0, 95.0, 100.0, 125.0, 175.0]),
        (Gas::C2h2, &[1.0, 2.0, 4.0, 7.0]),
        (Gas::Co, &[500.0, 600.0, 900.0, 1100.0]),
        (Gas::Co2, &[3500.0, 5000.0, 5500.0, 7000.0, 8000.0, 9000.0, 10_000.0, 12_500.0, 14_000.0]),
    ],
};

/// Months that a rate was taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// Span of 4 to 9 months.
    Months4To9,
    /// Span of 10 to 24 months.
    Months10To24,
}

impl Span {
    /// Returns the span of so many months; `None` where table 4 has none. A span between 9 and 10
    /// months belongs to the longer.
    pub fn of_months(months: f64) -> Option<Self> {
        match months {
            m if (4.0..=9.0).contains(&m) => Some(Self::Months4To9),
            m if m > 9.0 && m <= 24.0 => Some(Self::Months10To24),
            _ => None,
        }
    }
}

/// History beside one sample: changes and rates by gas, in the order of [`GASES`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct History {
    /// Change since the sample before, ppm; `None` for gases that were absent in one.
    pub deltas: [Option<f64>; GASES.len()],
    /// Rate, ppm a year, and its span (see [`crate::rates::regression`]).
    pub rates: [Option<(f64, Span)>; GASES.len()],
}

/// Reports whether O2/N2 indicates a sealed transformer; `None` if it cannot be computed.
fn is_sealed(sample: &Sample) -> Option<bool> {
    let [o2, n2] = sample.all([Gas::O2, Gas::N2])?;
    Ratio::new(o2, n2).value().map(|ratio| ratio <= SEALED)
}

/// Computes the status by tables 1 and 2 alone. `None` where O2 or N2 is absent or both are 0,
/// since the tables depend on their ratio, or where no gas of [`GASES`] was measured.
pub fn status(sample: &Sample, age: Age) -> Option<Status> {
    status_with(sample, age, &History::default())
}

/// Computes the status by all four tables, as far as the history goes; `None` as for [`status`].
pub fn status_with(sample: &Sample, age: Age, history: &History) -> Option<Status> {
    let is_sealed = is_sealed(sample)?;
    let (typical, high, changes, rates) = if is_sealed {
        (&TABLE_1_SEALED, &TABLE_2_SEALED, &TABLE_3_SEALED, &TABLE_4_SEALED)
    } else {
        (&TABLE_1_BREATHING, &TABLE_2_BREATHING, &TABLE_3_BREATHING, &TABLE_4_BREATHING)
    };
    let (typical, high) = (&typical[age as usize], &high[age as usize]);
    let mut status = None;
    for (i, gas) in GASES.into_iter().enumerate() {
        let Some(ppm) = sample.ppm(gas) else { continue };
        let is_fast = history.rates[i].is_some_and(|(rate, span)| rate > rates[span as usize][i]);
        let has_jumped = history.deltas[i].is_some_and(|delta| delta > changes[i]);
        let of_gas = if ppm > high[i] || is_fast {
            Status::Three
        } else if ppm > typical[i] || has_jumped {
            Status::Two
        } else {
            Status::One
        };
        status = status.max(Some(of_gas));
    }
    status
}

/// Returns the 90th and the 95th percentile of each gas of [`GASES`] (tables 1 and 2), ppm, for the
/// O2/N2 of a sample. Without that ratio, those of sealed transformers.
pub fn limits(sample: &Sample, age: Age) -> [[f64; 2]; GASES.len()] {
    let (typical, high) = match is_sealed(sample) {
        Some(false) => (&TABLE_1_BREATHING, &TABLE_2_BREATHING),
        Some(true) | None => (&TABLE_1_SEALED, &TABLE_2_SEALED),
    };
    let row = age as usize;
    std::array::from_fn(|gas| [typical[row][gas], high[row][gas]])
}

/// Computes the margin of [`status`] to another; `None` where there is none, or no change of one
/// gas leads to another.
pub fn margin(sample: &Sample, age: Age) -> Option<Margin> {
    status(sample, age)?;
    LIMITS.margin(sample, |sample| status(sample, age))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Concentration;

    const AGES: [Age; 4] = [Age::Unknown, Age::UpTo9, Age::From10To30, Age::Over30];

    fn sample(o2: f64, gases: &[(Gas, f64)]) -> Sample {
        let of = |ppm| Concentration::measured(ppm).unwrap();
        let sample = Sample::new().with(Gas::O2, of(o2)).with(Gas::N2, of(1000.0));
        gases.iter().fold(sample, |sample, &(gas, ppm)| sample.with(gas, of(ppm)))
    }

    #[test]
    fn each_limit_from_both_sides_and_all_of_them_are_listed() {
        for (o2, typical, high) in
            [(200.0, TABLE_1_SEALED, TABLE_2_SEALED), (200.1, TABLE_1_BREATHING, TABLE_2_BREATHING)]
        {
            for age in AGES {
                for (i, gas) in GASES.into_iter().enumerate() {
                    let (low, top) = (typical[age as usize][i], high[age as usize][i]);
                    let at = |ppm| status(&sample(o2, &[(gas, ppm)]), age).unwrap();
                    assert_eq!((at(0.0), at(low)), (Status::One, Status::One));
                    assert_eq!((at(low.next_up()), at(top)), (Status::Two, Status::Two), "{gas:?}");
                    assert_eq!(at(top.next_up()), Status::Three);
                    let listed = LIMITS.gases.iter().find(|(other, _)| *other == gas).unwrap().1;
                    assert!(listed.contains(&low) && listed.contains(&top), "{gas:?} {low} {top}");
                }
            }
        }
    }

    #[test]
    fn changes_and_rates_count() {
        for (o2, changes, rates) in
            [(200.0, TABLE_3_SEALED, TABLE_4_SEALED), (201.0, TABLE_3_BREATHING, TABLE_4_BREATHING)]
        {
            for (i, gas) in GASES.into_iter().enumerate() {
                let sample = sample(o2, &[(gas, 0.5)]);
                let of = |history| status_with(&sample, Age::Unknown, &history).unwrap();
                let delta = |ppm| {
                    let mut history = History::default();
                    history.deltas[i] = Some(ppm);
                    of(history)
                };
                assert_eq!(delta(changes[i]), Status::One);
                assert_eq!(delta(changes[i].next_up()), Status::Two);
                for span in [Span::Months4To9, Span::Months10To24] {
                    let rate = |ppm| {
                        let mut history = History::default();
                        history.rates[i] = Some((ppm, span));
                        of(history)
                    };
                    assert_eq!(rate(rates[span as usize][i]), Status::One);
                    assert_eq!(rate(rates[span as usize][i].next_up()), Status::Three);
                }
            }
        }
    }

    #[test]
    fn without_the_ratio_there_is_no_status() {
        let h2 = [(Gas::H2, 500.0)];
        let of = |ppm| Concentration::measured(ppm).unwrap();
        assert_eq!(status(&Sample::of_five([500.0; 5]).unwrap(), Age::Unknown), None);
        let both_zero = sample(0.0, &h2).with(Gas::N2, of(0.0));
        assert_eq!(status(&both_zero, Age::Unknown), None);
        let no_nitrogen = sample(5.0, &[(Gas::H2, 60.0)]).with(Gas::N2, of(0.0));
        assert_eq!(status(&no_nitrogen, Age::Unknown), Some(Status::Two));
        assert_eq!(status(&sample(5.0, &[]), Age::Unknown), None);
    }

    #[test]
    fn margins_lead_to_the_nearest_limit() {
        let margin = margin(&sample(100.0, &[(Gas::H2, 40.0), (Gas::Ch4, 80.0)]), Age::Unknown);
        assert_eq!(margin, Some(Margin::Factor { gas: Gas::Ch4, factor: 90.0 / 80.0 }));
    }

    #[test]
    fn spans_are_those_of_the_table() {
        let spans = [3.9, 4.0, 9.0, 9.5, 24.0, 24.1, f64::NAN].map(Span::of_months);
        let (short, long) = (Some(Span::Months4To9), Some(Span::Months10To24));
        assert_eq!(spans, [None, short, short, long, long, None, None]);
    }
}
