//! Conditions 1 to 4 of IEEE C57.104-2008, table 1, which many sites still report.

use crate::{Gas, Sample};

/// Upper ends of conditions 1, 2 and 3, ppm; what is above the last is condition 4.
const LIMITS: [(Gas, [f64; 3]); 7] = [
    (Gas::H2, [100.0, 700.0, 1800.0]),
    (Gas::Ch4, [120.0, 400.0, 1000.0]),
    (Gas::C2h6, [65.0, 100.0, 150.0]),
    (Gas::C2h4, [50.0, 100.0, 200.0]),
    (Gas::C2h2, [1.0, 9.0, 35.0]),
    (Gas::Co, [350.0, 570.0, 1400.0]),
    (Gas::Co2, [2500.0, 4000.0, 10_000.0]),
];
/// Upper ends of the conditions of the sum of all combustible gases, ppm: the gases above but CO2.
const TOTAL: [f64; 3] = [720.0, 1920.0, 4630.0];

fn condition_of(ppm: f64, limits: [f64; 3]) -> u8 {
    1 + limits.iter().filter(|&&limit| ppm > limit).count() as u8
}

/// Returns the condition, 1 to 4, of one gas; `None` if it is absent or has no limits.
pub fn condition_of_gas(sample: &Sample, gas: Gas) -> Option<u8> {
    let (_, limits) = LIMITS.iter().find(|(other, _)| *other == gas)?;
    sample.ppm(gas).map(|ppm| condition_of(ppm, *limits))
}

/// Returns the condition, 1 to 4, by the total of dissolved combustible gases (TDCG); `None` if one
/// of them is absent.
pub fn condition_of_total(sample: &Sample) -> Option<u8> {
    let gases = [Gas::H2, Gas::Ch4, Gas::C2h6, Gas::C2h4, Gas::C2h2, Gas::Co];
    let total = sample.all(gases)?.iter().sum();
    Some(condition_of(total, TOTAL))
}

/// Returns the condition of a sample, 1 to 4: the worst of its gases and their total. `None` if no
/// gas with limits was measured.
pub fn condition(sample: &Sample) -> Option<u8> {
    let gases = LIMITS.iter().filter_map(|(gas, _)| condition_of_gas(sample, *gas));
    gases.chain(condition_of_total(sample)).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Concentration;

    #[test]
    fn each_limit_from_both_sides() {
        for (gas, limits) in LIMITS {
            let at = |ppm: f64| {
                condition(&Sample::new().with(gas, Concentration::measured(ppm).unwrap())).unwrap()
            };
            for (step, limit) in (1..).zip(limits) {
                assert_eq!((at(limit), at(limit.next_up())), (step, step + 1), "{gas:?} {limit}");
            }
        }
    }

    #[test]
    fn the_total_counts_where_no_gas_does() {
        let sample = |h2: f64| {
            let five = Sample::of_five([h2, 120.0, 65.0, 50.0, 1.0]).unwrap();
            five.with(Gas::Co, Concentration::measured(350.0).unwrap())
        };
        assert_eq!(
            (condition(&sample(100.0)), condition_of_total(&sample(100.0))),
            (Some(1), Some(1))
        );
        assert_eq!(condition_of_total(&sample(134.0)), Some(1));
        assert_eq!(condition_of_total(&sample(134.5)), Some(2));
        assert_eq!(condition(&Sample::new()), None);
        assert_eq!(condition_of_total(&Sample::of_five([1.0; 5]).unwrap()), None);
    }
}
