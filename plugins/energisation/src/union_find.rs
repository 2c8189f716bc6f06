//! Sets that grow together (R. E. Tarjan, "Efficiency of a good but not linear set union
//! algorithm", JACM 22, 1975): by size, with paths halved.

/// Which of the elements 0, 1 and so on belong together.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnionFind {
    parents: Vec<u32>,
    sizes: Vec<u32>,
}

impl UnionFind {
    /// Each of so many elements alone, in the room that is there.
    pub(crate) fn part(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count as u32);
        self.sizes.clear();
        self.sizes.resize(count, 1);
    }

    /// The element that stands for all that belong together with one.
    pub(crate) fn root(&mut self, element: usize) -> usize {
        let mut at = element;
        while self.parents[at] as usize != at {
            self.parents[at] = self.parents[self.parents[at] as usize];
            at = self.parents[at] as usize;
        }
        at
    }

    /// Puts two sets together.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return;
        }
        let (small, large) = if self.sizes[a] < self.sizes[b] { (a, b) } else { (b, a) };
        self.parents[small] = large as u32;
        self.sizes[large] += self.sizes[small];
    }
}
