//! Death indices: when triangles lose a corner.

use super::NEVER;
use crate::Mesh;

/// Chains of ancestors up to this length are climbed as they are.
const MAX_CLIMBED_DEPTH: u32 = 64;

/// When a position is joined to another one, in the upper half, and to which,
/// in the lower. The least of some links is the one that is joined first.
type Link = u64;

fn link(entry: u32, onto: u32) -> Link {
    u64::from(entry) << 32 | u64::from(onto)
}

/// Of a position that is never joined to another one.
fn stays(position: u32) -> Link {
    link(NEVER, position)
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
    let moves = parents.iter().zip(fixed..);
    let moves = moves.map(|(&onto, position)| link(count - 1 - position, onto));
    (0..fixed).map(stays).chain(moves).collect()
}

/// The same classes, joined by size, so that chains are at most log2 V long
/// whatever chains the optimiser makes.
fn balanced_links(count: u32, parents: &[u32]) -> Vec<Link> {
    let fixed = count - parents.len() as u32;
    let mut links: Vec<Link> = (0..count).map(stays).collect();
    let mut size = vec![1_u32; count as usize];
    // The root, in this forest, of the class that a survivor stands for.
    let mut root: Vec<u32> = (0..count).collect();
    for (removed, &kept) in (fixed..count).zip(parents).rev() {
        let (a, b) = (root[removed as usize], root[kept as usize]);
        let (low, high) = if size[a as usize] < size[b as usize] { (a, b) } else { (b, a) };
        links[low as usize] = link(count - 1 - removed, high);
        size[high as usize] += size[low as usize];
        root[kept as usize] = high;
    }
    links
}

/// Follows the corners in the order in which entries join them, until two meet.
/// Which corner is next cannot be guessed, so nothing branches on it.
fn death(links: &[Link], [mut a, mut b, mut c]: [u32; 3]) -> u32 {
    let of = |position: u32| links[position as usize];
    let [mut a_link, mut b_link, mut c_link] = [of(a), of(b), of(c)];
    loop {
        let first = a_link.min(b_link).min(c_link);
        let (entry, onto) = ((first >> 32) as u32, first as u32);
        if entry == NEVER {
            return NEVER;
        }
        if onto == a || onto == b || onto == c {
            return entry + 1;
        }
        let onto_link = of(onto);
        for (corner, link) in [(&mut a, &mut a_link), (&mut b, &mut b_link), (&mut c, &mut c_link)]
        {
            let moves = *link == first;
            *corner = if moves { onto } else { *corner };
            *link = if moves { onto_link } else { *link };
        }
    }
}
