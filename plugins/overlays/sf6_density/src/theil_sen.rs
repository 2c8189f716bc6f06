//! Theil-Sen slope with the confidence bounds of Sen (P. K. Sen, J. Am. Stat. Assoc. 63,
//! 1968, 1379): the median of the slopes between all pairs of points.

/// Two-sided 95 % quantile of the normal distribution.
const QUANTILE: f64 = 1.96;

/// Slope with its 95 % bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slope {
    pub(crate) median: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Estimates the slope that segments of points `[x, y]` have in common. Pairs are taken
/// within segments; `None` where none has two points of different `x`.
pub(crate) fn estimate_slope(segments: &[Vec<[f64; 2]>]) -> Option<Slope> {
    let mut slopes = Vec::new();
    let mut variance = 0.0;
    for points in segments {
        for (index, [x, y]) in points.iter().enumerate() {
            let later = points[index + 1..].iter().filter(|[later, _]| later > x);
            slopes.extend(later.map(|[later, above]| (above - y) / (later - x)));
        }
        let count = points.len() as f64;
        variance += count * (count - 1.0) * (2.0 * count + 5.0) / 18.0;
    }
    slopes.sort_by(f64::total_cmp);
    let last = slopes.len().checked_sub(1)?;
    let half_width = 0.5 * QUANTILE * variance.sqrt();
    let middle = 0.5 * slopes.len() as f64;
    // Casts saturate at 0.
    let low = (middle - half_width).floor() as usize;
    let high = ((middle + half_width).ceil() as usize).min(last);
    Some(Slope { median: median(&slopes)?, low: slopes[low.min(last)], high: slopes[high] })
}

/// Median of sorted numbers.
fn median(sorted: &[f64]) -> Option<f64> {
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

/// Median of numbers in any order.
pub(crate) fn median_of(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    median(&numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_outliers_does_not_move_the_slope() {
        let points: Vec<_> = (0..30)
            .map(|x| [f64::from(x), if x % 4 == 1 { 900.0 } else { 3.0 - 2.0 * f64::from(x) }])
            .collect();
        let Slope { median, low, high } = estimate_slope(&[points]).expect("a slope");
        assert!((median + 2.0).abs() < 1e-9, "{median}");
        assert!(low <= median && median <= high);
    }

    #[test]
    fn bounds_enclose_the_slope_that_noise_hides() {
        // Deterministic noise, ten times as large as the slope.
        let noise = |x: i32| f64::from(x * 7919 % 101) / 50.5 - 1.0;
        let points: Vec<_> =
            (0..40).map(|x| [f64::from(x), 0.1 * f64::from(x) + noise(x)]).collect();
        let Slope { low, high, .. } = estimate_slope(&[points]).expect("a slope");
        assert!(low < 0.1 && 0.1 < high && high - low < 0.1, "{low} {high}");
        assert_eq!(estimate_slope(&[vec![[1.0, 2.0]], vec![[3.0, 9.0]]]), None);
    }
}
