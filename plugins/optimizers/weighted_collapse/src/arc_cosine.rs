//! Arc cosines of many numbers at once.
//!
//! `libm::acos` branches on the range of its argument, which a processor cannot predict on
//! a mesh with creases. Here all branches are computed for all arguments and the result is
//! selected, so that the loop is vectorized. The method, its constants and therefore every bit of the result are those of FreeBSD's
//! `e_acos.c` (Sun Microsystems, 1993), which `libm` follows.

/// pi / 2, its upper and its lower part.
const HALF_PI: [f64; 2] =
    [f64::from_bits(0x3ff9_21fb_5444_2d18), f64::from_bits(0x3c91_a626_3314_5c07)];
/// Numerator and denominator of (asin(x) - x) / x as a rational function of x^2.
const NUMERATOR: [f64; 6] = [
    0.166_666_666_666_666_66,
    -0.325_565_818_622_400_9,
    0.201_212_532_134_862_93,
    -0.040_055_534_500_679_41,
    0.000_791_534_994_289_814_5,
    3.479_331_075_960_212e-5,
];
const DENOMINATOR: [f64; 5] = [
    1.0,
    -2.403_394_911_734_414,
    2.020_945_760_233_505_7,
    -0.688_283_971_605_453_3,
    0.077_038_150_555_901_94,
];
/// The upper half of a double's bits.
const UPPER_HALF: u64 = 0xffff_ffff_0000_0000;

/// Turns cosines in [-1, 1] into their angles, radians in [0, pi].
pub(crate) fn angles(cosines: &mut [f64]) {
    cosines.iter_mut().for_each(|cosine| *cosine = angle(*cosine));
}

#[inline(always)]
fn angle(x: f64) -> f64 {
    let [upper, lower] = HALF_PI;
    let is_near_zero = x.abs() < 0.5;
    // Near one: acos(x) = 2 asin(sqrt((1 - x) / 2)), and pi less that for -x.
    let z = if is_near_zero { x * x } else { (1.0 - x.abs()) * 0.5 };
    let ratio = z * polynomial(&NUMERATOR, z) / polynomial(&DENOMINATOR, z);
    let root = z.sqrt();
    let near_zero = upper - (x - (lower - x * ratio));
    let near_minus_one = 2.0 * (upper - (root + (ratio * root - lower)));
    let root_above = f64::from_bits(root.to_bits() & UPPER_HALF);
    let root_rest = (z - root_above * root_above) / (root + root_above);
    let near_one = 2.0 * (root_above + (ratio * root + root_rest));
    let near_either = if x < 0.0 { near_minus_one } else { near_one };
    let angle = if is_near_zero { near_zero } else { near_either };
    // There, the rest of the root is 0 / 0.
    if x == 1.0 { 0.0 } else { angle }
}

/// Evaluates a polynomial whose coefficients ascend.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    coefficients[..N - 1].iter().rev().fold(coefficients[N - 1], |sum, c| c + x * sum)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[track_caller]
    fn check(cosine: f64) {
        let mut angle = [cosine];
        angles(&mut angle);
        assert_eq!(angle[0].to_bits(), libm::acos(cosine).to_bits(), "{cosine}");
    }

    #[test]
    fn ends_and_borders_are_those_of_libm() {
        let near = |x: f64| [x, x.next_up(), x.next_down()];
        for cosine in [-1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 1e-300, 1e-17].into_iter().flat_map(near) {
            if cosine.abs() <= 1.0 {
                check(cosine);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn any_angle_is_that_of_libm(cosine in -1.0..1.0_f64, close in 0.0..1e-9_f64) {
            [cosine, 1.0 - close, close - 1.0, close].into_iter().for_each(check);
        }
    }
}
