//! Common geometry of Duval's triangles.

use crate::plane::{self, Point};
use crate::verdict::NO_INPUT;
use crate::{Gas, Margin, Sample, Verdict, Zone};

/// Shares of three gases, percent: they sum up to 100.
pub(crate) type Shares = [f64; 3];
/// Straight border between two zones, from one point to another.
pub(crate) type Border = [Shares; 2];

/// Duval triangle: gases, zones, borders.
pub(crate) struct Triangle {
    /// Gases whose shares are the triangle's coordinates.
    pub(crate) gases: [Gas; 3],
    /// Function that returns the zone of a point, and the rule that gives it.
    pub(crate) judge: fn(Shares) -> (Zone, &'static str),
    /// Borders between the zones.
    pub(crate) borders: &'static [Border],
    /// Publication of the triangle.
    pub(crate) source: &'static str,
}

impl Triangle {
    pub(crate) fn zone(&self, sample: &Sample) -> Zone {
        shares(sample, self.gases).map_or(Zone::NotApplicable, |shares| (self.judge)(shares).0)
    }

    pub(crate) fn diagnose(&self, sample: &Sample) -> Verdict {
        let (zone, rule, margin) = match shares(sample, self.gases) {
            None => (Zone::NotApplicable, NO_INPUT, None),
            Some(shares) => {
                let (zone, rule) = (self.judge)(shares);
                (zone, rule, Some(margin(shares, self.borders)))
            }
        };
        Verdict { zone, rule, margin, source: self.source }
    }
}

/// Computes the percentages of three gases; `None` if one is absent or all are 0.
pub(crate) fn shares(sample: &Sample, gases: [Gas; 3]) -> Option<Shares> {
    let ppm = sample.all(gases)?;
    let sum: f64 = ppm.iter().sum();
    // In this order a share that is a whole number comes out as one.
    (sum > 0.0).then(|| ppm.map(|ppm| 100.0 * ppm / sum))
}

/// Computes the position of shares in an equilateral triangle with sides of 100.
pub(crate) fn place([_, b, c]: Shares) -> Point {
    [b + c / 2.0, c * (3.0_f64.sqrt() / 2.0)]
}

/// Computes the distance to the nearest border, which is always one of the zone that the point is
/// in.
fn margin(shares: Shares, borders: &[Border]) -> Margin {
    let segments = borders.iter().map(|&[a, b]| [place(a), place(b)]);
    Margin::Distance(plane::nearest(place(shares), segments))
}

#[cfg(test)]
pub(crate) mod testing {
    use proptest::prelude::*;

    use super::*;

    /// Checks that borders are exactly where zones change. Beside the middle of each border there
    /// are two zones, and points with different zones are no nearer to each other than a border is
    /// to them.
    pub(crate) fn check_borders(triangle: &Triangle) {
        let (judge, borders) = (|shares| (triangle.judge)(shares).0, triangle.borders);
        for &[a, b] in borders {
            let along = std::array::from_fn::<_, 3, _>(|i| b[i] - a[i]);
            let middle: Shares = std::array::from_fn(|i| a[i] + along[i] * 0.47);
            // Across: perpendicular enough, and of sum 0.
            let across = [along[1] - along[2], along[2] - along[0], along[0] - along[1]];
            let length = across.iter().map(|x| x * x).sum::<f64>().sqrt();
            let beside =
                |by: f64| judge(std::array::from_fn(|i| middle[i] + across[i] / length * by));
            assert_ne!(beside(1e-6), beside(-1e-6), "{a:?} to {b:?}");
        }
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let point = (0.0..1.0_f64, 0.0..1.0_f64, -3.0..3.0_f64, -3.0..3.0_f64);
        let near = |(u, v, du, dv): (f64, f64, f64, f64)| {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let here = [100.0 * u, 100.0 * v, 100.0 * (1.0 - u - v)];
            let there = [here[0] + du, here[1] + dv, here[2] - du - dv];
            let inside = there.iter().all(|share| *share >= 0.0);
            if inside && judge(here) != judge(there) {
                let (a, b) = (place(here), place(there));
                let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
                let Margin::Distance(margin) = margin(here, borders) else { unreachable!() };
                prop_assert!(margin <= apart + 1e-9, "{here:?} {there:?}: {margin} {apart}");
            }
            Ok(())
        };
        for _ in 0..40 {
            runner.run(&point, near).unwrap();
        }
    }
}
