//! W of small meshes, worked out by hand in each test.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, SQRT_2};

use super::*;
use crate::edges::find;
use crate::interpretation::{BorderFlag, Curvature};

struct Weighed {
    edges: Edges,
    measured: MeasuredEdges,
    weights: Vec<f64>,
}

/// L, F, S and C of an edge.
#[derive(Clone, Copy)]
struct Edge {
    length: f64,
    flag: bool,
    area: f64,
    curvature: f64,
}

impl Weighed {
    fn new(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        interpretation: &Interpretation,
    ) -> Self {
        let mesh = Mesh { positions, triangles, wedges: None };
        let edges = find(&mesh, 1);
        let measured = measure_all(&mesh, &edges, interpretation, 1);
        let weights = measured.clone().weigh(&measured.coefficients(interpretation), 1);
        Self { edges, measured, weights }
    }

    fn all(&self) -> impl Iterator<Item = Edge> {
        (0..self.edges.len()).map(|edge| Edge {
            length: self.measured.lengths[edge],
            flag: self.measured.flags[edge],
            area: self.measured.areas[edge],
            curvature: self.measured.curvatures[edge],
        })
    }

    fn edge(&self, ends: [u32; 2]) -> usize {
        self.edges.ends.iter().position(|&e| e == ends).unwrap()
    }

    fn factors(&self, ends: [u32; 2]) -> Edge {
        self.all().nth(self.edge(ends)).unwrap()
    }

    fn weight(&self, ends: [u32; 2]) -> f64 {
        self.weights[self.edge(ends)]
    }
}

#[track_caller]
fn near(actual: f64, expected: f64) {
    assert!((actual - expected).abs() < 1e-12, "{actual} is not {expected}");
}

const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

/// A unit square of two triangles: 4 borders of length 1 and area 1/2, and a
/// flat diagonal of length sqrt 2 and area 1. A value that one edge of five
/// has has the deviation sqrt(1/5 * 4/5) = 0.4 times the difference.
#[test]
fn two_triangles() {
    let square = Weighed::new(&SQUARE, &[[0, 1, 2], [0, 2, 3]], &Interpretation::BUSBAR);
    near(square.factors([0, 2]).curvature, 0.0);
    near(square.factors([0, 2]).area, 1.0);
    near(square.factors([0, 1]).curvature, PI);
    let sigma_l = 0.4 * PI * (1.0 - FRAC_1_SQRT_2);
    let (sigma_s, sigma_c, alpha) = (0.4 * FRAC_PI_2, 0.4 * PI, 0.8);
    let border = sigma_l * PI * FRAC_1_SQRT_2 + alpha * PI + sigma_s * FRAC_PI_2 + sigma_c * PI;
    let diagonal = sigma_l * PI + sigma_s * PI;
    for ends in [[0, 1], [1, 2], [2, 3], [0, 3]] {
        near(square.weight(ends), border);
    }
    near(square.weight([0, 2]), diagonal);
}

/// Two triangles without border protection: C = 0 everywhere and w2 = 0.
#[test]
fn two_triangles_without_border_protection() {
    let square = Weighed::new(&SQUARE, &[[0, 1, 2], [0, 2, 3]], &Interpretation::UNPROTECTED);
    let (sigma_l, sigma_s) = (0.4 * PI * (1.0 - FRAC_1_SQRT_2), 0.4 * FRAC_PI_2);
    near(square.weight([0, 1]), sigma_l * PI * FRAC_1_SQRT_2 + sigma_s * FRAC_PI_2);
    near(square.weight([0, 2]), sigma_l * PI + sigma_s * PI);
}

/// A unit cube: 12 edges of length 1 that bend by pi/2, 6 flat diagonals of
/// length sqrt 2, every area 1, no border. One third against two thirds has
/// the deviation sqrt(2)/3 times the difference; equal areas weigh nothing.
#[test]
fn cube() {
    let positions: Vec<[f32; 3]> =
        (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|b| b as f32)).collect();
    let triangles = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ];
    let cube = Weighed::new(&positions, &triangles, &Interpretation::BUSBAR);
    assert_eq!(cube.edges.len(), 18);
    let third = SQRT_2 / 3.0;
    let sigma_l = third * PI * (1.0 - FRAC_1_SQRT_2);
    let sigma_c = third * FRAC_PI_2;
    let edge = sigma_l * PI * FRAC_1_SQRT_2 + sigma_c * FRAC_PI_2;
    let diagonal = sigma_l * PI;
    let flat = cube.all().filter(|f| f.curvature < 1e-12).count();
    assert_eq!(flat, 6);
    for (factors, &weight) in cube.all().zip(&cube.weights) {
        assert!(!factors.flag);
        near(factors.area, 1.0);
        near(weight, if factors.length > 1.1 { diagonal } else { edge });
    }
}

/// Two by two unit squares: 8 borders (1, 1/2, pi), 4 inner sides (1, 1, 0),
/// 4 diagonals (sqrt 2, 1, 0) as (L, S, C).
#[test]
fn open_grid() {
    let positions: Vec<[f32; 3]> = (0..9).map(|i| [(i % 3) as f32, (i / 3) as f32, 0.0]).collect();
    let triangles: Vec<[u32; 3]> =
        [0, 1, 3, 4].into_iter().flat_map(|i| [[i, i + 1, i + 4], [i, i + 4, i + 3]]).collect();
    let grid = Weighed::new(&positions, &triangles, &Interpretation::BUSBAR);
    assert_eq!(grid.edges.len(), 16);
    let sigma_l = (0.25_f64 * 0.75).sqrt() * PI * (1.0 - FRAC_1_SQRT_2);
    let (sigma_s, sigma_c, alpha) = (0.5 * FRAC_PI_2, 0.5 * PI, 0.5);
    let short = sigma_l * PI * FRAC_1_SQRT_2;
    near(grid.weight([0, 1]), short + alpha * PI + sigma_s * FRAC_PI_2 + sigma_c * PI);
    near(grid.weight([1, 4]), short + sigma_s * PI);
    near(grid.weight([0, 4]), sigma_l * PI + sigma_s * PI);
}

/// Four equilateral triangles around an apex, half an octahedron: all lengths
/// sqrt 2, so length weighs nothing; faces bend by acos(1/3).
#[test]
fn fan_with_a_border() {
    let positions = [[0., 0., 1.], [1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.]];
    let fan = Weighed::new(
        &positions,
        &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]],
        &Interpretation::BUSBAR,
    );
    let face = 3.0_f64.sqrt() / 2.0;
    near(fan.factors([0, 1]).area, 2.0 * face);
    near(fan.factors([1, 2]).area, face);
    let curvature = (1.0_f64 / 3.0).acos();
    near(fan.factors([0, 1]).curvature, curvature);
    let (alpha, sigma_s, sigma_c) = (0.5, 0.5 * FRAC_PI_2, 0.5 * (PI - curvature));
    near(fan.weight([0, 3]), sigma_s * PI + sigma_c * curvature);
    near(fan.weight([2, 3]), alpha * PI + sigma_s * FRAC_PI_2 + sigma_c * PI);
}

/// Three triangles on one edge, two of them in one plane, the third upright:
/// a border by F, S of all three, C the largest, pi/2.
#[test]
fn non_manifold_edge() {
    let positions = [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.], [-1., 0., 0.], [0., 1., 0.]];
    let book =
        Weighed::new(&positions, &[[0, 1, 2], [0, 3, 1], [0, 1, 4]], &Interpretation::BUSBAR);
    let spine = book.factors([0, 1]);
    assert!(spine.flag);
    near(spine.area, 1.5);
    near(spine.curvature, FRAC_PI_2);
    // All seven edges are borders: F is the same for all.
    assert!(book.all().all(|f| f.flag));
    // L: the spine and three spokes 1, three rims sqrt 2. S: spine 3/2, others
    // 1/2. C: spine pi/2, others pi.
    let sigma_l = (12.0_f64 / 49.0).sqrt() * PI * (1.0 - FRAC_1_SQRT_2);
    let sixth = (6.0_f64 / 49.0).sqrt();
    let (sigma_s, sigma_c) = (sixth * PI * 2.0 / 3.0, sixth * FRAC_PI_2);
    let expected = sigma_l * PI * FRAC_1_SQRT_2 + PI + sigma_s * PI + sigma_c * FRAC_PI_2;
    near(book.weight([0, 1]), expected);
}

/// A triangle without area beside a real one: C = 0, and only the real area.
#[test]
fn degenerate_triangle() {
    let positions = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [1., 1., 0.]];
    let mesh = Weighed::new(&positions, &[[0, 1, 2], [2, 1, 3]], &Interpretation::BUSBAR);
    let hypotenuse = mesh.factors([1, 2]);
    near(hypotenuse.curvature, 0.0);
    near(hypotenuse.area, 2.0);
    assert!(mesh.weights.iter().all(|w| w.is_finite()));
}

/// Eq. 4 as read here does not depend on the winding, and a pair folded onto
/// itself has C = pi.
#[test]
fn curvature_ignores_the_winding() {
    let flat = Weighed::new(&SQUARE, &[[0, 1, 2], [2, 0, 3]], &Interpretation::BUSBAR);
    near(flat.factors([0, 2]).curvature, 0.0);
    let mut folded = SQUARE;
    folded[3] = [0.9, 0.1, 0.0];
    for second in [[0, 2, 3], [2, 0, 3]] {
        let folded = Weighed::new(&folded, &[[0, 1, 2], second], &Interpretation::BUSBAR);
        near(folded.factors([0, 2]).curvature, PI);
    }
}

/// A mesh whose maxima are 0 has weights of 0, not NaN.
#[test]
fn a_mesh_without_size_has_finite_weights() {
    let point = Weighed::new(&[[1., 1., 1.]; 3], &[[0, 1, 2]], &Interpretation::BUSBAR);
    assert!(point.weights.iter().all(|w| w.is_finite()));
}

/// The unit square again, by the letter of the paper.
#[test]
fn two_triangles_as_printed() {
    let check = |interpretation: &Interpretation, border: (bool, f64), diagonal: (bool, f64)| {
        let square = Weighed::new(&SQUARE, &[[0, 1, 2], [0, 2, 3]], interpretation);
        for (ends, (flag, curvature)) in [([0, 1], border), ([0, 2], diagonal)] {
            assert_eq!(square.factors(ends).flag, flag);
            near(square.factors(ends).curvature, curvature);
        }
        square
    };
    // Eq. 4 as printed: the flat diagonal has C = pi, as the borders have.
    let printed = Interpretation { curvature: Curvature::AsPrinted, ..Interpretation::BUSBAR };
    let square = check(&printed, (true, PI), (false, PI));
    let (sigma_l, sigma_s) = (0.4 * PI * (1.0 - FRAC_1_SQRT_2), 0.4 * FRAC_PI_2);
    near(square.weight([0, 2]), sigma_l * PI + sigma_s * PI);
    // Eq. 2 as printed: the diagonal alone has F = 1; alpha stays 4/5.
    let printed =
        Interpretation { border_flag: BorderFlag::Equation2, ..Interpretation::UNPROTECTED };
    let square = check(&printed, (false, 0.0), (true, 0.0));
    near(square.weight([0, 2]), sigma_l * PI + sigma_s * PI);
    let printed = Interpretation { border_weight: BorderWeight::Alpha, ..printed };
    let square = check(&printed, (false, 0.0), (true, 0.0));
    near(square.weight([0, 2]), sigma_l * PI + 0.8 * PI + sigma_s * PI);
    near(square.weight([0, 1]), sigma_l * PI * FRAC_1_SQRT_2 + sigma_s * FRAC_PI_2);
}
