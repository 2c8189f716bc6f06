//! Collapse stacks: one immutable array of collapses, and the mesh at any
//! cursor on it.
//!
//! The paper's pair of stacks (section III) is one array and a cursor `k`, the
//! number of entries done: S2 = entries[..k] (collapsed), S1 = entries[k..]
//! (to be collapsed). Pop and push is `k + 1` or `k - 1`. Nothing is edited
//! when a cursor moves, so going back loses nothing by construction.

use std::cmp::Ordering;
use std::ops::Range;

use crate::{CollapseSequence, Mesh, theta_to_cursor};

/// The collapse index of a vertex that no entry removes, and the death index
/// of a triangle that no cursor kills.
pub const NEVER: u32 = u32::MAX;

/// How many wedges of the surviving position a wedge may choose its parent
/// from. Bounds the build on a mesh whose positions have very many wedges.
const MAX_PARENT_CANDIDATES: usize = 64;

/// A mesh with everything needed to show it at any cursor.
///
/// Wedges are renumbered so that a wedge's parent always comes before it: then
/// resolving is one forward pass. Their data stay as imported.
#[derive(Clone, Debug)]
pub struct CollapseStacks {
    mesh: Mesh,
    sequence: CollapseSequence,
    /// Per wedge: the wedge that stands for it once collapsed; itself if never.
    parent: Vec<u32>,
    /// Per wedge: the entry that removes it, or [`NEVER`].
    collapse_index: Vec<u32>,
    /// Per triangle: the smallest cursor at which two corners share a position.
    death_index: Vec<u32>,
    max_depth: u32,
}

/// The mesh at one cursor: live triangles in import order.
#[derive(Clone, Debug)]
pub struct ResolvedMesh<'a> {
    stacks: &'a CollapseStacks,
    /// Corners of live triangles, as wedge indices into [`CollapseStacks::mesh`].
    pub triangles: Vec<[u32; 3]>,
    /// For each section of the mesh, its range in `triangles`.
    pub sections: Vec<Range<u32>>,
    /// Import index of each live triangle; it keeps its identity at any cursor.
    pub imported: Vec<u32>,
}

impl CollapseStacks {
    /// Builds the stacks. `sequence` must belong to `mesh`.
    ///
    /// # Panics
    /// When the sequence was checked for another number of positions: the
    /// caller mixed two meshes up.
    pub fn build(mesh: Mesh, sequence: CollapseSequence) -> Self {
        assert_eq!(
            sequence.position_count() as usize,
            mesh.positions.len(),
            "sequence of this mesh"
        );
        let (forest, meetings) = (Forest::of(&sequence), Meetings::of(&sequence));
        let death_index =
            mesh.triangles.iter().map(|&t| meetings.death(mesh.corner_positions(t))).collect();
        let parent = parent_wedges(&mesh, &forest);
        let collapse_index =
            mesh.wedges.position.iter().map(|&p| forest.index[p as usize]).collect();
        let max_depth = forest.max_depth(&sequence);
        let mut stacks = Self { mesh, sequence, parent, collapse_index, death_index, max_depth };
        stacks.number_parents_first();
        stacks
    }

    /// The mesh, its wedges numbered parents first.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The collapses: S1 and S2 together.
    pub fn sequence(&self) -> &CollapseSequence {
        &self.sequence
    }

    /// The cursor for a proportion of simplified vertices.
    pub fn cursor_at(&self, theta: f64) -> u32 {
        theta_to_cursor(theta, self.sequence.position_count(), self.sequence.len())
    }

    /// Positions that survive at a cursor.
    pub fn surviving(&self, cursor: u32) -> u32 {
        self.sequence.position_count() - cursor.min(self.sequence.len())
    }

    /// Triangles that live at a cursor.
    pub fn live_triangles(&self, cursor: u32) -> u64 {
        self.death_index.iter().filter(|&&death| death > cursor).count() as u64
    }

    /// The longest chain of ancestors.
    pub fn max_depth(&self) -> u32 {
        self.max_depth
    }

    /// The smallest cursor at which a triangle is dead, or [`NEVER`].
    pub fn death_index(&self, triangle: usize) -> u32 {
        self.death_index[triangle]
    }

    /// Bytes that the stacks add to a plain indexed mesh on every device that
    /// holds them: parents, collapse indices and death indices.
    pub fn static_bytes(&self) -> usize {
        (self.parent.len() + self.collapse_index.len() + self.death_index.len()) * size_of::<u32>()
    }

    /// The wedge that stands for each wedge at a cursor.
    pub fn standing_wedges(&self, cursor: u32) -> Vec<u32> {
        let mut standing: Vec<u32> = Vec::with_capacity(self.parent.len());
        for (wedge, (&parent, &index)) in self.parent.iter().zip(&self.collapse_index).enumerate() {
            let stands = if index < cursor { standing[parent as usize] } else { wedge as u32 };
            standing.push(stands);
        }
        standing
    }

    /// The mesh at a cursor: a relabelling pass and a filter, nothing else.
    pub fn resolve(&self, cursor: u32) -> ResolvedMesh<'_> {
        let standing = self.standing_wedges(cursor);
        let mut resolved = ResolvedMesh {
            stacks: self,
            triangles: Vec::with_capacity(self.mesh.triangles.len()),
            sections: Vec::with_capacity(self.mesh.sections.len()),
            imported: Vec::with_capacity(self.mesh.triangles.len()),
        };
        for section in &self.mesh.sections {
            let start = resolved.triangles.len() as u32;
            let first = section.first_triangle as usize;
            for triangle in first..first + section.triangle_count as usize {
                if self.death_index[triangle] > cursor {
                    let corners = self.mesh.triangles[triangle];
                    resolved.triangles.push(corners.map(|wedge| standing[wedge as usize]));
                    resolved.imported.push(triangle as u32);
                }
            }
            resolved.sections.push(start..resolved.triangles.len() as u32);
        }
        resolved
    }

    /// Sorts wedges by descending collapse index. A parent is removed after
    /// its child or never, so it comes first.
    fn number_parents_first(&mut self) {
        let mut old_of_new: Vec<u32> = (0..self.parent.len() as u32).collect();
        old_of_new.sort_by_key(|&w| std::cmp::Reverse(self.collapse_index[w as usize]));
        let mut new_of_old = vec![0; old_of_new.len()];
        for (new, &old) in old_of_new.iter().enumerate() {
            new_of_old[old as usize] = new as u32;
        }
        let rename = |wedge: u32| new_of_old[wedge as usize];
        self.parent = gather(&self.parent, &old_of_new).into_iter().map(rename).collect();
        self.collapse_index = gather(&self.collapse_index, &old_of_new);
        let wedges = &mut self.mesh.wedges;
        wedges.position = gather(&wedges.position, &old_of_new);
        wedges.normal = gather(&wedges.normal, &old_of_new);
        wedges.uv = gather(&wedges.uv, &old_of_new);
        wedges.section = gather(&wedges.section, &old_of_new);
        for triangle in &mut self.mesh.triangles {
            *triangle = triangle.map(rename);
        }
    }
}

impl ResolvedMesh<'_> {
    /// Live triangles as position indices.
    pub fn position_triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().map(|&t| self.stacks.mesh.corner_positions(t))
    }

    /// Positions of the full mesh.
    pub fn position_count(&self) -> u32 {
        self.stacks.mesh.positions.len() as u32
    }
}

fn gather<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&i| values[i as usize]).collect()
}

/// Which entry removes each position, and what stands for it then.
struct Forest {
    parent: Vec<u32>,
    index: Vec<u32>,
}

impl Forest {
    fn of(sequence: &CollapseSequence) -> Self {
        let count = sequence.position_count();
        let mut forest = Self { parent: (0..count).collect(), index: vec![NEVER; count as usize] };
        for (index, entry) in sequence.entries().iter().enumerate() {
            forest.parent[entry.removed as usize] = entry.kept;
            forest.index[entry.removed as usize] = index as u32;
        }
        forest
    }

    fn max_depth(&self, sequence: &CollapseSequence) -> u32 {
        let mut depth = vec![0_u32; self.parent.len()];
        // Backwards: a parent's depth is final before its children ask for it.
        for entry in sequence.entries().iter().rev() {
            depth[entry.removed as usize] = depth[entry.kept as usize] + 1;
        }
        depth.into_iter().max().unwrap_or(0)
    }
}

/// When positions become one. The classes of a sequence are joined anew by
/// size, so that paths stay at most log2 V long whatever chains an optimiser
/// makes; each link bears the entry that joined its two classes.
struct Meetings {
    parent: Vec<u32>,
    joined_by: Vec<u32>,
}

impl Meetings {
    fn of(sequence: &CollapseSequence) -> Self {
        let count = sequence.position_count();
        let mut meetings =
            Self { parent: (0..count).collect(), joined_by: vec![NEVER; count as usize] };
        let mut size = vec![1_u32; count as usize];
        // The root, in this forest, of the class that a survivor stands for.
        let mut root: Vec<u32> = (0..count).collect();
        for (index, entry) in sequence.entries().iter().enumerate() {
            let (a, b) = (root[entry.removed as usize], root[entry.kept as usize]);
            let (low, high) = if size[a as usize] < size[b as usize] { (a, b) } else { (b, a) };
            meetings.parent[low as usize] = high;
            meetings.joined_by[low as usize] = index as u32;
            size[high as usize] += size[low as usize];
            root[entry.kept as usize] = high;
        }
        meetings
    }

    /// The smallest cursor at which two of the corners share a position.
    fn death(&self, [a, b, c]: [u32; 3]) -> u32 {
        self.meeting(a, b).min(self.meeting(b, c)).min(self.meeting(c, a))
    }

    /// The smallest cursor at which two positions are one. Links get younger
    /// towards the root, so the older one is always the next to follow.
    fn meeting(&self, mut a: u32, mut b: u32) -> u32 {
        let mut cursor = 0;
        while a != b {
            let (by_a, by_b) = (self.joined_by[a as usize], self.joined_by[b as usize]);
            match by_a.cmp(&by_b) {
                Ordering::Less => {
                    cursor = by_a + 1;
                    a = self.parent[a as usize];
                }
                Ordering::Greater => {
                    cursor = by_b + 1;
                    b = self.parent[b as usize];
                }
                // Only two roots can be equal: an entry makes one link.
                Ordering::Equal => return NEVER,
            }
        }
        cursor
    }
}

/// For each wedge, the wedge of the surviving position that fits it best: of
/// the same section, then with the nearest normal and texture coordinate.
fn parent_wedges(mesh: &Mesh, forest: &Forest) -> Vec<u32> {
    let wedges = &mesh.wedges;
    let (starts, of_position) = wedges_by_position(mesh);
    let candidates = |position: u32| {
        let range = starts[position as usize] as usize..starts[position as usize + 1] as usize;
        &of_position[range]
    };
    (0..wedges.len() as u32)
        .map(|wedge| {
            let w = wedge as usize;
            let position = wedges.position[w];
            if forest.index[position as usize] == NEVER {
                return wedge;
            }
            let misfit = |candidate: u32| {
                let c = candidate as usize;
                let bend = 1.0 - wedges.normal[w].dot(wedges.normal[c]);
                let stretch = wedges.uv[w].distance(wedges.uv[c]);
                (wedges.section[w] != wedges.section[c], bend + stretch)
            };
            candidates(forest.parent[position as usize])
                .iter()
                .take(MAX_PARENT_CANDIDATES)
                .copied()
                .min_by(|&a, &b| {
                    let (a, b) = (misfit(a), misfit(b));
                    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
                })
                .unwrap_or(wedge)
        })
        .collect()
}

/// Wedges grouped by position: offsets, and wedge indices in order.
fn wedges_by_position(mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; mesh.positions.len() + 1];
    for &position in &mesh.wedges.position {
        starts[position as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut next = starts.clone();
    let mut grouped = vec![0_u32; mesh.wedges.len()];
    for (wedge, &position) in mesh.wedges.position.iter().enumerate() {
        grouped[next[position as usize] as usize] = wedge as u32;
        next[position as usize] += 1;
    }
    (starts, grouped)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::{Collapse, RawPrimitive, weld};

    /// A strip of `n` quads along x.
    fn strip(n: u32) -> Mesh {
        let positions =
            (0..=n).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(x as f32, y, 0.0))).collect();
        let triangles = (0..n)
            .flat_map(|x| {
                let i = 2 * x;
                [[i, i + 2, i + 1], [i + 1, i + 2, i + 3]]
            })
            .collect();
        weld(&[RawPrimitive { positions, triangles, ..Default::default() }]).unwrap().0
    }

    fn sequence(mesh: &Mesh, pairs: &[(u32, u32)]) -> CollapseSequence {
        let entries =
            pairs.iter().map(|&(removed, kept)| Collapse { removed, kept, error: 0.0 }).collect();
        CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap()
    }

    /// The process as the paper words it: collapse one edge after the other.
    fn sequential(mesh: &Mesh, entries: &[Collapse]) -> Vec<[u32; 3]> {
        let mut triangles = mesh.topology().triangles;
        for entry in entries {
            for corner in triangles.iter_mut().flatten() {
                if *corner == entry.removed {
                    *corner = entry.kept;
                }
            }
            triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        }
        triangles
    }

    #[test]
    fn death_is_the_first_cursor_at_which_two_corners_meet() {
        let mesh = strip(1);
        let [[a, b, c], _] = [mesh.topology().triangles[0], mesh.topology().triangles[1]];
        let fourth = (0..4).find(|p| ![a, b, c].contains(p)).unwrap();
        let stacks = CollapseStacks::build(mesh.clone(), sequence(&mesh, &[(fourth, b), (c, a)]));
        assert_eq!(stacks.death_index(1), 1, "loses its own corner first");
        assert_eq!(stacks.death_index(0), 2);
        assert_eq!(stacks.resolve(0).triangles.len(), 2);
        assert_eq!(stacks.resolve(1).triangles.len(), 1);
        assert_eq!(stacks.resolve(2).triangles.len(), 0);
    }

    #[test]
    fn without_collapses_everything_lives_for_ever() {
        let mesh = strip(3);
        let stacks = CollapseStacks::build(mesh.clone(), sequence(&mesh, &[]));
        assert_eq!(stacks.resolve(0).triangles, mesh.triangles);
        assert_eq!(stacks.death_index(0), NEVER);
        assert_eq!(stacks.max_depth(), 0);
    }

    #[test]
    fn chains_have_the_depth_of_their_length() {
        let mesh = strip(3);
        let chain: Vec<(u32, u32)> = (0..7).map(|i| (i, i + 1)).collect();
        let stacks = CollapseStacks::build(mesh.clone(), sequence(&mesh, &chain));
        assert_eq!(stacks.max_depth(), 7);
        assert_eq!(stacks.resolve(7).triangles.len(), 0);
    }

    #[test]
    fn a_wedge_follows_the_wedge_of_its_own_section() {
        let mut upper = RawPrimitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        let mut lower = upper.clone();
        lower.positions[2] = Vec3::NEG_Y;
        lower.triangles[0] = [1, 0, 2];
        upper.material = Some(0);
        lower.material = Some(1);
        let (mesh, _) = weld(&[upper, lower]).unwrap();
        let (zero, x) = (0, 1);
        assert_eq!(mesh.positions[x as usize], Vec3::X);
        let stacks = CollapseStacks::build(mesh.clone(), sequence(&mesh, &[(x, zero)]));
        let standing = stacks.standing_wedges(1);
        let section = &stacks.mesh().wedges.section;
        for (wedge, &stands) in standing.iter().enumerate() {
            assert_eq!(section[wedge], section[stands as usize]);
        }
    }

    proptest! {
        /// At every cursor the filter and relabelling equal the sequential process.
        #[test]
        fn any_cursor_equals_the_sequential_process(
            quads in 1_u32..12,
            picks in prop::collection::vec((any::<u32>(), any::<u32>()), 0..30),
        ) {
            let mesh = strip(quads);
            let mut alive: Vec<u32> = (0..mesh.positions.len() as u32).collect();
            let mut pairs = Vec::new();
            for (a, b) in picks {
                if alive.len() < 2 { break; }
                let removed = alive.swap_remove(a as usize % alive.len());
                pairs.push((removed, alive[b as usize % alive.len()]));
            }
            let sequence = sequence(&mesh, &pairs);
            let stacks = CollapseStacks::build(mesh.clone(), sequence.clone());
            for cursor in (0..=pairs.len()).chain((0..pairs.len()).rev()) {
                let resolved = stacks.resolve(cursor as u32);
                let expected = sequential(&mesh, &sequence.entries()[..cursor]);
                prop_assert_eq!(resolved.position_triangles().collect::<Vec<_>>(), expected);
            }
        }
    }
}
