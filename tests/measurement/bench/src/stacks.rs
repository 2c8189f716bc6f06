//! Collapse stacks: welding, building, and resolving a new theta; on one core, in its processor
//! time.

use std::hint::black_box;

use anyhow::Result;
use busbar_geometry::{CollapseStacks, weld};
use indicatif::ProgressBar;
use measure::acmr;

use crate::affinity::OneCore;
use crate::report::Section;
use crate::scene::Scene;
use crate::series::Series;

/// Thetas, and the names of their figures.
const RESOLVES: [(f64, &str, &str); 5] = [
    (0.0, "resolve_theta_0", "acmr_theta_0_to_meshoptimizer"),
    (0.5, "resolve_theta_50", "acmr_theta_50_to_meshoptimizer"),
    (0.7, "resolve_theta_70", "acmr_theta_70_to_meshoptimizer"),
    (0.85, "resolve_theta_85", "acmr_theta_85_to_meshoptimizer"),
    (0.95, "resolve_theta_95", "acmr_theta_95_to_meshoptimizer"),
];
/// Number of resolves in a round, enough for a 99th percentile.
const RESOLVES_A_ROUND: usize = 12;
/// Longest time of a resolve, milliseconds.
const RESOLVE_BAR: f64 = 2.0;
/// Greatest number of bytes that the stacks add to a triangle of the plain indexed mesh.
const STATIC_BYTES_BAR: f64 = 8.0;
/// Number of entries of the vertex cache; the greatest ratio of a level's order to that of
/// meshoptimizer on the same triangles follows.
const CACHE_ENTRIES: usize = 16;
const CACHE_BAR: f64 = 1.15;

pub(crate) fn run(scene: &Scene, rounds: usize, progress: &ProgressBar) -> Result<Section> {
    let _core = OneCore::hold()?;
    let primitives = scene.primitives();
    let sequence = scene.sequence()?;
    let mut weld_time = Series::new("weld", "ms");
    let mut build_time = Series::new("build", "ms");
    let mut resolve_times =
        RESOLVES.map(|(_, name, _)| Series::new(name, "ms").at_most(RESOLVE_BAR));
    let mut exact = Vec::new();
    for _ in 0..rounds {
        let (mesh, _) = weld_time.processor(|| weld(&primitives))?;
        let sequence = sequence.clone();
        let stacks = build_time.processor(|| CollapseStacks::build(mesh, &sequence));
        for _ in 0..RESOLVES_A_ROUND {
            for ((theta, ..), time) in RESOLVES.into_iter().zip(&mut resolve_times) {
                let cursor = stacks.cursor_for_theta(theta);
                // What is resolved is dropped outside the time.
                black_box(time.processor(|| stacks.resolve(cursor)));
            }
        }
        exact = facts(&stacks);
        progress.inc(1);
    }
    let series = [weld_time, build_time].into_iter().chain(resolve_times);
    Ok(Section { series: series.chain(exact).collect() })
}

/// Returns the figures that do not vary between rounds.
fn facts(stacks: &CollapseStacks) -> Vec<Series> {
    let triangles = stacks.mesh().triangles.len();
    let bytes = stacks.static_bytes() as f64 / triangles as f64;
    let bytes = Series::exact("static_bytes_a_triangle", "B", bytes).at_most(STATIC_BYTES_BAR);
    let orders = RESOLVES.map(|(theta, _, name)| {
        let level = stacks.resolve(stacks.cursor_for_theta(theta)).triangles;
        let vertices = stacks.mesh().wedges.len();
        let best = meshopt::optimize_vertex_cache(level.as_flattened(), vertices);
        let ratio = acmr(&level, CACHE_ENTRIES) / acmr(best.as_chunks().0, CACHE_ENTRIES);
        Series::exact(name, "", ratio).at_most(CACHE_BAR)
    });
    std::iter::once(bytes).chain(orders).collect()
}
