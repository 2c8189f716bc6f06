//! Statistical moments: mean, deviation and maximum in one pass over fixed chunks.

/// Values summed at a time. Chunk sums are combined in order, so the result is the same for every
/// number of threads.
pub(crate) const CHUNK: usize = 1024;

/// Running sums that are added up side by side, for the processor's sake.
const LANES: usize = 4;

/// Statistical moments of a set of non-negative values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    count: f64,
    mean: f64,
    /// Sum of squared differences to the mean.
    squares: f64,
    /// The largest value; 0 for none.
    pub(crate) max: f64,
}

impl Moments {
    /// Computes the moments of one chunk: the mean first, so that the squares are of differences.
    pub(crate) fn from_values(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mean = fold(values, |sum, value| sum + value) / count;
        let squares = fold(values, |sum, value| sum + (value - mean) * (value - mean));
        let max = max(values);
        Self { count: values.len() as f64, mean, squares, max }
    }

    /// Combines the moments of two sets (Chan, Golub and LeVeque, 1979).
    pub(crate) fn combine(self, other: Self) -> Self {
        let count = self.count + other.count;
        if count == 0.0 {
            return self;
        }
        let difference = other.mean - self.mean;
        let share = other.count / count;
        Self {
            count,
            mean: self.mean + difference * share,
            squares: self.squares + other.squares + difference * difference * self.count * share,
            max: self.max.max(other.max),
        }
    }

    /// Returns the population standard deviation; the paper's sum "from i = 0 to n" is read as one
    /// over the n edges.
    pub(crate) fn deviation(&self) -> f64 {
        (self.squares / self.count.max(1.0)).sqrt()
    }
}

/// Folds each lane, and adds up the lanes.
fn fold(values: &[f64], step: impl Fn(f64, f64) -> f64) -> f64 {
    let (quads, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for quad in quads {
        lanes = std::array::from_fn(|lane| step(lanes[lane], quad[lane]));
    }
    lanes.iter().sum::<f64>() + rest.iter().fold(0.0, |sum, &value| step(sum, value))
}

/// Returns the largest value; 0 for none.
fn max(values: &[f64]) -> f64 {
    let larger = |a: f64, b: f64| if b > a { b } else { a };
    let (quads, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for quad in quads {
        lanes = std::array::from_fn(|lane| larger(lanes[lane], quad[lane]));
    }
    lanes.iter().chain(rest).fold(0.0, |max, &value| larger(max, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(values: &[f64], deviation: f64, max: f64) {
        for chunk in [1, 2, 3, 100] {
            let moments = values
                .chunks(chunk)
                .map(Moments::from_values)
                .fold(Moments::default(), Moments::combine);
            assert!((moments.deviation() - deviation).abs() < 1e-12, "{moments:?}");
            assert_eq!(moments.max, max);
        }
    }

    #[test]
    fn chunks_add_up() {
        check(&[], 0.0, 0.0);
        check(&[3.0], 0.0, 3.0);
        check(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0], 2.0, 9.0);
    }

    #[test]
    fn a_large_mean_costs_no_digits() {
        let values: Vec<f64> = (0..10_000).map(|i| 1e9 + f64::from(i % 2)).collect();
        let moments = values
            .chunks(CHUNK)
            .map(Moments::from_values)
            .fold(Moments::default(), Moments::combine);
        assert!((moments.deviation() - 0.5).abs() < 1e-9, "{moments:?}");
    }
}
