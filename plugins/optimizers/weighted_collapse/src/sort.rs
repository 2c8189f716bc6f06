//! Radix sort of edges by ascending weight.

use busbar_plugin_sdk::on_huge_pages;

/// Bits of a key that one pass of the radix sort looks at.
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Passes over a key of 32 bits.
const PASSES: usize = u32::BITS.div_ceil(DIGIT_BITS) as usize;
/// Least size of a partition: as much as the cache next to a core holds.
pub(crate) const PART: usize = 1 << 16;

/// Weights as integer keys: the upper bits of the difference to the least weight. Keys never order
/// two weights wrongly, but may call different ones equal.
#[derive(Clone, Copy)]
struct SortKeys {
    least_bits: u64,
    shift: u32,
}

impl SortKeys {
    /// Makes keys of finite weights that are not negative: their bits, as integers, have their
    /// order.
    fn new(weights: &[f64]) -> Self {
        let (least_bits, most_bits) = weights
            .iter()
            .map(|w| w.to_bits())
            .fold((u64::MAX, 0), |(least, most), bits| (least.min(bits), most.max(bits)));
        let least_bits = least_bits.min(most_bits);
        let used_bits = u64::BITS - (most_bits - least_bits).leading_zeros();
        Self { least_bits, shift: used_bits.saturating_sub(u32::BITS) }
    }

    fn key(self, weight: f64) -> u32 {
        ((weight.to_bits() - self.least_bits) >> self.shift) as u32
    }
}

/// A key with its edge; the key decides.
type Pair = (u32, u32);

/// Edges in parts: each edge of one part weighs less than any of the next.
pub(crate) struct KeyPartitions<'a> {
    weights: &'a [f64],
    pairs: Vec<Pair>,
    /// Start of each part, and the total.
    starts: Vec<usize>,
    spare: Vec<Pair>,
}

impl<'a> KeyPartitions<'a> {
    /// Parts of at least `size` edges, but for the last.
    pub(crate) fn new(weights: &'a [f64], size: usize) -> Self {
        let keys = SortKeys::new(weights);
        let mut next = [0_usize; DIGITS];
        weights.iter().for_each(|&weight| next[upper_digit(keys.key(weight))] += 1);
        let (mut starts, mut total) = (vec![0], 0);
        for slot in &mut next {
            if total - starts[starts.len() - 1] >= size {
                starts.push(total);
            }
            total += std::mem::replace(slot, total);
        }
        // All digits of a part share one place to write to.
        let mut part_of_digit = [0; DIGITS];
        for (part, &start) in part_of_digit.iter_mut().zip(&next) {
            *part = starts.partition_point(|&first| first <= start) - 1;
        }
        let mut write_at = starts.clone();
        let mut pairs = on_huge_pages(vec![(0, 0); weights.len()]);
        for (edge, &weight) in (0..).zip(weights) {
            let key = keys.key(weight);
            let at = &mut write_at[part_of_digit[upper_digit(key)]];
            pairs[*at] = (key, edge);
            *at += 1;
        }
        starts.push(total);
        Self { weights, pairs, starts, spare: Vec::new() }
    }

    /// Returns the number of parts.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Sorts the wanted edges of a partition by (W, edge index). To be called once a partition:
    /// other edges are lost.
    pub(crate) fn sort(
        &mut self,
        part: usize,
        mut is_wanted: impl FnMut(u32) -> bool,
    ) -> impl Iterator<Item = u32> {
        let pairs = &mut self.pairs[self.starts[part]..self.starts[part + 1]];
        let mut wanted = 0;
        for index in 0..pairs.len() {
            let pair = pairs[index];
            pairs[wanted] = pair;
            wanted += usize::from(is_wanted(pair.1));
        }
        let pairs = &mut pairs[..wanted];
        self.spare.resize(wanted.max(self.spare.len()), (0, 0));
        let spare = &mut self.spare[..wanted];
        sort_by_key(pairs, spare);
        sort_within_keys(pairs, spare, self.weights);
        pairs.iter().map(|pair| pair.1)
    }
}

/// Returns edge indices in ascending order of (W, edge index). The order of edges is that of
/// (smaller, larger) vertex index.
pub(crate) fn sort(weights: &[f64]) -> Vec<u32> {
    let mut parts = KeyPartitions::new(weights, PART);
    let mut sorted = Vec::with_capacity(weights.len());
    for part in 0..parts.len() {
        sorted.extend(parts.sort(part, |_| true));
    }
    sorted
}

/// Sorts pairs by radix sort; `spare` is as long as `pairs`.
fn sort_by_key(pairs: &mut [Pair], spare: &mut [Pair]) {
    let mut counts = [[0_u32; DIGITS]; PASSES];
    for &(key, _) in pairs.iter() {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(key, pass)] += 1;
        }
    }
    let (mut from, mut to) = (pairs, spare);
    let mut is_swapped = false;
    for (pass, counts) in counts.into_iter().enumerate() {
        // A pass in which all keys are alike moves nothing.
        if from.first().is_some_and(|p| counts[digit(p.0, pass)] as usize == from.len()) {
            continue;
        }
        scatter(from, to, pass, counts);
        std::mem::swap(&mut from, &mut to);
        is_swapped = !is_swapped;
    }
    if is_swapped {
        to.copy_from_slice(from);
    }
}

/// Returns the digit that decides the partition.
fn upper_digit(key: u32) -> usize {
    (key >> (u32::BITS - DIGIT_BITS)) as usize
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
/// `spare` is as long as `pairs`, and gets the weights in their order: lookups
/// wait for memory, and so they wait together.
fn sort_within_keys(pairs: &mut [Pair], spare: &mut [Pair], weights: &[f64]) {
    for (weight, &(_, edge)) in spare.iter_mut().zip(pairs.iter()) {
        let bits = weights[edge as usize].to_bits();
        *weight = ((bits >> 32) as u32, bits as u32);
    }
    let mut start = 0;
    for run in pairs.chunk_by_mut(|a, b| a.0 == b.0) {
        let weights_there = &spare[start..start + run.len()];
        start += run.len();
        if !weights_there.is_sorted() {
            run.sort_by(|a, b| weights[a.1 as usize].total_cmp(&weights[b.1 as usize]));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_weights_keep_edge_order() {
        assert_eq!(sort(&[1.0, 0.5, 1.0, 0.5]), [1, 3, 0, 2]);
        assert!(sort(&[]).is_empty());
        assert_eq!(sort(&[0.0; 3]), [0, 1, 2]);
    }

    proptest! {
        /// Wide and narrow spreads, many ties, an outlier that flattens all
        /// other keys: always the order of a stable sort.
        #[test]
        fn any_weights_are_sorted_as_by_comparison(
            seeds in prop::collection::vec(any::<u32>(), 0..3000),
            spread in 0..4,
            copies in prop::sample::select(vec![1, 70]),
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
            // Enough of them for several parts.
            let weights = weights.repeat(copies);
            let mut expected: Vec<u32> = (0..weights.len() as u32).collect();
            expected.sort_by(|&a, &b| weights[a as usize].total_cmp(&weights[b as usize]));
            prop_assert_eq!(sort(&weights), expected);
        }
    }
}
