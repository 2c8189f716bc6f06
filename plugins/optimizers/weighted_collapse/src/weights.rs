//! Edge weights: the importance W of every edge (Eq. 5-10 of the paper).
//!
//! All arithmetic is in double precision with `libm`, and sums run over fixed
//! chunks of edges, so that the same mesh gives the same weights on every
//! machine and for every number of threads.

use std::f64::consts::PI;

use busbar_plugin_sdk::{Mesh, on_huge_pages};

use crate::arc_cosine::angles;
use crate::edges::Edges;
use crate::factors::{Factors, Hinge, angle, bend_cosine, measure};
use crate::interpretation::{BorderWeight, Interpretation};
use crate::moments::{CHUNK, Moments};
use crate::threads;

/// The factors of all edges, in parallel arrays.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeasuredEdges {
    lengths: Vec<f64>,
    flags: Vec<bool>,
    areas: Vec<f64>,
    curvatures: Vec<f64>,
    totals: Totals,
}

/// Totals over all edges that Eq. 6-10 need.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    lengths: Moments,
    areas: Moments,
    curvatures: Moments,
    borders: usize,
    edges: usize,
}

/// Eq. 10 as a linear function of the factors of Eq. 1-4: each coefficient is
/// that of Eq. 10 times the scale of Eq. 6-8.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    length: f64,
    flag: f64,
    area: f64,
    curvature: f64,
}

/// The arrays of one chunk of edges.
struct Chunk<'a> {
    first_edge: usize,
    lengths: &'a mut [f64],
    flags: &'a mut [bool],
    areas: &'a mut [f64],
    curvatures: &'a mut [f64],
}

/// Measures Eq. 1-4 for all edges.
pub(crate) fn measure_all(
    mesh: &Mesh<'_>,
    edges: &Edges,
    interpretation: &Interpretation,
    threads: usize,
) -> MeasuredEdges {
    let zeros = || on_huge_pages(vec![0.0; edges.len()]);
    let (mut lengths, mut areas, mut curvatures) = (zeros(), zeros(), zeros());
    let mut flags = vec![false; edges.len()];
    let chunks = lengths
        .chunks_mut(CHUNK)
        .zip(flags.chunks_mut(CHUNK))
        .zip(areas.chunks_mut(CHUNK).zip(curvatures.chunks_mut(CHUNK)))
        .enumerate()
        .map(|(i, ((lengths, flags), (areas, curvatures)))| Chunk {
            first_edge: i * CHUNK,
            lengths,
            flags,
            areas,
            curvatures,
        });
    let totals = threads::map(chunks.collect(), threads, |chunk| {
        measure_chunk(mesh, edges, interpretation, chunk)
    });
    let totals = totals.into_iter().fold(Totals::default(), Totals::combine);
    MeasuredEdges { lengths, flags, areas, curvatures, totals }
}

fn measure_chunk(
    mesh: &Mesh<'_>,
    edges: &Edges,
    interpretation: &Interpretation,
    chunk: Chunk<'_>,
) -> Totals {
    let Chunk { first_edge, lengths, flags, areas, curvatures } = chunk;
    let inner_flag = interpretation.flag(false);
    // Nearly all edges have two sides. Their roots and quotients are taken of
    // the whole chunk in one go, which is faster.
    let mut second_squares = [0.0; CHUNK];
    let mut borders = Vec::new();
    for i in 0..lengths.len() {
        let edge = first_edge + i;
        if let &[first, second] = edges.sides(edge) {
            let hinge = Hinge::new(mesh, edges.ends[edge], first, second);
            lengths[i] = hinge.length_squared;
            areas[i] = hinge.first_squared;
            second_squares[i] = hinge.second_squared;
            curvatures[i] = hinge.dot;
            flags[i] = inner_flag;
        } else {
            borders.push(i);
        }
    }
    let outputs = lengths.iter_mut().zip(areas.iter_mut()).zip(curvatures.iter_mut());
    for (((length, area), curvature), &second) in outputs.zip(&second_squares) {
        let (first, second) = (area.sqrt(), second.sqrt());
        *length = length.sqrt();
        *area = 0.5 * (first + second);
        *curvature = bend_cosine(*curvature, first * second, interpretation.curvature);
    }
    for &i in &borders {
        let edge = first_edge + i;
        let factors = measure(mesh, edges.ends[edge], edges.sides(edge), interpretation);
        lengths[i] = factors.length;
        flags[i] = factors.flag;
        areas[i] = factors.area;
        curvatures[i] = factors.curvature_cosine;
    }
    angles(curvatures);
    Totals {
        lengths: Moments::from_values(lengths),
        areas: Moments::from_values(areas),
        curvatures: Moments::from_values(curvatures),
        borders: borders.len(),
        edges: lengths.len(),
    }
}

impl Totals {
    fn combine(self, other: Self) -> Self {
        Self {
            lengths: self.lengths.combine(other.lengths),
            areas: self.areas.combine(other.areas),
            curvatures: self.curvatures.combine(other.curvatures),
            borders: self.borders + other.borders,
            edges: self.edges + other.edges,
        }
    }
}

impl MeasuredEdges {
    /// Computes the coefficients of Eq. 6-10. Maxima, standard deviations and the proportion of
    /// borders are taken over the mesh.
    ///
    /// The paper calls Eq. 6-8 histogram equalisation; they are a rescaling by
    /// the maximum to [0, pi], done as printed. A maximum of 0 maps to 0.
    pub(crate) fn coefficients(&self, interpretation: &Interpretation) -> Coefficients {
        let totals = &self.totals;
        let equalised = |moments: &Moments| {
            let scale = if moments.max > 0.0 { PI / moments.max } else { 0.0 };
            // The deviation of equalised values, times what equalises a value.
            moments.deviation() * scale * scale
        };
        let alpha = match interpretation.border_weight {
            BorderWeight::Alpha => totals.borders as f64 / totals.edges.max(1) as f64,
            BorderWeight::Zero => 0.0,
        };
        Coefficients {
            length: equalised(&totals.lengths),
            flag: alpha * PI,
            area: equalised(&totals.areas),
            curvature: totals.curvatures.deviation(),
        }
    }

    /// Computes the terms of Eq. 10, edge by edge.
    pub(crate) fn terms(&self, coefficients: Coefficients) -> impl Iterator<Item = [f64; 4]> {
        (0..self.lengths.len()).map(move |edge| {
            let (length, flag) = (self.lengths[edge], self.flags[edge]);
            coefficients.terms(length, flag, self.areas[edge], self.curvatures[edge])
        })
    }

    /// Computes W of all edges.
    pub(crate) fn weigh(mut self, coefficients: &Coefficients, threads: usize) -> Vec<f64> {
        let chunks = self.lengths.chunks_mut(CHUNK).zip(self.flags.chunks(CHUNK));
        let chunks = chunks.zip(self.areas.chunks(CHUNK).zip(self.curvatures.chunks(CHUNK)));
        threads::map(chunks.collect(), threads, |((lengths, flags), (areas, curvatures))| {
            let others = flags.iter().zip(areas).zip(curvatures);
            for (length, ((&flag, &area), &curvature)) in lengths.iter_mut().zip(others) {
                *length = coefficients.terms(*length, flag, area, curvature).iter().sum();
            }
        });
        self.lengths
    }
}

impl Coefficients {
    /// Computes W of one edge (Eq. 10).
    pub(crate) fn weigh(&self, factors: &Factors) -> f64 {
        let curvature = angle(factors.curvature_cosine);
        self.terms(factors.length, factors.flag, factors.area, curvature).iter().sum()
    }

    /// Computes the terms of Eq. 10 from L, F, S and C.
    fn terms(&self, length: f64, flag: bool, area: f64, curvature: f64) -> [f64; 4] {
        [
            self.length * length,
            if flag { self.flag } else { 0.0 },
            self.area * area,
            self.curvature * curvature,
        ]
    }
}

#[cfg(test)]
mod tests;
