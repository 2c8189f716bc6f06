//! Triangle removal: the cursor at which each triangle loses a corner and degenerates.

use super::NEVER_REMOVED;
use crate::{CollapseSequence, Mesh};

/// Chains of ancestors up to this length are climbed as they are.
const MAX_DIRECT_DEPTH: u32 = 64;

/// Link of a position to the one that it is joined to. The upper half holds the entry that joins
/// them, the lower the position. The least of some links is joined first.
type Link = u64;

fn pack_link(entry: u32, onto: u32) -> Link {
    u64::from(entry) << 32 | u64::from(onto)
}

/// Returns the link of a position that is never joined to another one.
fn unlinked(position: u32) -> Link {
    pack_link(NEVER_REMOVED, position)
}

/// Computes the removal cursor of each triangle, for a sequence of any depth.
pub(crate) fn removal_cursors(mesh: &Mesh, sequence: &CollapseSequence) -> Vec<u32> {
    find_removal_cursors(mesh, sequence, u32::MAX)
}

/// Finds the smallest cursor at which two corners share a position, per triangle.
///
/// Positions are as imported: those of a triangle are near each other, and so
/// are their links.
pub(super) fn find_removal_cursors(
    mesh: &Mesh,
    sequence: &CollapseSequence,
    max_depth: u32,
) -> Vec<u32> {
    let links = if max_depth <= MAX_DIRECT_DEPTH {
        direct_links(sequence)
    } else {
        balanced_links(sequence)
    };
    mesh.triangles
        .iter()
        .map(|&corners| removal_cursor(&links, mesh.corner_positions(corners)))
        .collect()
}

fn direct_links(sequence: &CollapseSequence) -> Vec<Link> {
    let mut links: Vec<Link> = (0..sequence.position_count()).map(unlinked).collect();
    for (entry, collapse) in (0..).zip(sequence.entries()) {
        links[collapse.removed as usize] = pack_link(entry, collapse.kept);
    }
    links
}

/// Builds balanced links of the same classes, joined by size, so that chains are at most log2 V
/// long whatever the optimiser made.
fn balanced_links(sequence: &CollapseSequence) -> Vec<Link> {
    let count = sequence.position_count();
    let mut links: Vec<Link> = (0..count).map(unlinked).collect();
    let mut size = vec![1_u32; count as usize];
    // The root, in this forest, of the class that a survivor stands for.
    let mut root: Vec<u32> = (0..count).collect();
    for (entry, collapse) in (0..).zip(sequence.entries()) {
        let (a, b) = (root[collapse.removed as usize], root[collapse.kept as usize]);
        let (low, high) = if size[a as usize] < size[b as usize] { (a, b) } else { (b, a) };
        links[low as usize] = pack_link(entry, high);
        size[high as usize] += size[low as usize];
        root[collapse.kept as usize] = high;
    }
    links
}

/// Follows the corners in the order in which entries join them, until two meet.
/// Which corner is next cannot be guessed, so nothing branches on it.
fn removal_cursor(links: &[Link], [mut a, mut b, mut c]: [u32; 3]) -> u32 {
    let of = |position: u32| links[position as usize];
    let [mut a_link, mut b_link, mut c_link] = [of(a), of(b), of(c)];
    loop {
        let first = a_link.min(b_link).min(c_link);
        let (entry, onto) = ((first >> 32) as u32, first as u32);
        if entry == NEVER_REMOVED {
            return NEVER_REMOVED;
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
