//! Lists of indices by rows, as compressed sparse rows.

/// Lists of indices, each sorted and without repetition.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    offsets: Vec<u32>,
    items: Vec<usize>,
}

impl Rows {
    /// Collects pairs of a row and an index.
    pub fn new(rows: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut pairs: Vec<(usize, usize)> = pairs.collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut offsets = vec![0_u32; rows + 1];
        for (row, _) in &pairs {
            offsets[row + 1] += 1;
        }
        for row in 0..rows {
            offsets[row + 1] += offsets[row];
        }
        Self { offsets, items: pairs.into_iter().map(|(_, item)| item).collect() }
    }

    /// Indices of a row.
    pub fn row(&self, row: usize) -> &[usize] {
        &self.items[self.offsets[row] as usize..self.offsets[row + 1] as usize]
    }
}
