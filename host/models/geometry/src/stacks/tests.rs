//! Stacks against the process as the paper words it.

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::{Collapse, CollapseSequence, RawPrimitive, weld};

/// Makes a strip of `n` quads along x.
fn strip(n: u32) -> Mesh {
    let positions = (0..=n).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(x as f32, y, 0.0))).collect();
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

/// Runs the process as the paper words it: one edge collapse after the other.
fn sequential(mesh: &Mesh, entries: &[Collapse]) -> Vec<[Vec3; 3]> {
    let mut triangles = mesh.topology().triangles;
    for entry in entries {
        for corner in triangles.iter_mut().flatten() {
            if *corner == entry.removed {
                *corner = entry.kept;
            }
        }
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    }
    triangles.iter().map(|t| t.map(|p| mesh.positions[p as usize])).collect()
}

/// Returns the live triangles as points: positions are renumbered.
fn points(resolved: &ResolvedMesh<'_>) -> Vec<[Vec3; 3]> {
    let at = |p: u32| resolved.stacks.mesh.positions[p as usize];
    resolved.position_triangles().map(|t| t.map(at)).collect()
}

#[test]
fn death_is_the_first_cursor_at_which_two_corners_meet() {
    let mesh = strip(1);
    let [[a, b, c], _] = [mesh.topology().triangles[0], mesh.topology().triangles[1]];
    let fourth = (0..4).find(|p| ![a, b, c].contains(p)).unwrap();
    let stacks = CollapseStacks::build(mesh.clone(), &sequence(&mesh, &[(fourth, b), (c, a)]));
    assert_eq!(stacks.removal_cursor(1), 1, "loses its own corner first");
    assert_eq!(stacks.removal_cursor(0), 2);
    assert_eq!(stacks.resolve(0).triangles.len(), 2);
    assert_eq!(stacks.resolve(1).triangles.len(), 1);
    assert_eq!(stacks.resolve(2).triangles.len(), 0);
}

#[test]
fn without_collapses_everything_lives_for_ever() {
    let mesh = strip(3);
    let stacks = CollapseStacks::build(mesh.clone(), &sequence(&mesh, &[]));
    assert_eq!(stacks.resolve(0).triangles, mesh.triangles);
    assert_eq!(stacks.removal_cursor(0), NEVER_REMOVED);
    assert_eq!(stacks.max_depth(), 0);
}

#[test]
fn chains_have_the_depth_of_their_length() {
    let mesh = strip(3);
    let chain: Vec<(u32, u32)> = (0..7).map(|i| (i, i + 1)).collect();
    let stacks = CollapseStacks::build(mesh.clone(), &sequence(&mesh, &chain));
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
    let stacks = CollapseStacks::build(mesh.clone(), &sequence(&mesh, &[(x, zero)]));
    let standing = stacks.representative_wedges(1);
    let section = &stacks.mesh().wedges.section;
    for (wedge, &stands) in standing.iter().enumerate() {
        assert_eq!(section[wedge], section[stands as usize]);
    }
}

#[test]
fn a_long_chain_dies_as_the_sequential_process_says() {
    let mesh = strip(60);
    let chain: Vec<(u32, u32)> = (0..121).map(|i| (i, i + 1)).collect();
    let sequence = sequence(&mesh, &chain);
    let stacks = CollapseStacks::build(mesh.clone(), &sequence);
    assert_eq!(stacks.max_depth(), 121);
    for cursor in 0..=121 {
        let expected = sequential(&mesh, &sequence.entries()[..cursor]);
        assert_eq!(points(&stacks.resolve(cursor as u32)), expected);
    }
}

#[test]
fn errors_are_bounds_in_steps() {
    let mesh = strip(5000);
    let entries = (0..10_000).map(|i| Collapse { removed: i, kept: i + 1, error: i as f32 });
    let sequence = CollapseSequence::new(entries.collect(), 10_002).unwrap();
    let stacks = CollapseStacks::build(mesh, &sequence);
    assert_eq!(stacks.error_at(0), 0.0);
    for cursor in 1..=10_000 {
        let (bound, exact) = (stacks.error_at(cursor), (cursor - 1) as f32);
        assert!(bound >= exact && bound <= exact + 3.0, "{bound} at {cursor}");
    }
    assert_eq!(stacks.error_at(u32::MAX), 9999.0);
}

#[test]
fn stacks_put_together_again_are_the_same() {
    let mesh = strip(9);
    let sequence = sequence(&mesh, &[(3, 4), (0, 1), (4, 1), (7, 9)]);
    let built = CollapseStacks::build(mesh.clone(), &sequence);
    let ranks = removal_ranks(&sequence);
    let again = CollapseStacks::restore(&mut mesh.clone(), &ranks, built.tables().clone()).unwrap();
    assert_eq!(again.mesh(), built.mesh());
    assert_eq!(again.tables(), built.tables());
    let collapses: Vec<_> = built.collapses().collect();
    let expected =
        sequence.entries().iter().map(|e| (ranks[e.removed as usize], ranks[e.kept as usize]));
    assert_eq!(collapses, expected.collect::<Vec<_>>());
}

proptest! {
    /// Tables from elsewhere are refused or usable, never endless.
    #[test]
    fn tables_of_another_mesh_do_no_harm(
        parent_start in prop::collection::vec(0_u32..8, 0..9),
        parent_offset in prop::collection::vec(0_u8..3, 6),
        removal_cursor in prop::collection::vec(0_u32..9, 4),
        swap in (0_usize..6, 0_usize..6),
    ) {
        let mut mesh = strip(2);
        let mut ranks: Vec<u32> = (0..6).collect();
        ranks.swap(swap.0, swap.1);
        let tables = StackTables { parent_start, parent_offset, removal_cursor, ..Default::default() };
        if let Ok(stacks) = CollapseStacks::restore(&mut mesh, &ranks, tables) {
            for cursor in 0..8 {
                stacks.resolve(cursor);
            }
        }
    }

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
        let stacks = CollapseStacks::build(mesh.clone(), &sequence);
        for cursor in (0..=pairs.len()).chain((0..pairs.len()).rev()) {
            let resolved = stacks.resolve(cursor as u32);
            let expected = sequential(&mesh, &sequence.entries()[..cursor]);
            prop_assert_eq!(points(&resolved), expected);
            prop_assert_eq!(stacks.live(cursor as u32).count(), resolved.triangles.len());
        }
    }
}

#[test]
fn corners_whose_ancestors_are_many_still_find_them() {
    // Spokes from the first of a chain, which moves on from one to the next: to climb
    // it by every spoke would take more steps than there are wedges.
    const SPOKES: u32 = 50;
    const CHAIN: u32 = 400;
    let on_chain = |i: u32| Vec3::new(i as f32, 0.0, 0.0);
    let on_rim = |i: u32| Vec3::new(-1.0 - (i * i) as f32, i as f32, 1.0);
    let positions = (0..CHAIN).map(on_chain).chain((0..=SPOKES).map(on_rim)).collect();
    let spokes = (0..SPOKES).map(|i| [0, CHAIN + i, CHAIN + i + 1]);
    let links = (1..CHAIN).map(|i| [i - 1, i, CHAIN]);
    let triangles = spokes.chain(links).collect();
    let primitive = RawPrimitive { positions, triangles, ..Default::default() };
    let mesh = weld(&[primitive]).unwrap().0;
    let pairs: Vec<(u32, u32)> = (1..CHAIN).map(|i| (i - 1, i)).collect();
    let sequence = sequence(&mesh, &pairs);
    let stacks = CollapseStacks::build(mesh.clone(), &sequence);
    let last = stacks.resolve(CHAIN - 1);
    assert_eq!(last.triangles.len(), SPOKES as usize);
    assert_eq!(points(&last), sequential(&mesh, sequence.entries()));
}

#[test]
fn the_cursor_within_an_error_is_the_farthest_that_keeps_it() {
    let mesh = strip(20);
    let count = mesh.positions.len() as u32;
    let entry = |removed: u32| Collapse {
        removed,
        kept: removed - 1,
        error: ((count - removed) / 4) as f32,
    };
    let sequence = CollapseSequence::new((1..count).rev().map(entry).collect(), count).unwrap();
    let stacks = CollapseStacks::build(mesh, &sequence);
    for error in [0.0, 0.5, 1.0, 3.9, 4.0, 100.0] {
        let cursor = stacks.cursor_for_error(error);
        assert!(stacks.error_at(cursor) <= error);
        let is_last = cursor == stacks.collapse_count();
        assert!(is_last || stacks.error_at(cursor + 1) > error, "{error}: {cursor}");
    }
    assert_eq!(stacks.cursor_for_error(-1.0), 0);
    assert_eq!(stacks.cursor_for_error(f32::NAN), 0);
}
