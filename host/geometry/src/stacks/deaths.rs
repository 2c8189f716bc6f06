//! Death indices: when triangles lose a corner.

use std::cmp::Ordering;

use super::NEVER;
use crate::Mesh;

/// Chains of ancestors up to this length are climbed as they are.
const MAX_CLIMBED_DEPTH: u32 = 64;

/// When a position is joined to another one, and to which.
#[derive(Clone, Copy)]
struct Link {
    /// The entry that joins it; [`NEVER`] for one that stays.
    entry: u32,
    onto: u32,
}

/// The smallest cursor at which two corners share a position, per triangle.
///
/// `parents` are the positions that the removed ones move onto, by number.
pub(super) fn find(mesh: &Mesh, parents: &[u32], max_depth: u32) -> Vec<u32> {
    let links = if max_depth <= MAX_CLIMBED_DEPTH {
        own_links(mesh.positions.len() as u32, parents)
    } else {
        balanced_links(mesh.positions.len() as u32, parents)
    };
    mesh.triangles.iter().map(|&corners| death(&links, mesh.corner_positions(corners))).collect()
}

fn own_links(count: u32, parents: &[u32]) -> Vec<Link> {
    let fixed = count - parents.len() as u32;
    let stays = (0..fixed).map(|position| Link { entry: NEVER, onto: position });
    let moves = parents.iter().zip(fixed..);
    stays.chain(moves.map(|(&onto, position)| Link { entry: count - 1 - position, onto })).collect()
}

/// The same classes, joined by size, so that chains are at most log2 V long
/// whatever chains the optimiser makes.
fn balanced_links(count: u32, parents: &[u32]) -> Vec<Link> {
    let fixed = count - parents.len() as u32;
    let stays = |position| Link { entry: NEVER, onto: position };
    let mut links: Vec<Link> = (0..count).map(stays).collect();
    let mut size = vec![1_u32; count as usize];
    // The root, in this forest, of the class that a survivor stands for.
    let mut root: Vec<u32> = (0..count).collect();
    for (removed, &kept) in (fixed..count).zip(parents).rev() {
        let (a, b) = (root[removed as usize], root[kept as usize]);
        let (low, high) = if size[a as usize] < size[b as usize] { (a, b) } else { (b, a) };
        links[low as usize] = Link { entry: count - 1 - removed, onto: high };
        size[high as usize] += size[low as usize];
        root[kept as usize] = high;
    }
    links
}

/// Follows the corners in the order in which entries join them, until two meet.
fn death(links: &[Link], mut corners: [u32; 3]) -> u32 {
    loop {
        let [a, b, c] = corners.map(|corner| links[corner as usize]);
        let next = match (a.entry.cmp(&b.entry), a.entry.cmp(&c.entry), b.entry.cmp(&c.entry)) {
            (Ordering::Less, Ordering::Less, _) => 0,
            (_, _, Ordering::Less) => 1,
            _ => 2,
        };
        let link = [a, b, c][next];
        if link.entry == NEVER {
            return NEVER;
        }
        if corners.contains(&link.onto) {
            return link.entry + 1;
        }
        corners[next] = link.onto;
    }
}
