//! Construction of collapse stacks from a mesh and a collapse sequence.

use std::ops::Range;

use super::{CollapseStacks, StackTables, TablesError, triangle_removal};
use crate::mesh::scatter;
use crate::{CollapseSequence, Mesh, SlenderPoint};

/// Greatest number of wedges of the surviving position among which a wedge chooses its parent.
/// Bounds the build on positions with very many wedges, and lets the choice fit into a byte.
const MAX_PARENT_CANDIDATES: u32 = 64;

impl CollapseStacks {
    /// Builds the stacks. `sequence` must belong to `mesh`.
    ///
    /// # Panics
    /// When the sequence was checked for another number of positions, or a
    /// position has no wedge: the caller mixed two meshes up.
    pub fn build(mut mesh: Mesh, sequence: &CollapseSequence) -> Self {
        assert_eq!(
            sequence.position_count() as usize,
            mesh.positions.len(),
            "sequence of this mesh"
        );
        let max_depth = max_depth(sequence);
        let removal_cursor = triangle_removal::find_removal_cursors(&mesh, sequence, max_depth);
        let ranks = removal_ranks(sequence);
        mesh.group_wedges();
        let slender = slender_points(&mesh, &ranks);
        scatter_positions(&mut mesh, &ranks);
        for position in &mut mesh.wedges.position {
            *position = ranks[*position as usize];
        }

        let kept = sequence.entries().iter().rev().map(|entry| ranks[entry.kept as usize]);
        let parents: Vec<u32> = kept.collect();
        let ranges = mesh.wedge_ranges();
        let tables = StackTables {
            parent_offset: parent_offsets(&mesh, &parents, &ranges),
            removal_cursor,
            parent_start: parents.iter().map(|&parent| ranges[parent as usize].start).collect(),
            errors: StackTables::sample_errors(sequence.entries().iter().map(|e| e.error)),
            max_depth,
            theta_by_mesh: sequence.is_theta_by_mesh(),
        };
        Self { mesh, tables, slender, shared_cursors: None }
    }

    /// Puts a mesh and the tables that were once built for it together again.
    /// `ranks` are those of its sequence, [`removal_ranks`]. The mesh is taken
    /// if all goes well, and left otherwise.
    ///
    /// # Errors
    /// When they cannot belong together; that they do is up to the caller.
    pub fn restore(
        mesh: &mut Mesh,
        ranks: &[u32],
        tables: StackTables,
    ) -> Result<Self, TablesError> {
        let wedges = mesh.wedges.len();
        check_length("position numbers", ranks.len(), mesh.positions.len())?;
        check_length("parent offsets", tables.parent_offset.len(), wedges)?;
        check_length("death indices", tables.removal_cursor.len(), mesh.triangles.len())?;
        let collapses = tables.parent_start.len().min(mesh.positions.len());
        check_length("parents", tables.parent_start.len(), collapses)?;
        check_permutation(ranks)?;
        mesh.group_wedges();
        let of_wedges: Vec<u32> =
            mesh.wedges.position.iter().map(|&position| ranks[position as usize]).collect();
        check_parents(&of_wedges, ranks.len() - collapses, &tables)?;
        let mut mesh = std::mem::take(mesh);
        let slender = slender_points(&mesh, ranks);
        mesh.wedges.position = of_wedges;
        scatter_positions(&mut mesh, ranks);
        Ok(Self { mesh, tables, slender, shared_cursors: None })
    }
}

/// Checks that every parent is removed later or never: then no chain is endless.
fn check_parents(of_wedges: &[u32], fixed: usize, tables: &StackTables) -> Result<(), TablesError> {
    for (wedge, &position) in of_wedges.iter().enumerate() {
        if let Some(removed) = (position as usize).checked_sub(fixed) {
            let start = tables.parent_start[removed] as usize;
            let parent = of_wedges.get(start + usize::from(tables.parent_offset[wedge]));
            if parent.is_none_or(|&parent| parent >= position) {
                return Err(TablesError::NoParent { wedge });
            }
        }
    }
    Ok(())
}

/// Numbers the positions in reverse order of removal: of V positions, entry `i` removes number `V -
/// 1 - i`; the others keep their order.
pub fn removal_ranks(sequence: &CollapseSequence) -> Vec<u32> {
    const STAYS: u32 = u32::MAX;
    let count = sequence.position_count();
    let mut ranks = vec![STAYS; count as usize];
    for (entry, rank) in sequence.entries().iter().zip((0..count).rev()) {
        ranks[entry.removed as usize] = rank;
    }
    for (rank, number) in ranks.iter_mut().filter(|rank| **rank == STAYS).zip(0..) {
        *rank = number;
    }
    ranks
}

/// Finds slender points and numbers them in order of removal. The mesh still has its own numbers,
/// in which neighbours lie together.
fn slender_points(mesh: &Mesh, ranks: &[u32]) -> Vec<SlenderPoint> {
    let mut points = mesh.slender_points();
    points.iter_mut().for_each(|point| point.position = ranks[point.position as usize]);
    points
}

fn scatter_positions(mesh: &mut Mesh, ranks: &[u32]) {
    mesh.positions = scatter(&mesh.positions, ranks);
    if !mesh.features.is_empty() {
        mesh.features = scatter(&mesh.features, ranks);
    }
}

/// Computes the length of the longest chain of ancestors. A position removed later is an ancestor,
/// so one pass from the end suffices.
fn max_depth(sequence: &CollapseSequence) -> u32 {
    let mut depth = vec![0_u32; sequence.position_count() as usize];
    let mut max = 0;
    for entry in sequence.entries().iter().rev() {
        let below = depth[entry.kept as usize] + 1;
        depth[entry.removed as usize] = below;
        max = max.max(below);
    }
    max
}

/// Chooses for each wedge the best wedge of the surviving position: of the same section, then with
/// the nearest normal and texture coordinate, then the first.
fn parent_offsets(mesh: &Mesh, parents: &[u32], ranges: &[Range<u32>]) -> Vec<u8> {
    let wedges = &mesh.wedges;
    let fixed = mesh.positions.len() - parents.len();
    let offset = |(wedge, &position): (usize, &u32)| {
        let Some(removed) = (position as usize).checked_sub(fixed) else {
            return 0;
        };
        let candidates = ranges[parents[removed] as usize].clone();
        let count = candidates.len().min(MAX_PARENT_CANDIDATES as usize);
        if count <= 1 {
            return 0;
        }
        let misfit = |candidate: usize| {
            let bend = 1.0 - wedges.normal[wedge].dot(wedges.normal[candidate]);
            let stretch = wedges.uv[wedge].distance(wedges.uv[candidate]);
            (wedges.section[wedge] != wedges.section[candidate], bend + stretch)
        };
        let mut best = (0, misfit(candidates.start as usize));
        for offset in 1..count {
            let found = misfit(candidates.start as usize + offset);
            let (a, b) = (found, best.1);
            if a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).is_lt() {
                best = (offset as u8, found);
            }
        }
        best.0
    };
    wedges.position.iter().enumerate().map(offset).collect()
}

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), TablesError> {
    if found == expected { Ok(()) } else { Err(TablesError::Length { what, found, expected }) }
}

fn check_permutation(ranks: &[u32]) -> Result<(), TablesError> {
    let mut seen = vec![false; ranks.len()];
    for &rank in ranks {
        match seen.get_mut(rank as usize) {
            Some(seen) if !*seen => *seen = true,
            _ => return Err(TablesError::NoPermutation),
        }
    }
    Ok(())
}
