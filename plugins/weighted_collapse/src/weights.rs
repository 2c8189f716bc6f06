//! The importance W of every edge: Eq. 1-10 of the paper.
//!
//! All sums run in edge order in double precision with `libm`, so that the
//! same mesh gives the same weights on every machine.

use std::f64::consts::PI;

use busbar_plugin_sdk::Mesh;

use crate::edges::Edges;

/// The four factors of one edge before equalisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Factors {
    /// L, Eq. 1: length.
    pub(crate) length: f64,
    /// F, Eq. 2: whether the edge is a border.
    pub(crate) border: bool,
    /// S, Eq. 3: area of the triangles at the edge.
    pub(crate) area: f64,
    /// C, Eq. 4: curvature in [0, pi].
    pub(crate) curvature: f64,
}

/// W of every edge, Eq. 10. Maxima, standard deviations and the proportion of
/// borders are taken over the mesh. Without `border_protection`, borders have
/// curvature 0 and no weight of their own (w2 = 0).
pub(crate) fn weigh(mesh: &Mesh<'_>, edges: &Edges, border_protection: bool) -> Vec<f64> {
    let factors: Vec<Factors> =
        (0..edges.len()).map(|edge| measure(mesh, edges, edge, border_protection)).collect();
    combine(&factors, border_protection)
}

/// Eq. 6-10: equalises the factors and adds them up by their spread.
///
/// The paper calls Eq. 6-8 histogram equalisation; they are a rescaling by the
/// maximum to [0, pi], done as printed. A maximum of 0 maps to 0.
fn combine(factors: &[Factors], border_protection: bool) -> Vec<f64> {
    let equalised = |value: fn(&Factors) -> f64| -> Vec<f64> {
        let largest = factors.iter().map(value).fold(0.0, f64::max);
        let scale = if largest > 0.0 { PI / largest } else { 0.0 };
        factors.iter().map(|f| value(f) * scale).collect()
    };
    let lengths = equalised(|f| f.length);
    let areas = equalised(|f| f.area);
    let curvatures: Vec<f64> = factors.iter().map(|f| f.curvature).collect();

    let borders = factors.iter().filter(|f| f.border).count();
    let alpha = if border_protection { borders as f64 / factors.len().max(1) as f64 } else { 0.0 };
    let (w1, w2) = (standard_deviation(&lengths), alpha);
    let (w3, w4) = (standard_deviation(&areas), standard_deviation(&curvatures));

    factors
        .iter()
        .enumerate()
        .map(|(i, f)| {
            let flag = if f.border { PI } else { 0.0 };
            w1 * lengths[i] + w2 * flag + w3 * areas[i] + w4 * curvatures[i]
        })
        .collect()
}

/// Population standard deviation; the paper's sum "from i = 0 to n" is read
/// as one over the n edges.
fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    variance.sqrt()
}

/// Eq. 1-4 for one edge.
///
/// - F is 1 on a border, as the paper's text under Eq. 9 says and its Fig. 7
///   needs; Eq. 2 prints the opposite. An edge of three and more triangles
///   counts as a border.
/// - C is pi minus the angle of Eq. 4 as printed: the printed normals point
///   apart on a flat pair, so the printed angle is pi there. With this reading
///   C is 0 for a flat pair and pi for one folded onto itself, whatever the
///   winding. Of three and more triangles, the largest C of any two counts (of
///   the first [`MAX_PAIRS`] pairs). A
///   triangle without area contributes C = 0.
/// - On a border Eq. 4 has no second normal: C is pi, the strongest
///   protection, or 0 without border protection.
fn measure(mesh: &Mesh<'_>, edges: &Edges, edge: usize, border_protection: bool) -> Factors {
    let [v1, v2] = edges.ends[edge];
    let p1 = point(mesh, v1);
    let along = sub(point(mesh, v2), p1);
    let triangles = edges.triangles_at(edge);
    let normal = |&triangle: &u32| {
        let corners = mesh.triangles[triangle as usize];
        let opposite = corners.into_iter().find(|&v| v != v1 && v != v2).unwrap_or(v1);
        cross(along, sub(point(mesh, opposite), p1))
    };
    let area = triangles.iter().map(|t| 0.5 * norm(normal(t))).sum();
    let border = triangles.len() != 2;
    let curvature = match triangles {
        [_] if border_protection => PI,
        [_] => 0.0,
        [first, second] => bend(normal(first), normal(second)),
        many => many
            .iter()
            .enumerate()
            .flat_map(|(i, a)| many[..i].iter().map(move |b| (a, b)))
            .take(MAX_PAIRS)
            .map(|(a, b)| bend(normal(a), normal(b)))
            .fold(0.0, f64::max),
    };
    Factors { length: norm(along), border, area, curvature }
}

/// Pairs of triangles looked at on a non-manifold edge; bounds the work on an
/// edge that very many triangles share.
const MAX_PAIRS: usize = 4096;

/// pi minus the angle between two normals, the cosine clamped to [-1, 1].
fn bend(a: [f64; 3], b: [f64; 3]) -> f64 {
    let scale = norm(a) * norm(b);
    if scale == 0.0 {
        return 0.0;
    }
    PI - libm::acos((dot(a, b) / scale).clamp(-1.0, 1.0))
}

fn point(mesh: &Mesh<'_>, vertex: u32) -> [f64; 3] {
    mesh.positions[vertex as usize].map(f64::from)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests;
