//! One theta for a model of many meshes: the share of its vertices that goes where it shows least.

use std::sync::Arc;

use crate::{CollapseStacks, NEVER_REMOVED, theta_to_cursor};

/// Intervals of theta between which the cursors of a mesh are interpolated.
const INTERVALS: usize = 256;
/// Bisections for the share of the way between two cursors; a mesh has fewer vertices than that
/// tells apart.
const SHARE_STEPS: usize = 32;

/// Cursors of a mesh at evenly spaced thetas of its model, from 0 to 1.
pub(crate) type SharedCursors = Box<[u32]>;

/// Shares one theta among the meshes of a model, by error: at each theta no mesh has a greater error
/// than another one could have instead, and a mesh becomes empty only when none has anything else
/// left. The meshes together lose the same share of their vertices as one would.
///
/// `scales` has metres of the model to a unit of each mesh. Meshes whose sequence asks for a theta
/// of their own ([`StackTables::theta_by_mesh`](crate::StackTables::theta_by_mesh)), and stacks that
/// are in use elsewhere, keep it.
pub fn share_theta(stacks: &mut [Arc<CollapseStacks>], scales: &[f32]) {
    let mut meshes: Vec<SharedMesh<'_>> = stacks
        .iter_mut()
        .zip(scales)
        .filter_map(|(stacks, &scale)| SharedMesh::new(Arc::get_mut(stacks)?, scale))
        .collect();
    if meshes.len() < 2 {
        return;
    }
    let total: u64 = meshes.iter().map(|mesh| u64::from(mesh.stacks.position_count())).sum();
    for knot in 0..=INTERVALS {
        let wanted = (knot as f64 / INTERVALS as f64 * total as f64).round() as u64;
        let cursors = cursors_for(&meshes, wanted);
        for (mesh, cursor) in meshes.iter_mut().zip(cursors) {
            mesh.cursors.push(cursor);
        }
    }
    for mesh in meshes {
        mesh.stacks.share(mesh.cursors.into());
    }
}

/// Mesh that takes part.
struct SharedMesh<'a> {
    stacks: &'a mut CollapseStacks,
    /// Metres of the model to a unit of the mesh.
    scale: f32,
    /// Greatest cursor at which a triangle is left.
    last_shown: u32,
    cursors: Vec<u32>,
}

impl<'a> SharedMesh<'a> {
    fn new(stacks: &'a mut CollapseStacks, scale: f32) -> Option<Self> {
        let tables = stacks.tables();
        if tables.theta_by_mesh || stacks.collapse_count() == 0 {
            return None;
        }
        let count = stacks.collapse_count();
        let last_death = tables.removal_cursor.iter().copied().max().unwrap_or(0);
        let last_shown = match last_death {
            NEVER_REMOVED => count,
            death => death.saturating_sub(1).min(count),
        };
        Some(Self { stacks, scale, last_shown, cursors: Vec::with_capacity(INTERVALS + 1) })
    }

    /// Greatest cursor within an error in metres at which a triangle is left.
    fn cursor_within(&self, error: f32) -> u32 {
        self.stacks.cursor_for_error(error / self.scale).min(self.last_shown)
    }
}

/// Cursors that together remove `wanted` vertices, as far as there are collapses.
fn cursors_for(meshes: &[SharedMesh<'_>], wanted: u64) -> Vec<u32> {
    let sum = |cursors: &[u32]| cursors.iter().map(|&cursor| u64::from(cursor)).sum::<u64>();
    let within = |bits: u32| -> Vec<u32> {
        meshes.iter().map(|mesh| mesh.cursor_within(f32::from_bits(bits))).collect()
    };
    if sum(&within(0)) >= wanted {
        return interpolate(&vec![0; meshes.len()], &within(0), wanted);
    }
    // Bits of errors, which are not negative, have the order of the errors.
    let (mut below, mut enough) = (0, f32::MAX.to_bits());
    while enough - below > 1 {
        let middle = below + (enough - below) / 2;
        match sum(&within(middle)) >= wanted {
            true => enough = middle,
            false => below = middle,
        }
    }
    let least = within(below);
    let most = within(enough);
    if sum(&most) >= wanted {
        return interpolate(&least, &most, wanted);
    }
    let all: Vec<u32> = meshes.iter().map(|mesh| mesh.stacks.collapse_count()).collect();
    interpolate(&most, &all, wanted.min(sum(&all)))
}

/// Cursors between two for each mesh, whose sum is as near to `wanted` as one share of the way for
/// all of them allows: equal meshes go together.
fn interpolate(least: &[u32], most: &[u32], wanted: u64) -> Vec<u32> {
    let pairs = || least.iter().zip(most).map(|(&a, &b)| (a, b - a));
    let part = |share: f64, difference: u32| (share * f64::from(difference)).round() as u32;
    let wanted = wanted.saturating_sub(least.iter().map(|&cursor| u64::from(cursor)).sum());
    // Between neighbouring errors few meshes have another cursor.
    let differences: Vec<u32> = pairs().map(|(_, more)| more).filter(|&more| more > 0).collect();
    let sum = |share| differences.iter().map(|&more| u64::from(part(share, more))).sum::<u64>();
    let (mut below, mut above) = (0.0, 1.0);
    for _ in 0..SHARE_STEPS {
        let middle = f64::midpoint(below, above);
        match sum(middle) >= wanted {
            true => above = middle,
            false => below = middle,
        }
    }
    let is_above_nearer = sum(above).abs_diff(wanted) <= sum(below).abs_diff(wanted);
    let share = if is_above_nearer { above } else { below };
    pairs().map(|(cursor, more)| cursor + part(share, more)).collect()
}

/// Cursor of a mesh for a theta of its model, or of its own where it shares none.
pub(crate) fn cursor(
    shared: Option<&SharedCursors>,
    theta: f64,
    position_count: u32,
    collapse_count: u32,
) -> u32 {
    let Some(cursors) = shared else {
        return theta_to_cursor(theta, position_count, collapse_count);
    };
    let place = theta.clamp(0.0, 1.0) * INTERVALS as f64;
    let knot = (place as usize).min(INTERVALS - 1);
    let [before, after] = [cursors[knot], cursors[knot + 1]];
    let share = (place - knot as f64) * (f64::from(after) - f64::from(before));
    (f64::from(before) + share).round() as u32
}

#[cfg(test)]
#[path = "theta_sharing_tests.rs"]
mod tests;
