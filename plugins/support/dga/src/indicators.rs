//! Indicator ratios that hint at one cause each, beside the methods that name faults.
//!
//! They mean most for what has formed between two samples: give the increments as a sample.

use crate::{Gas, Ratio, Sample};

/// Hint at one cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Indicator {
    /// CO2/CO below 3: a fault with paper in it (IEC 60599:2015, 5.5).
    PaperFault,
    /// CO2/CO above 7: paper ages (DL/T 722-2014, 10.2.3.1).
    PaperAgeing,
    /// C2H2/H2 above 2: gas of a tap changer; IEC 60599:2015, 5.4, has 2 to 3.
    TapChanger,
    /// O2/N2 below 0.3: oxygen is used up (IEC 60599:2015, 5.6).
    OxygenConsumption,
}

/// Returns the hints of a sample, in the order of [`Indicator`]. Ratios whose gases are absent or
/// both 0 give none.
pub fn indicators(sample: &Sample) -> Vec<Indicator> {
    let ratio = |gases| sample.all(gases).map(|[above, below]| Ratio::new(above, below));
    let (paper, oxygen) = (ratio([Gas::Co2, Gas::Co]), ratio([Gas::O2, Gas::N2]));
    let tap_changer = ratio([Gas::C2h2, Gas::H2]);
    let is_less = |ratio: Option<Ratio>, limit| ratio.is_some_and(|ratio| ratio.is_less(limit));
    let is_more = |ratio: Option<Ratio>, limit| ratio.is_some_and(|ratio| ratio.is_more(limit));
    [
        (is_less(paper, 3.0), Indicator::PaperFault),
        (is_more(paper, 7.0), Indicator::PaperAgeing),
        (is_more(tap_changer, 2.0), Indicator::TapChanger),
        (is_less(oxygen, 0.3), Indicator::OxygenConsumption),
    ]
    .into_iter()
    .filter_map(|(holds, indicator)| holds.then_some(indicator))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Concentration;

    fn found(gases: &[(Gas, f64)]) -> Vec<Indicator> {
        let of = |ppm| Concentration::measured(ppm).unwrap();
        indicators(
            &gases.iter().fold(Sample::new(), |sample, &(gas, ppm)| sample.with(gas, of(ppm))),
        )
    }

    #[test]
    fn each_limit_from_both_sides() {
        let paper = |co2| found(&[(Gas::Co2, co2), (Gas::Co, 100.0)]);
        assert_eq!(paper(299.0), [Indicator::PaperFault]);
        assert_eq!((paper(300.0), paper(700.0)), (vec![], vec![]));
        assert_eq!(paper(701.0), [Indicator::PaperAgeing]);
        let tap_changer = |c2h2| found(&[(Gas::C2h2, c2h2), (Gas::H2, 10.0)]);
        assert_eq!((tap_changer(20.0), tap_changer(20.1)), (vec![], vec![Indicator::TapChanger]));
        let oxygen = |o2| found(&[(Gas::O2, o2), (Gas::N2, 10.0)]);
        assert_eq!((oxygen(3.0), oxygen(2.9)), (vec![], vec![Indicator::OxygenConsumption]));
        assert_eq!(found(&[(Gas::O2, 0.0), (Gas::N2, 0.0), (Gas::Co, 5.0)]), []);
    }
}
