//! Welding, the collapse stacks, and the mesh at a new theta.

use std::hint::black_box;

use anyhow::Result;
use busbar_geometry::{CollapseStacks, weld};
use indicatif::ProgressBar;

use crate::report::Section;
use crate::scene::Scene;
use crate::series::Series;

/// Thetas of the paper's Table I.
const RESOLVES: [(f64, &str); 3] =
    [(0.0, "resolve_theta_0"), (0.7, "resolve_theta_70"), (0.85, "resolve_theta_85")];
/// Resolves in a round, so that there is a 99th percentile.
const RESOLVES_A_ROUND: usize = 12;
/// Bytes that the stacks may add to a triangle of the plain indexed mesh.
const STATIC_BYTES_BAR: f64 = 8.0;

pub(crate) fn run(scene: &Scene, rounds: usize, progress: &ProgressBar) -> Result<Section> {
    let primitives = scene.primitives();
    let sequence = scene.sequence()?;
    let mut weld_time = Series::new("weld", "ms");
    let mut build_time = Series::new("build", "ms");
    let mut resolve_times = RESOLVES.map(|(_, name)| Series::new(name, "ms"));
    let mut static_bytes = 0;
    for _ in 0..rounds {
        let (mesh, _) = weld_time.time(|| weld(&primitives))?;
        let sequence = sequence.clone();
        let stacks = build_time.time(|| CollapseStacks::build(mesh, &sequence));
        static_bytes = stacks.static_bytes();
        for _ in 0..RESOLVES_A_ROUND {
            for ((theta, _), time) in RESOLVES.into_iter().zip(&mut resolve_times) {
                let cursor = stacks.cursor_at(theta);
                // What is resolved is dropped outside the time.
                black_box(time.time(|| stacks.resolve(cursor)));
            }
        }
        progress.inc(1);
    }
    let bytes_a_triangle = static_bytes as f64 / scene.triangles.len() as f64;
    let bytes = Series::exact("static_bytes_a_triangle", "B", bytes_a_triangle);
    let series = [weld_time, build_time].into_iter().chain(resolve_times);
    Ok(Section { series: series.chain([bytes.at_most(STATIC_BYTES_BAR)]).collect() })
}
