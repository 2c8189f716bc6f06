use std::collections::BTreeSet;

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::surface_deviation::{MAX_ERROR_RATIO, distance_squared};
use crate::{CollapseStacks, RawPrimitive, weld};

/// Fans of different sizes, each an island about a hub of its own.
fn fans(sizes: &[f32]) -> Mesh {
    let fan = |(place, &size): (usize, &f32)| {
        let hub = Vec3::X * place as f32 * 1000.0;
        let rim = |i: u32| hub + Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0) * size;
        RawPrimitive {
            positions: std::iter::once(hub).chain((0..6).map(rim)).collect(),
            triangles: (1..6).map(|i| [0, i, i + 1]).collect(),
            ..Default::default()
        }
    };
    weld(&sizes.iter().enumerate().map(fan).collect::<Vec<_>>()).unwrap().0
}

/// Collapses each fan onto its hub, in the order of fans, then all hubs onto the first.
fn onto_hubs(mesh: &Mesh, error: f32) -> CollapseSequence {
    let hub_of = |position: usize| position / 7 * 7;
    let onto = |removed: usize, kept: usize| Collapse {
        removed: removed as u32,
        kept: kept as u32,
        error,
    };
    let count = mesh.positions.len();
    let spokes = (0..count).filter(|p| p % 7 != 0).map(|p| onto(p, hub_of(p)));
    let hubs = (7..count).step_by(7).map(|p| onto(p, 0));
    CollapseSequence::new(spokes.chain(hubs).collect(), count as u32).unwrap()
}

#[test]
fn small_islands_go_first_and_errors_go_by_their_sizes() {
    let mesh = fans(&[4.0, 1.0, 2.0]);
    let sequence = onto_hubs(&mesh, 100.0).ordered_by_error(&mesh);
    assert_eq!(sequence.len(), 18, "hubs stay");
    let of = |fan: u32| -> Vec<f32> {
        let of_fan = sequence.entries().iter().filter(|e| e.kept / 7 == fan);
        of_fan.map(|entry| entry.error).collect()
    };
    for (fan, size) in [(0, 4.0), (2, 2.0)] {
        for (error, of_unit) in of(fan).into_iter().zip(of(1)) {
            assert!((error - of_unit * size).abs() < 1e-3, "{:?} {:?}", of(fan), of(1));
        }
    }
    let stacks = CollapseStacks::build(mesh, &sequence);
    let left =
        [0.1, 1.3, 2.6, 6.0].map(|error| stacks.live_triangles(stacks.cursor_for_error(error)));
    assert_eq!(left, [15, 9, 4, 0]);
}

#[test]
fn the_optimisers_error_counts_where_it_is_less() {
    let mesh = fans(&[4.0, 1.0]);
    let sequence = onto_hubs(&mesh, 0.25).ordered_by_error(&mesh);
    // Two of the five triangles go; what is left vanishes with the whole.
    let least = |fan: u32| sequence.entries().iter().filter(move |e| e.kept / 7 == fan);
    for (fan, size) in [(0, 4.0), (1, 1.0_f32)] {
        let errors: Vec<f32> = least(fan).map(|entry| entry.error).collect();
        let seen = *errors.last().unwrap();
        assert!(seen > size * 0.8 && seen < size * 1.3, "{seen}");
        assert!(errors.iter().all(|&error| error == 0.25 || error == seen));
        assert_eq!(errors[0], 0.25);
    }
}

#[test]
fn a_long_strut_outlives_its_thickness() {
    // 10 m long, 0.1 m thick: both ends shrink to a point at little error.
    let at = |i: u32| {
        let end = if i < 3 { 0.0 } else { 10.0 };
        Vec3::new(end, (i % 3) as f32 * 0.1, ((i % 3) * (i % 3)) as f32 * 0.05)
    };
    let side = |a: u32, b: u32| [[a, b, b + 3], [a, b + 3, a + 3]];
    let sides = [side(0, 1), side(1, 2), side(2, 0)].concat();
    let triangles = [&sides[..], &[[0, 2, 1], [3, 4, 5]]].concat();
    let strut =
        RawPrimitive { positions: (0..6).map(at).collect(), triangles, ..Default::default() };
    let mesh = weld(&[strut]).unwrap().0;
    let number = |i| mesh.positions.iter().position(|&p| p == at(i)).unwrap() as u32;
    let onto =
        |removed, kept| Collapse { removed: number(removed), kept: number(kept), error: 10.0 };
    let entries = vec![onto(1, 0), onto(4, 3), onto(2, 0), onto(5, 3), onto(3, 0)];
    let sequence = CollapseSequence::new(entries, 6).unwrap().ordered_by_error(&mesh);
    let stacks = CollapseStacks::build(mesh, &sequence);
    let left = |error| stacks.live_triangles(stacks.cursor_for_error(error));
    assert!(left(0.01) == 8 && left(0.5) >= 4, "{} {}", left(0.01), left(0.5));
    assert_eq!(left(2.0), 0);
}

/// Makes two plates of different sections side by side, each of so many squares a side.
fn plates(side: u32) -> Mesh {
    let plate = |material: u32| RawPrimitive {
        positions: (0..=side)
            .flat_map(|y| (0..=side).map(move |x| [x + material * side, y]))
            .map(|at| Vec3::new(at[0] as f32, at[1] as f32, 0.0))
            .collect(),
        triangles: (0..side)
            .flat_map(|y| (0..side).map(move |x| y * (side + 1) + x))
            .flat_map(|a| [[a, a + 1, a + side + 1], [a + 1, a + side + 2, a + side + 1]])
            .collect(),
        material: Some(material),
        ..Default::default()
    };
    weld(&[plate(0), plate(1)]).unwrap().0
}

#[test]
fn what_slides_along_its_own_surface_is_no_error_but_colours_are() {
    let mesh = plates(4);
    let at = |x: f32, y: f32| {
        mesh.positions.iter().position(|&p| p == Vec3::new(x, y, 0.0)).unwrap() as u32
    };
    let onto = |removed, kept| Collapse { removed, kept, error: 100.0 };
    let error = |entries: Vec<Collapse>| {
        let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
        sequence.ordered_by_error(&mesh).entries().last().unwrap().error
    };
    let inside = onto(at(1.0, 1.0), at(2.0, 1.0));
    let corner = onto(at(0.0, 0.0), at(0.0, 1.0));
    let between = onto(at(4.0, 2.0), at(3.0, 2.0));
    let along = onto(at(4.0, 2.0), at(4.0, 3.0));
    assert_eq!([error(vec![inside]), error(vec![along])], [0.0; 2]);
    for collapse in [corner, between] {
        let error = error(vec![collapse]);
        assert!(error > 0.2 && error < 1.0, "{error} for {collapse:?}");
    }
}

#[test]
fn what_covers_a_hole_is_an_error() {
    // A frame of eight triangles around a hole, 10 m wide.
    let at = |i: u32| {
        let (size, i) = if i < 4 { (5.0, i) } else { (15.0, i - 4) };
        Vec3::new(
            [size, -size, -size, size][i as usize],
            [size, size, -size, -size][i as usize],
            0.0,
        )
    };
    let side = |i: u32| [[i, i + 4, (i + 1) % 4 + 4], [i, (i + 1) % 4 + 4, (i + 1) % 4]];
    let frame = RawPrimitive {
        positions: (0..8).map(at).collect(),
        triangles: (0..4).flat_map(side).collect(),
        ..Default::default()
    };
    let mesh = weld(&[frame]).unwrap().0;
    let number = |i| mesh.positions.iter().position(|&p| p == at(i)).unwrap() as u32;
    let closing = Collapse { removed: number(0), kept: number(2), error: 100.0 };
    let sequence = CollapseSequence::new(vec![closing], 8).unwrap().ordered_by_error(&mesh);
    assert!(sequence.entries()[0].error > 0.5, "{:?}", sequence.entries());
}

#[test]
fn what_is_apart_does_not_wait() {
    // One end of a plate is torn off before the other is touched where it is flat.
    let mesh = plates(8);
    let at = |x: f32, y: f32| {
        mesh.positions.iter().position(|&p| p == Vec3::new(x, y, 0.0)).unwrap() as u32
    };
    let onto = |removed, kept| Collapse { removed, kept, error: 100.0 };
    let torn = onto(at(0.0, 0.0), at(1.0, 1.0));
    let [flat, beside] = [onto(at(12.0, 4.0), at(13.0, 4.0)), onto(at(1.0, 1.0), at(2.0, 1.0))];
    let entries = vec![torn, flat, beside];
    let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
    let sorted = sequence.ordered_by_error(&mesh);
    let pairs: Vec<_> = sorted.entries().iter().map(|e| (e.removed, e.kept)).collect();
    assert_eq!(pairs, [flat, torn, beside].map(|e| (e.removed, e.kept)));
    assert_eq!(sorted.entries()[1].error, sorted.entries()[2].error, "it waits");
}

#[test]
fn faces_keep_their_shading_for_as_long_as_they_are_seen() {
    // A pyramid of little height: its top goes, and sides are shaded as a neighbour of theirs
    // from then on.
    const SIDES: u32 = 8;
    const TOP: Vec3 = Vec3::new(0.0, 1e-4, 0.0);
    let corner = |i: u32| {
        let angle = (i % SIDES) as f32 / SIDES as f32 * std::f32::consts::TAU;
        Vec3::new(angle.sin(), 0.0, angle.cos())
    };
    let error = |lean: f32| {
        let normal = |i| (Vec3::Y + (corner(i) + corner(i + 1)) * lean).normalize();
        let pyramid = RawPrimitive {
            positions: (0..SIDES).flat_map(|i| [TOP, corner(i), corner(i + 1)]).collect(),
            normals: (0..SIDES).flat_map(|i| [normal(i); 3]).collect(),
            triangles: (0..SIDES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Default::default()
        };
        let mesh = weld(&[pyramid]).unwrap().0;
        let number = |at| mesh.positions.iter().position(|&p| p == at).unwrap() as u32;
        let [removed, kept] = [number(TOP), number(corner(0))];
        let collapse = Collapse { removed, kept, error: 100.0 };
        let sequence = CollapseSequence::new(vec![collapse], SIDES + 1).unwrap();
        sequence.ordered_by_error(&mesh).entries()[0].error
    };
    assert!(error(0.0) < 1e-3, "{}", error(0.0));
    assert!(error(0.5) > 0.05, "{}", error(0.5));
}

#[test]
fn something_slender_keeps_three_sides_until_it_vanishes() {
    const SIDES: u32 = 8;
    let at = |i: u32| {
        let angle = (i % SIDES) as f32 / SIDES as f32 * std::f32::consts::TAU;
        Vec3::new((i / SIDES) as f32 * 10.0, angle.cos() * 0.01, angle.sin() * 0.01)
    };
    let side = |i: u32| {
        let next = (i + 1) % SIDES;
        [[i, next, i + SIDES], [next, next + SIDES, i + SIDES]]
    };
    let wire = RawPrimitive {
        positions: (0..2 * SIDES).map(at).collect(),
        triangles: (0..SIDES).flat_map(side).collect(),
        ..Default::default()
    };
    let mesh = weld(&[wire]).unwrap().0;
    let number = |i| mesh.positions.iter().position(|&p| p == at(i)).unwrap() as u32;
    let onto = |end: u32, [removed, kept]: [u32; 2]| {
        let [removed, kept] = [end + removed, end + kept].map(number);
        Collapse { removed, kept, error: 100.0 }
    };
    // Three sides are left at each end, and then one.
    let turns = [[1, 0], [2, 3], [4, 3], [5, 6], [7, 6], [3, 0], [6, 0]];
    let at_ends = |turn| [0, SIDES].map(|end| onto(end, turn));
    let entries: Vec<Collapse> = turns.into_iter().flat_map(at_ends).collect();
    let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
    let sequence = sequence.ordered_by_error(&mesh);
    let stacks = CollapseStacks::build(mesh, &sequence);
    let left = [0.0, 0.1, 0.3, 1.0].map(|e| stacks.live_triangles(stacks.cursor_for_error(e)));
    assert_eq!(left, [16, 6, 6, 0]);
}

#[test]
fn a_shape_that_gets_thinner_has_a_greater_error_than_a_rough_one() {
    // A sheet with bumps, which go first; then the points between them.
    const COLUMNS: u32 = 9;
    const HEIGHT: f32 = 0.2;
    let error = |heights: [f32; 7]| {
        let at = |i: u32| {
            let (x, y) = (i / 3, i % 3);
            let is_inner = y == 1 && x > 0 && x < COLUMNS - 1;
            let height = if is_inner { heights[x as usize - 1] * HEIGHT } else { 0.0 };
            Vec3::new(x as f32, y as f32, height)
        };
        let quads = (0..COLUMNS - 1).flat_map(|x| [3 * x, 3 * x + 1]);
        let sheet = RawPrimitive {
            positions: (0..3 * COLUMNS).map(at).collect(),
            normals: vec![Vec3::Z; 3 * COLUMNS as usize],
            triangles: quads.flat_map(|a| [[a, a + 3, a + 1], [a + 1, a + 3, a + 4]]).collect(),
            ..Default::default()
        };
        let mesh = weld(&[sheet]).unwrap().0;
        let number = |i| mesh.positions.iter().position(|&p| p == at(i)).unwrap() as u32;
        let onto = |[x, kept]: [u32; 2]| {
            let [removed, kept] = [x, kept].map(|x| number(3 * x + 1));
            Collapse { removed, kept, error: 100.0 }
        };
        let entries = [[1, 0], [3, 2], [5, 4], [7, 6], [2, 0], [4, 0], [6, 0]].map(onto).to_vec();
        let sequence = CollapseSequence::new(entries, 3 * COLUMNS).unwrap();
        sequence.ordered_by_error(&mesh).entries().last().unwrap().error
    };
    let thinner = error([1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    let rough = error([1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0]);
    assert!(thinner > 1.01 * rough, "{thinner} {rough}");
    assert!(thinner < HEIGHT * MAX_ERROR_RATIO, "{thinner}");
    let thicker = error([-1.0, 0.0, -1.0, 0.0, -1.0, 0.0, -1.0]);
    assert!((thicker - thinner).abs() < 1e-3, "{thicker} {thinner}");
}

proptest! {
    /// Every vertex stays within twice the entry's error of the remaining surface, and every island
    /// keeps its collapses.
    #[test]
    fn vertices_stay_within_the_error(
        sizes in prop::collection::vec(0.1_f32..9.0, 1..6),
        picks in prop::collection::vec((any::<u32>(), any::<u32>()), 0..60),
    ) {
        let mesh = fans(&sizes);
        let mut alive: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let mut entries = Vec::new();
        for (a, b) in picks {
            if alive.len() < 2 { break; }
            let removed = alive.swap_remove(a as usize % alive.len());
            let kept = alive[b as usize % alive.len()];
            entries.push(Collapse { removed, kept, error: 1e6 });
        }
        let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
        let sorted = sequence.ordered_by_error(&mesh);
        let stacks = CollapseStacks::build(mesh.clone(), &sorted);
        for (cursor, entry) in (1..).zip(sorted.entries()) {
            let left: Vec<[Vec3; 3]> = stacks
                .resolve(cursor)
                .position_triangles()
                .map(|corners| corners.map(|p| stacks.mesh().positions[p as usize]))
                .collect();
            for position in 0..mesh.positions.len() {
                let of_island = |corners: &&[Vec3; 3]| {
                    (corners[0].x / 1000.0).round() as usize == position / 7
                };
                let point = mesh.positions[position];
                let distances = left.iter().filter(of_island);
                let distances = distances.map(|&corners| distance_squared(point, corners));
                let nearest = distances.fold(f32::INFINITY, f32::min).sqrt();
                prop_assert!(nearest.is_infinite() || nearest <= entry.error * MAX_ERROR_RATIO * 1.001 + 1e-4);
            }
        }
        for island in 0..sizes.len() as u32 {
            let of = |s: &CollapseSequence| -> BTreeSet<(u32, u32)> {
                let pairs = s.entries().iter().map(|e| (e.removed, e.kept));
                let of_island = pairs.filter(|&(r, k)| r / 7 == island && k / 7 == island);
                of_island.collect()
            };
            prop_assert_eq!(of(&sequence), of(&sorted));
        }
    }
}
