//! The greedy orders against the plainest form of themselves, and their
//! promises checked by playing the collapses again.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;
use crate::reference::soup;
use crate::vector::{cross, dot, point, sub};
use crate::{Order, collapse_list, edges, sort, weights};

const ORDERS: [Order; 2] = [Order::Guarded, Order::Reweighted];

fn run(mesh: Mesh<'_>, order: Order) -> Vec<Collapse> {
    let progress = &mut Progress::detached();
    collapse_list(mesh, &Interpretation::BUSBAR, order, 4, progress).unwrap().collapses
}

/// Collapses at each step the legal edge of the least key, found by exhaustive search.
fn plain(mesh: Mesh<'_>, order: Order) -> Vec<(u32, u32)> {
    let interpretation = &Interpretation::BUSBAR;
    let edges = edges::find(&mesh, 1);
    let measured = weights::measure_all(&mesh, &edges, interpretation, 1);
    let coefficients = measured.coefficients(interpretation);
    let weights = measured.weigh(&coefficients, 1);
    let mut key_of: BTreeMap<[u32; 2], u64> = match order {
        Order::Reweighted => {
            let bits = weights.iter().map(|w| w.to_bits());
            edges.ends.iter().copied().zip(bits).collect()
        }
        _ => {
            let sorted = sort::sort(&weights);
            (0..).zip(sorted).map(|(rank, edge)| (edges.ends[edge as usize], rank)).collect()
        }
    };
    let mut triangles = mesh.triangles.to_vec();
    let mut classes = Classes::new(mesh.positions.len());
    let mut collapses = Vec::new();
    loop {
        let now = Mesh { positions: mesh.positions, triangles: &triangles, wedges: None };
        let mut candidates: Vec<_> = key_of.iter().map(|(&ends, &key)| (key, ends)).collect();
        candidates.sort();
        let directions = candidates.into_iter().flat_map(|(_, [a, b])| {
            let (removed, kept) = classes.rank(a, b);
            [(removed, kept), (kept, removed)]
        });
        let surface = Surface::new(now);
        let Some((removed, kept)) = directions.into_iter().find(|&(r, k)| is_legal(&surface, r, k))
        else {
            return collapses;
        };
        collapses.push((removed, kept));
        classes.merge(removed, kept);
        triangles = moved(&triangles, removed, kept);
        let now = Mesh { positions: mesh.positions, triangles: &triangles, wedges: None };
        let live = edges::find(&now, 1);
        let mut next_key_of: BTreeMap<[u32; 2], u64> = BTreeMap::new();
        for (ends, key) in key_of {
            let [a, b] = ends.map(|v| if v == removed { kept } else { v });
            let least = next_key_of.entry([a.min(b), a.max(b)]).or_insert(key);
            *least = key.min(*least);
        }
        next_key_of.retain(|ends, _| live.ends.binary_search(ends).is_ok());
        if order == Order::Reweighted {
            for (&ends, key) in next_key_of.iter_mut().filter(|(ends, _)| ends.contains(&kept)) {
                let edge = live.ends.binary_search(&ends).unwrap();
                let factors = measure(&now, ends, live.sides(edge), interpretation);
                *key = coefficients.weigh(&factors).to_bits();
            }
        }
        key_of = next_key_of;
    }
}

fn is_legal(surface: &Surface<'_>, removed: u32, kept: u32) -> bool {
    let (mut removed_ring, mut kept_ring) = (Ring::default(), Ring::default());
    surface.ring(removed, &mut removed_ring);
    surface.ring(kept, &mut kept_ring);
    let (removed_ring, kept_ring) = (&removed_ring, &kept_ring);
    Candidate { removed, removed_ring, kept, kept_ring }.is_legal(surface)
}

/// Returns the triangles that live after a collapse.
fn moved(triangles: &[[u32; 3]], removed: u32, kept: u32) -> Vec<[u32; 3]> {
    let live = triangles.iter().filter(|t| !(t.contains(&removed) && t.contains(&kept)));
    live.map(|t| t.map(|v| if v == removed { kept } else { v })).collect()
}

/// Replays collapses: no face flips or flattens, errors never decrease, and a closed manifold keeps
/// its Euler number.
#[track_caller]
fn check_promises(mesh: Mesh<'_>, collapses: &[Collapse], is_closed: bool) {
    assert!(collapses.is_sorted_by(|a, b| a.error <= b.error));
    let mut triangles = mesh.triangles.to_vec();
    let euler = euler_number(mesh.positions.len(), &triangles, is_closed);
    for (step, c) in (1..).zip(collapses) {
        let normal = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|v| point(&mesh, v));
            cross(sub(b, a), sub(c, a))
        };
        for t in triangles.iter().filter(|t| t.contains(&c.removed) && !t.contains(&c.kept)) {
            let after = normal(t.map(|v| if v == c.removed { c.kept } else { v }));
            let before = normal(*t);
            if dot(before, before) > 0.0 {
                assert!(dot(after, after) > 0.0, "step {step} flattens {t:?}");
                assert!(dot(before, after) >= 0.0, "step {step} flips {t:?}");
            }
        }
        triangles = moved(&triangles, c.removed, c.kept);
        let euler_now = euler_number(mesh.positions.len() - step, &triangles, is_closed);
        assert!(!is_closed || euler_now == euler, "step {step}");
    }
}

/// Computes V - E + T, after checking that the mesh is closed, manifold at its edges, and without
/// double faces.
#[track_caller]
fn euler_number(vertices: usize, triangles: &[[u32; 3]], is_closed: bool) -> i64 {
    let mut sides: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for (v, w) in [(a, b), (b, c), (c, a)] {
            *sides.entry([v.min(w), v.max(w)]).or_default() += 1;
        }
    }
    if is_closed {
        assert!(sides.values().all(|&count| count == 2), "an edge without two triangles");
        let faces: BTreeSet<_> = triangles.iter().map(|&t| sorted(t)).collect();
        assert_eq!(faces.len(), triangles.len(), "double faces");
    }
    vertices as i64 - sides.len() as i64 + triangles.len() as i64
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort();
    triangle
}

/// Makes a torus of `n` by `m` cells with bumps, closed and of genus 1.
fn torus(n: u32, m: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let place = |i: u32| {
        let around = f64::from(i / m) / f64::from(n) * std::f64::consts::TAU;
        let across = f64::from(i % m) / f64::from(m) * std::f64::consts::TAU;
        let small = 1.0 + 0.15 * f64::from((i * 7919) % 13) / 13.0;
        let large = 3.0 + small * libm::cos(across);
        let [x, y] = [libm::cos(around), libm::sin(around)].map(|c| (large * c) as f32);
        [x, y, (small * libm::sin(across)) as f32]
    };
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    ((0..n * m).map(place).collect(), triangles.collect())
}

#[test]
fn a_closed_surface_stays_closed_and_unfolded() {
    let (positions, triangles) = torus(24, 12);
    let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
    for order in ORDERS {
        let collapses = run(mesh, order);
        assert!(collapses.len() > positions.len() / 2, "{order:?}: {}", collapses.len());
        check_promises(mesh, &collapses, true);
    }
}

#[test]
fn orders_are_the_plainest_form_of_themselves() {
    let (positions, triangles) = torus(10, 7);
    let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
    for order in ORDERS {
        let found: Vec<_> = run(mesh, order).iter().map(|c| (c.removed, c.kept)).collect();
        assert_eq!(found, plain(mesh, order), "{order:?}");
    }
}

/// Without an earlier refusal, the guarded order begins as the paper's.
#[test]
fn the_guarded_order_begins_as_the_papers() {
    let (positions, triangles) = torus(24, 12);
    let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
    let [paper, guarded] = [Order::Paper, Order::Guarded].map(|order| run(mesh, order));
    let same = paper.iter().zip(&guarded);
    let same = same.take_while(|(a, b)| (a.removed, a.kept) == (b.removed, b.kept)).count();
    assert!(same > 5 && guarded.len() < paper.len(), "{same}");
}

proptest! {
    #[test]
    fn any_mesh_keeps_the_promises((positions, triangles) in soup()) {
        let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
        for order in ORDERS {
            let collapses = run(mesh, order);
            check_promises(mesh, &collapses, false);
            let found: Vec<_> = collapses.iter().map(|c| (c.removed, c.kept)).collect();
            prop_assert_eq!(found, plain(mesh, order));
        }
    }
}
