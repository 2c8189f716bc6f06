//! Priority queue (binary heap) of vertices whose costs change.

/// Children of a node: a flat heap touches fewer cache lines.
const ARITY: usize = 4;
/// Not in the queue.
const ABSENT: u32 = u32::MAX;

/// A min-heap that knows where each vertex stands; a vertex is in it once.
///
/// An entry is one word: the upper half of the cost's bits (20 bits of
/// mantissa), then the vertex's place in an order. So equal costs go by that.
#[derive(Default)]
pub(crate) struct Queue {
    heap: Vec<u64>,
    places: Vec<u32>,
    /// Vertices in the order in which those of equal cost go; empty: by index.
    order: Vec<u32>,
    /// Place of each vertex in the order; empty: by index.
    places_in_order: Vec<u32>,
}

impl Queue {
    /// Empties the queue and makes it ready for vertices `0..count`. Those of equal cost go in
    /// `order`, which has each once; by index where it is empty.
    pub(crate) fn reset(&mut self, count: usize, order: Vec<u32>) {
        self.order = order;
        self.places_in_order.clear();
        self.places_in_order.resize(self.order.len(), 0);
        for (&vertex, place) in self.order.iter().zip(0..) {
            self.places_in_order[vertex as usize] = place;
        }
        self.heap.clear();
        self.places.clear();
        self.places.resize(count, ABSENT);
    }

    /// Puts a vertex in, or moves it. `cost` is at least 0.
    #[inline]
    pub(crate) fn set(&mut self, vertex: u32, cost: f64) {
        let vertex = self.key(vertex);
        let entry = entry_of(vertex, cost);
        let place = self.places[vertex as usize];
        if place == ABSENT {
            self.heap.push(entry);
            self.rise(self.heap.len() - 1, entry);
        } else if entry < self.heap[place as usize] {
            self.rise(place as usize, entry);
        } else {
            self.sink(place as usize, entry);
        }
    }

    /// Takes a vertex out if it is in.
    pub(crate) fn remove(&mut self, vertex: u32) {
        let vertex = self.key(vertex);
        let place = std::mem::replace(&mut self.places[vertex as usize], ABSENT);
        if place != ABSENT {
            self.fill(place as usize);
        }
    }

    /// Takes the cheapest vertex out.
    pub(crate) fn pop(&mut self) -> Option<u32> {
        let vertex = *self.heap.first()? as u32;
        self.places[vertex as usize] = ABSENT;
        self.fill(0);
        Some(self.order.get(vertex as usize).copied().unwrap_or(vertex))
    }

    /// Number that stands for a vertex in the entries.
    #[inline]
    fn key(&self, vertex: u32) -> u32 {
        self.places_in_order.get(vertex as usize).copied().unwrap_or(vertex)
    }

    /// Returns the cost of the cheapest vertex, rounded down; infinite if there is none.
    #[inline]
    pub(crate) fn least_cost(&self) -> f64 {
        self.heap.first().map_or(f64::INFINITY, |entry| f64::from_bits(entry >> 32 << 32))
    }

    /// Reports whether a vertex is in the queue.
    #[inline]
    pub(crate) fn contains(&self, vertex: u32) -> bool {
        self.places[self.key(vertex) as usize] != ABSENT
    }

    /// Returns the cost of a queued vertex, rounded down.
    #[inline]
    pub(crate) fn cost(&self, vertex: u32) -> Option<f64> {
        let entry = self.heap.get(self.places[self.key(vertex) as usize] as usize)?;
        Some(f64::from_bits(entry >> 32 << 32))
    }

    /// Moves the last entry into a hole.
    fn fill(&mut self, hole: usize) {
        let Some(last) = self.heap.pop() else { return };
        if hole == self.heap.len() {
            return;
        }
        if hole > 0 && last < self.heap[(hole - 1) / ARITY] {
            self.rise(hole, last);
        } else {
            self.sink(hole, last);
        }
    }

    fn rise(&mut self, mut place: usize, entry: u64) {
        while place > 0 {
            let parent = (place - 1) / ARITY;
            if self.heap[parent] <= entry {
                break;
            }
            self.put(place, self.heap[parent]);
            place = parent;
        }
        self.put(place, entry);
    }

    fn sink(&mut self, mut place: usize, entry: u64) {
        loop {
            let first = place * ARITY + 1;
            let children = first..(first + ARITY).min(self.heap.len());
            let Some(least) = children.min_by_key(|&child| self.heap[child]) else { break };
            if self.heap[least] >= entry {
                break;
            }
            self.put(place, self.heap[least]);
            place = least;
        }
        self.put(place, entry);
    }

    #[inline]
    fn put(&mut self, place: usize, entry: u64) {
        self.heap[place] = entry;
        self.places[entry as u32 as usize] = place as u32;
    }
}

fn entry_of(vertex: u32, cost: f64) -> u64 {
    (cost.to_bits() >> 32) << 32 | u64::from(vertex)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The cheapest comes first after any sets, moves and removals.
        #[test]
        fn the_cheapest_comes_first(
            steps in prop::collection::vec((0_u32..20, 0_u8..200, any::<bool>()), 0..200),
        ) {
            let mut queue = Queue::default();
            queue.reset(20, Vec::new());
            let mut model = std::collections::BTreeMap::new();
            for (vertex, cost, keep) in steps {
                if keep {
                    queue.set(vertex, f64::from(cost));
                    model.insert(vertex, cost);
                } else {
                    queue.remove(vertex);
                    model.remove(&vertex);
                }
            }
            let mut expected: Vec<(u8, u32)> = model.iter().map(|(&v, &c)| (c, v)).collect();
            expected.sort_unstable();
            for (cost, vertex) in expected {
                prop_assert_eq!(queue.least_cost(), f64::from(cost));
                prop_assert_eq!(queue.pop(), Some(vertex));
            }
            prop_assert_eq!(queue.pop(), None);
        }
    }
}
