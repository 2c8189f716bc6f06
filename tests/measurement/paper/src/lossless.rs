//! Lossless proof: random moves of the cursor, and hashes at cursors that are visited again and
//! again.

use std::collections::BTreeSet;

use anyhow::{Context, Result, ensure};
use busbar_geometry::{CollapseStacks, Mesh, ResolvedMesh};
use rayon::prelude::*;
use serde::Serialize;
use twox_hash::XxHash3_128;

use crate::progress::Progress;

/// Interval of moves to a cursor whose bytes are known.
const MOVES_PER_VISIT: usize = 10;

/// Thetas whose bytes are compared at each visit.
const FIXED_THETAS: [f64; 5] = [0.0, 0.5, 0.7, 0.85, 0.95];

/// Results of the random moves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LosslessWalk {
    /// Number of moves, visits included.
    pub moves: usize,
    /// XXH3-128 of the index bytes at theta 0 before the first move.
    pub before: String,
    /// Hash of the same bytes after the last move.
    pub after: String,
    /// Places visited during the walk.
    pub visits: Vec<FixedPlace>,
    /// Number of checked live triangles, each of which still belongs to the equipment that it was
    /// imported with.
    pub triangles_checked: u64,
    /// Number of pieces of equipment that the triangles belong to.
    pub equipment: usize,
}

/// Cursor to which the walk returns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FixedPlace {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Position of the cursor: number of collapses done.
    pub cursor: u32,
    /// XXH3-128 of the index bytes before the walk.
    pub hash: String,
    /// Number of visits during the walk.
    pub visits: usize,
    /// Number of those visits that found other bytes.
    pub differing: usize,
}

/// Move of the walk.
#[derive(Clone, Copy)]
struct Move {
    cursor: u32,
    /// Index into the places whose bytes are known.
    place: Option<usize>,
}

/// Result of one move.
struct MoveResult {
    triangles: u64,
    /// Index of the visited place, and whether its bytes differed.
    visit: Option<(usize, bool)>,
}

impl LosslessWalk {
    /// Moves the cursor `moves` times. The mesh at a cursor depends on the
    /// cursor alone, so several threads walk.
    ///
    /// # Errors
    /// When a live triangle changed its equipment.
    pub fn walk(stacks: &CollapseStacks, moves: usize, progress: &Progress) -> Result<Self> {
        let hash_at = |cursor| hash(&stacks.resolve(cursor));
        let place = |theta| {
            let cursor = stacks.cursor_for_theta(theta);
            FixedPlace { theta, cursor, hash: hash_at(cursor), visits: 0, differing: 0 }
        };
        let mut walk = Self {
            moves,
            before: hash_at(0),
            after: String::new(),
            visits: FIXED_THETAS.into_iter().map(place).collect(),
            triangles_checked: 0,
            equipment: 0,
        };
        let identity = EquipmentMap::new(stacks.mesh());
        walk.equipment = identity.of_triangle.iter().flatten().collect::<BTreeSet<_>>().len();
        let make = |&Move { cursor, place }: &Move| {
            let resolved = stacks.resolve(cursor);
            let triangles = identity.check(stacks, &resolved, cursor)?;
            let differs = |place: usize| hash(&resolved) != walk.visits[place].hash;
            progress.step();
            Ok(MoveResult { triangles, visit: place.map(|place| (place, differs(place))) })
        };
        let route = route(stacks, &walk.visits, moves);
        let found: Vec<MoveResult> = route.par_iter().map(make).collect::<Result<_>>()?;
        for MoveResult { triangles, visit } in found {
            walk.triangles_checked += triangles;
            if let Some((place, differs)) = visit {
                walk.visits[place].visits += 1;
                walk.visits[place].differing += usize::from(differs);
            }
        }
        walk.after = hash_at(0);
        Ok(walk)
    }

    /// Reports whether every visit and the return found the same bytes.
    pub fn is_lossless(&self) -> bool {
        self.before == self.after && self.visits.iter().all(|place| place.differing == 0)
    }
}

/// Draws a route of random cursors, with a known place now and then.
fn route(stacks: &CollapseStacks, places: &[FixedPlace], moves: usize) -> Vec<Move> {
    let mut random = fastrand::Rng::with_seed(1015);
    let mut next = |step: usize| match step % MOVES_PER_VISIT {
        0 => {
            let place = random.usize(0..places.len());
            Move { cursor: places[place].cursor, place: Some(place) }
        }
        _ => Move { cursor: random.u32(0..=stacks.collapse_count()), place: None },
    };
    (0..moves).map(&mut next).collect()
}

/// Features of each wedge and of each triangle, as imported.
struct EquipmentMap {
    of_wedge: Vec<Option<u32>>,
    of_triangle: Vec<Option<u32>>,
}

impl EquipmentMap {
    fn new(mesh: &Mesh) -> Self {
        let wedges = 0..mesh.wedges.len() as u32;
        Self {
            of_wedge: wedges.map(|wedge| mesh.feature([wedge; 3])).collect(),
            of_triangle: mesh.triangles.iter().map(|&t| mesh.feature(t)).collect(),
        }
    }

    /// Checks that all corners of every live triangle belong to the feature that the triangle was
    /// imported with; returns the number of triangles.
    fn check(
        &self,
        stacks: &CollapseStacks,
        resolved: &ResolvedMesh<'_>,
        cursor: u32,
    ) -> Result<u64> {
        let mut imported = stacks.live(cursor);
        for corners in &resolved.triangles {
            let triangle = imported.next().context("more triangles are drawn than live")?;
            let expected = self.of_triangle[triangle as usize];
            let keeps = corners.iter().all(|&corner| self.of_wedge[corner as usize] == expected);
            ensure!(keeps, "at cursor {cursor} triangle {triangle} changed its equipment");
        }
        Ok(resolved.triangles.len() as u64)
    }
}

fn hash(resolved: &ResolvedMesh<'_>) -> String {
    format!("{:032x}", XxHash3_128::oneshot(bytemuck::cast_slice(&resolved.triangles)))
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{Collapse, CollapseSequence, RawPrimitive, weld};
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_walk_comes_back_to_the_same_bytes() {
        let fan: Vec<Vec3> =
            (0..12).map(|i| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0)).collect();
        let primitive = RawPrimitive {
            positions: fan,
            triangles: (1..11).map(|i| [0, i, i + 1]).collect(),
            ..RawPrimitive::default()
        };
        let (mesh, _) = weld(&[primitive]).unwrap();
        let entries = (2..12).map(|v| Collapse { removed: v, kept: 1, error: 0.0 }).collect();
        let sequence = CollapseSequence::new(entries, 12).unwrap();
        let stacks = CollapseStacks::build(mesh, &sequence);
        let walk = LosslessWalk::walk(&stacks, 200, &Progress::hidden()).unwrap();
        assert!(walk.is_lossless());
        assert_eq!(walk.visits.iter().map(|place| place.visits).sum::<usize>(), 20);
        assert!(walk.triangles_checked > 0);
        assert_ne!(walk.visits[0].hash, walk.visits[2].hash);
        let torn = LosslessWalk { after: walk.visits[2].hash.clone(), ..walk };
        assert!(!torn.is_lossless());
    }
}
