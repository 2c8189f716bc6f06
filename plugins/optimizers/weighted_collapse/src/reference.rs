//! The paper's method in the plainest form, and the optimiser compared with it
//! on any mesh: non-manifold, with duplicate triangles and ones without area.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use proptest::prelude::*;

use crate::interpretation::{BorderFlag, BorderWeight, Curvature};
use crate::vector::{cross, dot, norm, point, sub};
use crate::{Collapse, CollapseList, Interpretation, Mesh, Order, edges, forest, sort, weights};

/// Edges by their ends, with the opposite corners of their triangles.
type EdgeMap = BTreeMap<[u32; 2], Vec<u32>>;

fn edge_map(mesh: &Mesh<'_>) -> EdgeMap {
    let mut map = EdgeMap::new();
    for &[a, b, c] in mesh.triangles {
        for (v, w, opposite) in [(a, b, c), (b, c, a), (c, a, b)] {
            map.entry([v.min(w), v.max(w)]).or_default().push(opposite);
        }
    }
    map.values_mut().for_each(|opposites| opposites.sort());
    map
}

/// Computes L, F, S and C of Eq. 1-4.
fn factors(
    mesh: &Mesh<'_>,
    ends: [u32; 2],
    opposites: &[u32],
    interpretation: &Interpretation,
) -> [f64; 4] {
    let [p1, p2] = ends.map(|v| point(mesh, v));
    let normal = |&opposite: &u32| cross(sub(p2, p1), sub(point(mesh, opposite), p1));
    let bend = |a: &u32, b: &u32| {
        let (a, b) = (normal(a), normal(b));
        if norm(a) * norm(b) == 0.0 {
            return 0.0;
        }
        let angle = libm::acos((dot(a, b) / (norm(a) * norm(b))).clamp(-1.0, 1.0));
        if interpretation.curvature == Curvature::Mended { PI - angle } else { angle }
    };
    let mut curvature =
        if opposites.len() == 1 { interpretation.border_curvature } else { 0.0_f64 };
    for (i, a) in opposites.iter().enumerate() {
        for b in &opposites[..i] {
            curvature = curvature.max(bend(a, b));
        }
    }
    let border = opposites.len() != 2;
    let flag = if interpretation.border_flag == BorderFlag::Text { border } else { !border };
    let area = opposites.iter().map(|o| 0.5 * norm(normal(o))).sum();
    [norm(sub(p2, p1)), f64::from(u8::from(flag)), area, curvature]
}

/// Computes Eq. 5-10, straight from the formulas.
fn weights_of(mesh: &Mesh<'_>, edges: &EdgeMap, interpretation: &Interpretation) -> Vec<f64> {
    let rows: Vec<[f64; 4]> = edges
        .iter()
        .map(|(&ends, opposites)| factors(mesh, ends, opposites, interpretation))
        .collect();
    let n = rows.len() as f64;
    let equalised = |column: usize| -> Vec<f64> {
        let values = rows.iter().map(|row| row[column]);
        let max = values.clone().fold(0.0, f64::max);
        values.map(|value| if max > 0.0 { value * PI / max } else { 0.0 }).collect()
    };
    let deviation = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / n;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    let curvatures: Vec<f64> = rows.iter().map(|row| row[3]).collect();
    let borders = edges.values().filter(|opposites| opposites.len() != 2).count();
    let alpha =
        if interpretation.border_weight == BorderWeight::Alpha { borders as f64 / n } else { 0.0 };
    let (l, f, s) = (equalised(0), equalised(1), equalised(2));
    let (w1, w3, w4) = (deviation(&l), deviation(&s), deviation(&curvatures));
    (0..rows.len()).map(|i| w1 * l[i] + alpha * f[i] + w3 * s[i] + w4 * curvatures[i]).collect()
}

/// Joins the edges in order; every vertex knows its class's survivor.
fn collapse_in_order(mesh: &Mesh<'_>, ends: impl Iterator<Item = [u32; 2]>) -> Vec<Collapse> {
    let mut survivor: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut radius = vec![0.0_f32; mesh.positions.len()];
    let mut collapses: Vec<Collapse> = Vec::new();
    for [v1, v2] in ends {
        let [a, b] = [v1, v2].map(|v| survivor[v as usize]);
        if a == b {
            continue;
        }
        let size = |class: u32| survivor.iter().filter(|&&s| s == class).count();
        let a_stays = size(a) > size(b) || (size(a) == size(b) && a < b);
        let (removed, kept) = if a_stays { (b, a) } else { (a, b) };
        let distance = norm(sub(point(mesh, removed), point(mesh, kept))) as f32;
        let moved = distance + radius[removed as usize];
        radius[kept as usize] = radius[kept as usize].max(moved);
        survivor.iter_mut().filter(|s| **s == removed).for_each(|s| *s = kept);
        let error = collapses.last().map_or(0.0, |c| c.error).max(moved);
        collapses.push(Collapse { removed, kept, error });
    }
    collapses
}

/// Generates triangle soups over few places: many shared and duplicate triangles, non-manifold
/// edges and collinear points.
pub(crate) fn soup() -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<[u32; 3]>)> {
    let places = prop::collection::vec(prop::array::uniform3(-4_i8..4), 3..40);
    let picks = prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..80);
    (places, picks).prop_map(|(places, picks)| {
        let count = places.len() as u32;
        let triangles = picks.into_iter().map(|pick| pick.map(|v| v % count));
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        (places.iter().map(|p| p.map(f32::from)).collect(), triangles)
    })
}

pub(crate) fn interpretation() -> impl Strategy<Value = Interpretation> {
    (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>()).prop_map(|(a, b, c, d)| {
        Interpretation {
            curvature: if a { Curvature::Mended } else { Curvature::AsPrinted },
            border_flag: if b { BorderFlag::Text } else { BorderFlag::Equation2 },
            border_curvature: if c { PI } else { 0.0 },
            border_weight: if d { BorderWeight::Alpha } else { BorderWeight::Zero },
        }
    })
}

proptest! {
    /// Edges, weights and collapses equal those of the plain form, bit for bit, in any number of
    /// threads.
    #[test]
    fn any_mesh_is_as_the_plain_form_says(
        (positions, triangles) in soup(),
        interpretation in interpretation(),
        threads in 1_usize..5,
    ) {
        let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
        let plain = edge_map(&mesh);
        let found = edges::find(&mesh, threads);
        prop_assert!(found.ends.iter().eq(plain.keys()));
        for (edge, opposites) in plain.values().enumerate() {
            let found = found.sides(edge).iter().map(|side| side.opposite());
            prop_assert!(found.eq(opposites.iter().copied()));
        }

        let weigh = |threads| {
            let measured = weights::measure_all(&mesh, &found, &interpretation, threads);
            let coefficients = measured.coefficients(&interpretation);
            measured.weigh(&coefficients, threads)
        };
        let weighed = weigh(threads);
        for (weight, expected) in weighed.iter().zip(weights_of(&mesh, &plain, &interpretation)) {
            prop_assert!((weight - expected).abs() < 1e-9, "{weight} is not {expected}");
        }
        let bits = |weights: &[f64]| weights.iter().map(|w| w.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&weighed), bits(&weigh(1)));

        let sorted = sort::sort(&weighed);
        let mut expected: Vec<u32> = (0..weighed.len() as u32).collect();
        expected.sort_by(|&a, &b| weighed[a as usize].total_cmp(&weighed[b as usize]));
        prop_assert_eq!(&sorted, &expected);

        let in_order = expected.iter().map(|&edge| found.ends[edge as usize]);
        let plain = collapse_in_order(&mesh, in_order);
        let fields = |c: &Collapse| (c.removed, c.kept, c.error.to_bits());
        for part_size in [1, 5, sort::PART] {
            let mut list = CollapseList::default();
            forest::collapse(&mesh, &found, &weighed, part_size, &mut list);
            prop_assert!(list.collapses.iter().map(fields).eq(plain.iter().map(fields)));
        }
    }

    /// A forest with V - components entries, errors that never decrease, and
    /// chains no longer than log2 of V.
    #[test]
    fn any_mesh_gives_a_spanning_forest((positions, triangles) in soup()) {
        let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
        let progress = &mut crate::Progress::detached();
        let list = crate::collapse_list(mesh, &Interpretation::BUSBAR, Order::Paper, 1, progress).unwrap();
        let n = positions.len();

        let mut survivor: Vec<usize> = (0..n).collect();
        let mut depth = vec![0_u32; n];
        for c in &list.collapses {
            let (removed, kept) = (c.removed as usize, c.kept as usize);
            prop_assert_eq!((survivor[removed], survivor[kept]), (removed, kept));
            survivor[removed] = kept;
        }
        for c in list.collapses.iter().rev() {
            depth[c.removed as usize] = depth[c.kept as usize] + 1;
        }
        prop_assert!(depth.iter().all(|&d| d <= n.ilog2()));
        prop_assert!(list.collapses.is_sorted_by(|a, b| a.error <= b.error));

        let mut component: Vec<usize> = (0..n).collect();
        for _ in 0..n {
            for t in &triangles {
                let least = t.map(|v| component[v as usize]).into_iter().min().unwrap();
                t.iter().for_each(|&v| component[v as usize] = least);
            }
        }
        let components = (0..n).filter(|&v| component[v] == v).count();
        prop_assert_eq!(list.collapses.len(), n - components);
    }
}

/// A wavy sheet with more edges than fit into one chunk of sums.
#[test]
fn a_larger_mesh_is_the_same_in_any_number_of_threads() {
    let side = 60_u32;
    let positions: Vec<[f32; 3]> = (0..side * side)
        .map(|i| [(i % side) as f32, (i / side) as f32, ((i * 37) % 11) as f32 * 0.1])
        .collect();
    let cells = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| y * side + x));
    let triangles: Vec<[u32; 3]> =
        cells.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]).collect();
    let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
    let weigh = |threads| {
        let edges = edges::find(&mesh, threads);
        assert!(edges.len() > 2 * crate::moments::CHUNK);
        let measured = weights::measure_all(&mesh, &edges, &Interpretation::BUSBAR, threads);
        let weights =
            measured.clone().weigh(&measured.coefficients(&Interpretation::BUSBAR), threads);
        let sorted = sort::sort(&weights);
        (edges, weights.into_iter().map(f64::to_bits).collect::<Vec<_>>(), sorted)
    };
    let alone = weigh(1);
    for threads in 2..5 {
        assert!(weigh(threads) == alone, "{threads} threads");
    }
}
