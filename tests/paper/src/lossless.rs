//! The lossless proof: random moves of the cursor, and the bytes at places
//! that are visited again and again.

use anyhow::{Context, Result, ensure};
use busbar_geometry::{CollapseStacks, ResolvedMesh};
use serde::Serialize;

use crate::progress::Progress;

/// One move in this many goes to a place whose bytes are known.
const MOVES_PER_VISIT: usize = 10;

/// Thetas whose bytes are compared at each visit.
const FIXED_THETAS: [f64; 5] = [0.0, 0.5, 0.7, 0.85, 0.95];

/// What random moves came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LosslessWalk {
    /// Moves made, visits included.
    pub moves: usize,
    /// BLAKE3 of the index bytes at theta 0 before the first move.
    pub before: String,
    /// The same after the last one.
    pub after: String,
    /// Places visited on the way.
    pub visits: Vec<FixedPlace>,
    /// Live triangles looked at, each of which still belongs to the equipment
    /// that it was imported with.
    pub triangles_checked: u64,
}

/// A cursor that the walk came back to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FixedPlace {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Collapses done there.
    pub cursor: u32,
    /// BLAKE3 of the index bytes before the walk.
    pub hash: String,
    /// Visits during the walk.
    pub visits: usize,
    /// Of these, visits that found other bytes.
    pub differing: usize,
}

impl LosslessWalk {
    /// Moves the cursor `moves` times.
    ///
    /// # Errors
    /// When a live triangle changed its equipment.
    pub fn walk(stacks: &CollapseStacks, moves: usize, progress: &Progress) -> Result<Self> {
        let hash_at = |cursor| hash(&stacks.resolve(cursor));
        let place = |theta| {
            let cursor = stacks.cursor_at(theta);
            FixedPlace { theta, cursor, hash: hash_at(cursor), visits: 0, differing: 0 }
        };
        let mut walk = Self {
            moves,
            before: hash_at(0),
            after: String::new(),
            visits: FIXED_THETAS.into_iter().map(place).collect(),
            triangles_checked: 0,
        };
        let mut random = fastrand::Rng::with_seed(1015);
        for step in 0..moves {
            let visited = (step % MOVES_PER_VISIT == 0).then(|| random.usize(0..walk.visits.len()));
            let cursor = visited.map_or_else(
                || random.u32(0..=stacks.collapse_count()),
                |place| walk.visits[place].cursor,
            );
            let resolved = stacks.resolve(cursor);
            walk.triangles_checked += check_identity(stacks, &resolved, cursor)?;
            if let Some(place) = visited.map(|place| &mut walk.visits[place]) {
                place.visits += 1;
                place.differing += usize::from(hash(&resolved) != place.hash);
            }
            progress.step();
        }
        walk.after = hash_at(0);
        Ok(walk)
    }

    /// Whether every visit and the return found the same bytes.
    pub fn is_lossless(&self) -> bool {
        self.before == self.after && self.visits.iter().all(|place| place.differing == 0)
    }
}

/// All corners of every live triangle belong to the feature that the triangle
/// was imported with; returns how many triangles there are.
fn check_identity(
    stacks: &CollapseStacks,
    resolved: &ResolvedMesh<'_>,
    cursor: u32,
) -> Result<u64> {
    let mesh = stacks.mesh();
    let mut imported = stacks.live(cursor);
    for &corners in &resolved.triangles {
        let triangle = imported.next().context("more triangles are drawn than live")?;
        let expected = mesh.feature(mesh.triangles[triangle as usize]);
        let keeps = corners.into_iter().all(|corner| mesh.feature([corner; 3]) == expected);
        ensure!(keeps, "at cursor {cursor} triangle {triangle} changed its equipment");
    }
    Ok(resolved.triangles.len() as u64)
}

fn hash(resolved: &ResolvedMesh<'_>) -> String {
    blake3::hash(bytemuck::cast_slice(&resolved.triangles)).to_hex()[..32].to_owned()
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
