//! Bounds of the status by IEEE C57.104-2019, tables 1 and 2, of a sample that is not whole.
//!
//! The status is that of the worst gas, so that a gas that is not known can only raise it.
//! Limits depend on O2/N2: without that ratio both rows of the tables may be the right one.

use dga::c57_104::{self, Age, GASES, Status};
use dga::{Concentration, Gas, Sample};

/// O2 and N2, ppm, of a sealed and of a breathing transformer: any ratio up to 0.2, and any
/// above.
const RATIOS: [[f64; 2]; 2] = [[1.0, 100.0], [1.0, 1.0]];

/// Bounds of a status, and what they rest on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StatusBounds {
    /// Status that it has at least.
    pub(crate) least: Status,
    /// Status that it has at most.
    pub(crate) most: Status,
    /// Gases above table 1 in a row of the tables that may be the right one.
    pub(crate) above: Vec<Gas>,
    /// Reports whether the verdict needs O2 and N2, known or not.
    pub(crate) needs_ratio: bool,
}

impl StatusBounds {
    /// The bounds by the gases that are known, where others may have any concentration.
    pub(crate) fn new(known: &Sample, are_others_open: bool, age: Age) -> Self {
        let rows: Vec<Sample> = RATIOS.iter().filter_map(with_ratio).collect();
        let own = [Gas::O2, Gas::N2].into_iter().fold(Sample::new(), |sample, gas| {
            known.concentration(gas).map_or(sample, |of| sample.with(gas, of))
        });
        let is_known = status(&own, &[(Gas::H2, 0.0)], age).is_some();
        let possible = if is_known { vec![own] } else { rows.clone() };
        let gases: Vec<(Gas, f64)> =
            GASES.into_iter().filter_map(|gas| Some((gas, known.ppm(gas)?))).collect();
        let of = |row: &Sample| status(row, &gases, age).unwrap_or(Status::One);
        let least = possible.iter().map(of).min().unwrap_or(Status::One);
        let most = match are_others_open {
            true => Status::Three,
            false => possible.iter().map(of).max().unwrap_or(Status::Three),
        };
        let is_above = |gas: &(Gas, f64)| {
            let is_in = |row| status(row, &[*gas], age).is_some_and(|of| of > Status::One);
            possible.iter().any(is_in)
        };
        let above = gases.iter().filter(|gas| is_above(gas)).map(|(gas, _)| *gas).collect();
        let is_abnormal = |row: &Sample| of(row) > Status::One;
        let needs_ratio = rows.iter().any(is_abnormal) && !rows.iter().all(is_abnormal);
        Self { least, most, above, needs_ratio }
    }
}

fn with_ratio([o2, n2]: &[f64; 2]) -> Option<Sample> {
    let of = |ppm: f64| Concentration::measured(ppm).ok();
    Some(Sample::new().with(Gas::O2, of(*o2)?).with(Gas::N2, of(*n2)?))
}

/// Status of these gases in the row of the tables that a sample of O2 and N2 says.
fn status(row: &Sample, gases: &[(Gas, f64)], age: Age) -> Option<Status> {
    let add = |sample: Sample, (gas, ppm): &(Gas, f64)| {
        Some(sample.with(*gas, Concentration::measured(*ppm).ok()?))
    };
    c57_104::status(&gases.iter().try_fold(*row, add)?, age)
}
