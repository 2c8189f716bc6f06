//! Variance shares: contribution of each factor to the variance of W.

use busbar_plugin_sdk::{Error, Mesh};

use crate::interpretation::Interpretation;
use crate::weights::{MeasuredEdges, measure_all};
use crate::{check, edges, threads};

/// The share of each term of Eq. 10 in the variance of W over the edges of a
/// mesh: the covariance of the term with W, divided by the variance of W. The
/// shares add up to 1 and may be negative. All are 0 where W does not vary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VarianceShares {
    /// Share of the length L (Eq. 1).
    pub length: f64,
    /// Share of the border flag F (Eq. 2).
    pub flag: f64,
    /// Share of the area S (Eq. 3).
    pub area: f64,
    /// Share of the curvature C (Eq. 4).
    pub curvature: f64,
}

/// Computes the contributions of L, F, S and C to the variance of W.
///
/// # Errors
/// Returns the errors of [`collapse_list`](crate::collapse_list) for meshes that it refuses.
pub fn variance_shares(
    mesh: Mesh<'_>,
    interpretation: &Interpretation,
) -> Result<VarianceShares, Error> {
    check(&mesh)?;
    let threads = threads::count(mesh.triangles.len(), threads::MAX_THREADS);
    let edges = edges::find(&mesh, threads);
    let measured = measure_all(&mesh, &edges, interpretation, threads);
    let [length, flag, area, curvature] = shares(&measured, interpretation);
    Ok(VarianceShares { length, flag, area, curvature })
}

fn shares(measured: &MeasuredEdges, interpretation: &Interpretation) -> [f64; 4] {
    let coefficients = measured.coefficients(interpretation);
    let terms = || measured.terms(coefficients);
    let count = terms().count().max(1) as f64;
    let means = terms().fold([0.0; 4], add).map(|sum| sum / count);
    let covariances = terms().fold([0.0; 4], |sums, row| {
        let differences: [f64; 4] = std::array::from_fn(|i| row[i] - means[i]);
        let of_weight: f64 = differences.iter().sum();
        add(sums, differences.map(|difference| difference * of_weight))
    });
    let variance: f64 = covariances.iter().sum();
    if variance > 0.0 { covariances.map(|covariance| covariance / variance) } else { [0.0; 4] }
}

fn add(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| a[i] + b[i])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;
    use crate::reference::{interpretation, soup};

    /// Shares of a unit square of two triangles. Each term has one value on the four borders and
    /// another on the diagonal, so covariances go as the products of differences, and shares as
    /// differences.
    #[test]
    fn shares_of_the_square() {
        let positions = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        let mesh = Mesh { positions: &positions, triangles: &[[0, 1, 2], [0, 2, 3]], wedges: None };
        let found = variance_shares(mesh, &Interpretation::BUSBAR).unwrap();
        let step = PI * (1.0 - FRAC_1_SQRT_2);
        let (length, area) = (-0.4 * step * step, -0.4 * FRAC_PI_2 * FRAC_PI_2);
        let (flag, curvature) = (0.8 * PI, 0.4 * PI * PI);
        let total = length + flag + area + curvature;
        let expected = [length, flag, area, curvature].map(|difference| difference / total);
        let found = [found.length, found.flag, found.area, found.curvature];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        }
    }

    #[test]
    fn a_mesh_whose_edges_are_alike_has_no_shares() {
        let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
        for triangles in [&[][..], &[[0, 1, 2]]] {
            let mesh = Mesh { positions: &positions, triangles, wedges: None };
            let unprotected = variance_shares(mesh, &Interpretation::UNPROTECTED).unwrap();
            let sum = unprotected.flag + unprotected.area + unprotected.curvature;
            assert_eq!(sum, 0.0);
        }
    }

    proptest! {
        #[test]
        fn shares_add_up((positions, triangles) in soup(), interpretation in interpretation()) {
            let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
            let found = variance_shares(mesh, &interpretation).unwrap();
            let sum = found.length + found.flag + found.area + found.curvature;
            prop_assert!(found == VarianceShares::default() || (sum - 1.0).abs() < 1e-9, "{found:?}");
        }
    }
}
