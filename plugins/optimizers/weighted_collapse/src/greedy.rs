//! Orders that look at the mesh as it is when an edge's turn comes.

use busbar_plugin_sdk::{Collapse, Error, Mesh, Progress};

use crate::edges::{Edges, Side};
use crate::factors::measure;
use crate::forest::{Classes, Errors, distance};
use crate::guards::Candidate;
use crate::guards::MAX_VALENCE;
use crate::interpretation::Interpretation;
use crate::queue::{Entry, Queue};
use crate::regularity::RegularMesh;
use crate::surface::{Ring, Spoke, Surface};
use crate::weights::Coefficients;

/// Edges tried between two looks at whether to go on.
const EDGES_A_REPORT: usize = 1 << 14;

/// Keys of edges in the queue; the least is collapsed first. A key is W, edge by edge to begin
/// with; edges that become one go when the first of them would.
pub(crate) struct EdgeKeys<'a> {
    pub(crate) weights: &'a [f64],
    /// The mesh, where some of its shells are turned.
    pub(crate) regular: Option<&'a RegularMesh>,
    /// Rule by which weights are found anew.
    pub(crate) reweighting: Option<Reweighting<'a>>,
}

/// Weights after a collapse: those of the edges around the kept vertex are found anew by Eq. 1-4 of
/// the mesh as it is, with the maxima, deviations and proportion of borders of the whole mesh.
pub(crate) struct Reweighting<'a> {
    pub(crate) interpretation: &'a Interpretation,
    pub(crate) coefficients: Coefficients,
}

impl EdgeKeys<'_> {
    fn of_edge(&self, edge: usize) -> u64 {
        // Weights are not negative, so their bits have their order.
        self.weights[edge].to_bits()
    }

    /// Key of an edge by its weight and its present ends.
    fn key(&self, weight: f64, ends: [u32; 2]) -> u64 {
        self.regular.map_or(weight, |regular| regular.ordering_weight(weight, ends)).to_bits()
    }
}

/// Collapses edges in the order of their keys, each only when the collapse is legal: it folds no
/// face over and keeps the topology (`guards`).
///
/// The smaller class moves onto the larger, as in the paper's order, unless
/// only the other direction is legal. An edge that cannot go either way is put
/// off until a collapse changes what is around one of its ends; one that never
/// becomes legal is not collapsed.
///
/// A live edge is in the queue, or put off, or neither: once, whichever it is.
/// A collapse queues the edges around the kept vertex, and those put off around
/// its new neighbours.
pub(crate) fn collapse(
    mesh: Mesh<'_>,
    edges: &Edges,
    sorted: &[u32],
    keys: &EdgeKeys<'_>,
    progress: &mut Progress<'_>,
) -> Result<Vec<Collapse>, Error> {
    let mut greedy = GreedyCollapser::new(mesh, edges, sorted, keys);
    let mut tried = 0_usize;
    while let Some(entry) = greedy.queue.pop() {
        greedy.attempt(entry);
        tried += 1;
        if tried.is_multiple_of(EDGES_A_REPORT) {
            let done = greedy.collapses.len() as f32 / mesh.positions.len() as f32;
            progress.report(crate::SORTED + (1.0 - crate::SORTED) * done)?;
        }
    }
    Ok(greedy.collapses)
}

struct GreedyCollapser<'a> {
    surface: Surface<'a>,
    keys: &'a EdgeKeys<'a>,
    queue: Queue,
    classes: Classes,
    errors: Errors,
    collapses: Vec<Collapse>,
    /// The key of the edge that each side belongs to.
    side_keys: Vec<u64>,
    /// Deferred edges: whether each waits for a change around it.
    is_deferred: Vec<bool>,
    /// Vertices around which an edge may be deferred.
    may_defer: Vec<bool>,
    rings: [Ring; 3],
    sides: Vec<Side>,
}

impl<'a> GreedyCollapser<'a> {
    fn new(mesh: Mesh<'a>, edges: &Edges, sorted: &[u32], keys: &'a EdgeKeys<'a>) -> Self {
        let vertices = mesh.positions.len();
        let surface = Surface::new(mesh);
        let sorted = sorted.iter().map(|&edge| edge as usize);
        let queue = Queue::new(vertices, sorted.map(|e| (keys.of_edge(e), edges.ends[e])));
        let sides = surface.side_count();
        let mut greedy = Self {
            surface,
            keys,
            queue,
            classes: Classes::new(vertices),
            errors: Errors::new(vertices),
            collapses: Vec::with_capacity(vertices),
            side_keys: vec![0; sides],
            is_deferred: vec![false; sides],
            may_defer: vec![false; vertices],
            rings: Default::default(),
            sides: Vec::new(),
        };
        greedy.key_all_sides();
        greedy
    }

    fn key_all_sides(&mut self) {
        let ring = &mut self.rings[0];
        let mut edge = 0;
        for vertex in 0..self.may_defer.len() as u32 {
            self.surface.ring(vertex, ring);
            // Edges are numbered by smaller, then larger vertex, as rings are.
            for spokes in ring.edges().filter(|spokes| spokes[0].neighbour > vertex) {
                let key = self.keys.of_edge(edge);
                spokes.iter().for_each(|spoke| self.side_keys[spoke.side] = key);
                edge += 1;
            }
        }
    }

    fn attempt(&mut self, entry: Entry) {
        let [low, high] = entry.ends;
        let (removed, kept) = self.classes.rank(low, high);
        let [removed_ring, kept_ring, _] = &mut self.rings;
        self.surface.ring(removed, removed_ring);
        self.surface.ring(kept, kept_ring);
        let forwards = Candidate { removed, removed_ring, kept, kept_ring };
        let backwards = Candidate {
            removed: kept,
            removed_ring: kept_ring,
            kept: removed,
            kept_ring: removed_ring,
        };
        if forwards.is_legal(&self.surface) {
            self.collapse(removed, kept);
        } else if backwards.is_legal(&self.surface) {
            self.rings.swap(0, 1);
            self.collapse(kept, removed);
        } else {
            for spoke in removed_ring.edge_to(kept) {
                self.is_deferred[spoke.side] = true;
            }
            self.may_defer[low as usize] = true;
            self.may_defer[high as usize] = true;
        }
    }

    /// Collapses a legal edge; the first ring is that of the removed vertex.
    fn collapse(&mut self, removed: u32, kept: u32) {
        let distance = distance(&self.surface.mesh, removed, kept);
        let error = self.errors.join(distance, removed, kept);
        self.collapses.push(Collapse { removed, kept, error });
        self.classes.merge(removed, kept);
        self.merge_keys(kept);
        self.surface.collapse(removed, kept);
        self.queue.renew(removed);
        self.queue.renew(kept);
        self.queue_edges_around(kept);
        let removed_ring = std::mem::take(&mut self.rings[0]);
        for spokes in removed_ring.edges() {
            let neighbour = spokes[0].neighbour;
            if self.may_defer[neighbour as usize] && self.surface.valence(neighbour) <= MAX_VALENCE
            {
                self.queue_deferred_edges_around(neighbour);
            }
        }
        self.rings[0] = removed_ring;
    }

    /// Merges the keys of edges that are about to become one: they take the lesser. Sides of dying
    /// triangles lose their entries.
    fn merge_keys(&mut self, kept: u32) {
        let [removed_ring, kept_ring, _] = &self.rings;
        for dying in removed_ring.edge_to(kept) {
            let of_removed = removed_ring.edge_to(dying.opposite).iter();
            let sides = || of_removed.clone().chain(kept_ring.edge_to(dying.opposite));
            let least = sides().map(|spoke| self.side_keys[spoke.side]).min();
            sides().for_each(|spoke| self.side_keys[spoke.side] = least.unwrap_or(u64::MAX));
        }
    }

    fn queue_edges_around(&mut self, kept: u32) {
        let ring = &mut self.rings[1];
        self.surface.ring(kept, ring);
        for spokes in ring.edges() {
            let neighbour = spokes[0].neighbour;
            let ends = [kept.min(neighbour), kept.max(neighbour)];
            let weight = match &self.keys.reweighting {
                None => {
                    let keys = spokes.iter().map(|spoke| self.side_keys[spoke.side]);
                    f64::from_bits(keys.min().unwrap_or(u64::MAX))
                }
                Some(Reweighting { interpretation, coefficients }) => {
                    let side = |spoke: &Spoke| Side::new(ends[1], spoke.opposite);
                    self.sides.clear();
                    self.sides.extend(spokes.iter().map(side));
                    let factors = measure(&self.surface.mesh, ends, &self.sides, interpretation);
                    coefficients.weigh(&factors)
                }
            };
            let key = self.keys.key(weight, ends);
            for spoke in spokes {
                self.side_keys[spoke.side] = key;
                self.is_deferred[spoke.side] = false;
            }
            self.queue.push(key, kept, neighbour);
        }
        self.may_defer[kept as usize] = false;
    }

    fn queue_deferred_edges_around(&mut self, vertex: u32) {
        let ring = &mut self.rings[2];
        self.surface.ring(vertex, ring);
        for spokes in ring.edges().filter(|spokes| self.is_deferred[spokes[0].side]) {
            self.queue.push(self.side_keys[spokes[0].side], vertex, spokes[0].neighbour);
        }
        for spoke in ring.edges().flatten() {
            self.is_deferred[spoke.side] = false;
        }
        self.may_defer[vertex as usize] = false;
    }
}

#[cfg(test)]
mod tests;
