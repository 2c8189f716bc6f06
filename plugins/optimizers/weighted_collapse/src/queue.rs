//! Priority queue of edges in buckets, the least key first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Edges of a bucket to begin with; more if their keys are equal.
const EDGES_A_BUCKET: usize = 1024;
/// Entries per initial edge beyond which outdated ones are swept out. Each edge has at most one
/// current entry.
const MAX_ENTRIES_AN_EDGE: usize = 2;

/// A priority queue of edges. An entry is outdated, and skipped, as soon as an
/// end of its edge is renewed.
///
/// One heap of all entries would be slow to reach into: only those of the
/// buckets up to the one under work are in a heap, the others wait unsorted.
pub(crate) struct Queue {
    /// Entries of the opened buckets, and those pushed below them.
    heap: BinaryHeap<Reverse<Entry>>,
    /// Ascending by key; no key is in two.
    buckets: Vec<Bucket>,
    opened: usize,
    /// Version of each vertex, counted up at each renewal.
    versions: Vec<u32>,
    len: usize,
    max_len: usize,
}

struct Bucket {
    least_key: u64,
    entries: Vec<Entry>,
}

/// An edge in the queue. Equal keys are ordered by (smaller, larger) vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Entry {
    /// Sort key; the least is first.
    pub(crate) key: u64,
    /// The ends, the smaller index first.
    pub(crate) ends: [u32; 2],
    /// The sum of the ends' versions, which never decrease.
    stamp: u32,
}

impl Queue {
    /// Makes a queue over vertices with the initial edges, keys ascending.
    pub(crate) fn new(vertices: usize, edges: impl Iterator<Item = (u64, [u32; 2])>) -> Self {
        let mut buckets: Vec<Bucket> = Vec::new();
        let mut len = 0;
        for (key, ends) in edges {
            let entry = Entry { key, ends, stamp: 0 };
            match buckets.last_mut() {
                Some(bucket) if bucket.takes(key) => bucket.entries.push(entry),
                _ => buckets.push(Bucket { least_key: key, entries: vec![entry] }),
            }
            len += 1;
        }
        let max_len = len * MAX_ENTRIES_AN_EDGE;
        let versions = vec![0; vertices];
        Self { heap: BinaryHeap::new(), buckets, opened: 0, versions, len, max_len }
    }

    /// Adds an edge that is not in the queue, or whose entry is outdated.
    pub(crate) fn push(&mut self, key: u64, a: u32, b: u32) {
        if self.len >= self.max_len {
            self.sweep();
        }
        let ends = [a.min(b), a.max(b)];
        let entry = Entry { key, ends, stamp: stamp(&self.versions, ends) };
        let bucket = self.buckets.partition_point(|bucket| bucket.least_key <= key);
        if bucket <= self.opened {
            self.heap.push(Reverse(entry));
        } else {
            self.buckets[bucket - 1].entries.push(entry);
        }
        self.len += 1;
    }

    /// Takes the least edge.
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        loop {
            while let Some(Reverse(entry)) = self.heap.pop() {
                self.len -= 1;
                if entry.is_current(&self.versions) {
                    return Some(entry);
                }
            }
            let bucket = self.buckets.get_mut(self.opened)?;
            self.opened += 1;
            let entries = std::mem::take(&mut bucket.entries);
            self.heap = entries.into_iter().map(Reverse).collect();
        }
    }

    /// Outdates all entries of edges at a vertex.
    pub(crate) fn renew(&mut self, vertex: u32) {
        let version = &mut self.versions[vertex as usize];
        *version = version.wrapping_add(1);
    }

    fn sweep(&mut self) {
        let versions = &self.versions;
        self.heap.retain(|entry| entry.0.is_current(versions));
        self.len = self.heap.len();
        for bucket in &mut self.buckets[self.opened..] {
            bucket.entries.retain(|entry| entry.is_current(versions));
            self.len += bucket.entries.len();
        }
    }
}

impl Bucket {
    fn takes(&self, key: u64) -> bool {
        let last_key = self.entries.last().map(|entry| entry.key);
        self.entries.len() < EDGES_A_BUCKET || last_key == Some(key)
    }
}

impl Entry {
    fn is_current(&self, versions: &[u32]) -> bool {
        self.stamp == stamp(versions, self.ends)
    }
}

fn stamp(versions: &[u32], [a, b]: [u32; 2]) -> u32 {
    versions[a as usize].wrapping_add(versions[b as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pop_all(queue: &mut Queue) -> Vec<(u64, [u32; 2])> {
        std::iter::from_fn(|| queue.pop()).map(|entry| (entry.key, entry.ends)).collect()
    }

    #[test]
    fn the_least_comes_first_and_ties_go_by_vertex() {
        let mut queue = Queue::new(4, [(3, [0, 2]), (4, [0, 3])].into_iter());
        queue.push(5, 1, 0);
        queue.push(3, 2, 1);
        queue.push(2, 1, 3);
        let sorted = [(2, [1, 3]), (3, [0, 2]), (3, [1, 2]), (4, [0, 3]), (5, [0, 1])];
        assert_eq!(pop_all(&mut queue), sorted);
    }

    /// Many buckets, with keys that many edges share, pushed into while it is
    /// emptied: never out of order.
    #[test]
    fn buckets_do_not_show() {
        let count = 20 * EDGES_A_BUCKET as u32;
        let key = |i: u32| u64::from(i / 700);
        let mut queue = Queue::new(count as usize + 1, (0..count).map(|i| (key(i), [i, count])));
        assert!(queue.buckets.len() > 10);
        let mut expected: BinaryHeap<_> =
            (0..count).map(|i| Reverse((key(i), [i, count]))).collect();
        let mut seed = 1_u32;
        while let Some(Reverse(least)) = expected.pop() {
            let entry = queue.pop().unwrap();
            assert_eq!((entry.key, entry.ends), least);
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if seed >> 30 == 0 {
                let again = key(seed % count);
                queue.push(again, least.1[0], count);
                expected.push(Reverse((again, least.1)));
            }
        }
        assert_eq!(queue.pop(), None);
    }

    #[test]
    fn entries_of_a_renewed_vertex_are_skipped() {
        let mut queue = Queue::new(4, [(1, [0, 1]), (2, [1, 2]), (3, [2, 3])].into_iter());
        queue.renew(1);
        queue.push(9, 2, 1);
        assert_eq!(pop_all(&mut queue), [(3, [2, 3]), (9, [1, 2])]);
    }

    #[test]
    fn outdated_entries_do_not_pile_up() {
        let mut queue = Queue::new(3, [(1, [0, 1]), (2, [1, 2])].into_iter());
        for key in 10..1000 {
            queue.renew(1);
            queue.push(key, 0, 1);
            queue.push(key, 1, 2);
            let waiting = queue.buckets.iter().map(|bucket| bucket.entries.len()).sum::<usize>();
            assert!(queue.heap.len() + waiting <= 2 * MAX_ENTRIES_AN_EDGE);
        }
        assert_eq!(pop_all(&mut queue), [(999, [0, 1]), (999, [1, 2])]);
    }
}
