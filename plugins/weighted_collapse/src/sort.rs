//! Edges in ascending order of weight.

use std::ops::Range;

use crate::threads;

/// Bits of a key that one pass of the radix sort looks at.
const DIGIT_BITS: u32 = 8;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Passes over a key of 32 bits.
const PASSES: usize = (u32::BITS / DIGIT_BITS) as usize;

/// Weights as integers that never order two weights wrongly, but may call
/// different ones equal: the upper bits of what lies between the least weight
/// and each.
#[derive(Clone, Copy)]
struct Keys {
    least_bits: u64,
    shift: u32,
}

impl Keys {
    /// For finite weights that are not negative: their bits, as integers, have
    /// their order.
    fn of(weights: &[f64]) -> Self {
        let bits = || weights.iter().map(|w| w.to_bits());
        let (least_bits, most_bits) = (bits().min().unwrap_or(0), bits().max().unwrap_or(0));
        let used_bits = u64::BITS - (most_bits - least_bits).leading_zeros();
        Self { least_bits, shift: used_bits.saturating_sub(u32::BITS) }
    }

    fn key(self, weight: f64) -> u32 {
        ((weight.to_bits() - self.least_bits) >> self.shift) as u32
    }
}

/// A key with its edge; the key decides.
type Pair = (u32, u32);

/// Edge indices in ascending order of (W, edge index). The order of edges is
/// that of (smaller, larger) vertex index.
pub(crate) fn sort(weights: &[f64], threads: usize) -> Vec<u32> {
    let keys = Keys::of(weights);
    let ranges = equal_parts(weights, keys, threads);
    let parts =
        threads::map(ranges, threads, |(range, count)| sort_range(weights, keys, range, count));
    let mut parts = parts.into_iter();
    let mut sorted = parts.next().unwrap_or_default();
    parts.for_each(|part| sorted.extend(part));
    sorted
}

/// Each edge's place in a sorted list of them.
pub(crate) fn ranks(sorted: &[u32]) -> Vec<u32> {
    let mut ranks = vec![0; sorted.len()];
    for (rank, &edge) in (0..).zip(sorted) {
        ranks[edge as usize] = rank;
    }
    ranks
}

/// Ranges of keys with about the same number of edges, covering all, and how
/// many each has.
fn equal_parts(weights: &[f64], keys: Keys, parts: usize) -> Vec<(Range<u64>, usize)> {
    let end = 1 << 32;
    if parts == 1 {
        return vec![(0..end, weights.len())];
    }
    let shift = 32 - DIGIT_BITS;
    let mut counts = vec![0_usize; DIGITS];
    weights.iter().for_each(|&w| counts[(keys.key(w) >> shift) as usize] += 1);
    let (mut ranges, mut first, mut count, mut total) = (Vec::new(), 0, 0, 0);
    for (digit, digit_count) in counts.into_iter().enumerate() {
        count += digit_count;
        total += digit_count;
        let next = (digit as u64 + 1) << shift;
        let full = count > 0 && total * parts >= weights.len() * (ranges.len() + 1);
        if next == end || full {
            ranges.push((first..next, count));
            (first, count) = (next, 0);
        }
    }
    ranges
}

fn sort_range(weights: &[f64], keys: Keys, range: Range<u64>, count: usize) -> Vec<u32> {
    let mut pairs: Vec<Pair> = Vec::with_capacity(count);
    let mut counts = [[0_u32; DIGITS]; PASSES];
    for (edge, &weight) in weights.iter().enumerate() {
        let key = keys.key(weight);
        if range.contains(&u64::from(key)) {
            for (pass, counts) in counts.iter_mut().enumerate() {
                counts[digit(key, pass)] += 1;
            }
            pairs.push((key, edge as u32));
        }
    }
    let mut other = vec![(0, 0); pairs.len()];
    for (pass, counts) in counts.into_iter().enumerate() {
        // A pass in which all keys are alike moves nothing.
        if pairs.first().is_some_and(|p| counts[digit(p.0, pass)] as usize == pairs.len()) {
            continue;
        }
        scatter(&pairs, &mut other, pass, counts);
        std::mem::swap(&mut pairs, &mut other);
    }
    sort_within_keys(&mut pairs, weights);
    pairs.into_iter().map(|pair| pair.1).collect()
}

fn digit(key: u32, pass: usize) -> usize {
    (key >> (pass as u32 * DIGIT_BITS)) as usize % DIGITS
}

/// Moves pairs to the place of their digit, equal ones in the order they are.
fn scatter(from: &[Pair], to: &mut [Pair], pass: usize, counts: [u32; DIGITS]) {
    let mut next = counts;
    let mut total = 0;
    for slot in &mut next {
        total += std::mem::replace(slot, total);
    }
    for &pair in from {
        let slot = &mut next[digit(pair.0, pass)];
        to[*slot as usize] = pair;
        *slot += 1;
    }
}

/// Pairs of one key stand in edge order; puts those right whose weights differ.
fn sort_within_keys(pairs: &mut [Pair], weights: &[f64]) {
    let weight = |pair: &Pair| weights[pair.1 as usize];
    for run in pairs.chunk_by_mut(|a, b| a.0 == b.0) {
        if run.len() > 1 {
            run.sort_by(|a, b| weight(a).total_cmp(&weight(b)));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_weights_keep_edge_order() {
        assert_eq!(sort(&[1.0, 0.5, 1.0, 0.5], 1), [1, 3, 0, 2]);
        assert!(sort(&[], 1).is_empty());
        assert_eq!(sort(&[0.0; 3], 2), [0, 1, 2]);
    }

    #[test]
    fn ranks_are_places() {
        assert_eq!(ranks(&[2, 0, 1]), [1, 2, 0]);
    }

    proptest! {
        /// Wide and narrow spreads, many ties, an outlier that flattens all
        /// other keys: always the order of a stable sort.
        #[test]
        fn any_weights_are_sorted_as_by_comparison(
            seeds in prop::collection::vec(any::<u32>(), 0..3000),
            spread in 0..4,
            threads in 1_usize..5,
        ) {
            let weights: Vec<f64> = seeds
                .iter()
                .map(|&seed| match spread {
                    0 => f64::from(seed % 50) / 7.0,
                    1 => 1.0 + f64::from(seed % 1000) * 1e-13,
                    2 => f64::from(seed % 40 - seed % 20).exp(),
                    _ if seed % 97 == 0 => 1e300,
                    _ => f64::from(seed) * 1e-20,
                })
                .collect();
            let mut expected: Vec<u32> = (0..weights.len() as u32).collect();
            expected.sort_by(|&a, &b| weights[a as usize].total_cmp(&weights[b as usize]));
            prop_assert_eq!(sort(&weights, threads), expected);
        }
    }
}
