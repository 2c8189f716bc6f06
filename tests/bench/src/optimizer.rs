//! The paper's sequence, which holds every level, beside one level made by
//! meshoptimizer's `simplify`.

use anyhow::Result;
use indicatif::ProgressBar;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use weighted_collapse::{CollapseList, MAX_THREADS, Order};

use crate::report::Section;
use crate::scene::Scene;
use crate::series::Series;

/// The part of the indices that `simplify` is to leave.
const TARGET: f64 = 0.15;
/// More than any error of the scene, so that the target alone ends `simplify`.
const TARGET_ERROR: f32 = 1e9;
/// The part of its time that the sequence may take.
const BAR: f64 = 1.0 / 3.0;
/// Stages of the sequence, as `weighted_collapse` names them.
const STAGES: [&str; 4] = ["edges", "weights", "sort", "collapse"];

pub(crate) fn run(scene: &Scene, rounds: usize, progress: &ProgressBar) -> Result<Section> {
    let indices = scene.triangles.as_flattened();
    let bytes = meshopt::typed_to_bytes(&scene.positions);
    let vertices = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0)?;
    let wanted = (indices.len() as f64 * TARGET) as usize / 3 * 3;

    let mut simplify = Series::new("meshopt_simplify", "ms");
    let mut one_thread = Run::new([
        "one_thread",
        "one_thread_edges",
        "one_thread_weights",
        "one_thread_sort",
        "one_thread_collapse",
    ]);
    let mut all_cores = Run::new([
        "all_cores",
        "all_cores_edges",
        "all_cores_weights",
        "all_cores_sort",
        "all_cores_collapse",
    ]);
    let mut one_thread_ratio = Series::new("one_thread_to_meshopt", "").at_most(BAR);
    let mut all_cores_ratio = Series::new("all_cores_to_meshopt", "").at_most(BAR);
    let mut reached = 0;
    for _ in 0..rounds {
        let left = simplify.time(|| {
            let options = SimplifyOptions::None;
            meshopt::simplify(indices, &vertices, wanted, TARGET_ERROR, options, None)
        });
        reached = left.len();
        one_thread.measure(|| scene.optimize(Order::Paper, 1))?;
        all_cores.measure(|| scene.optimize(Order::Paper, MAX_THREADS))?;
        one_thread_ratio.push(one_thread.total.last() / simplify.last());
        all_cores_ratio.push(all_cores.total.last() / simplify.last());
        progress.inc(1);
    }
    let reached = reached as f64 / indices.len() as f64;
    let mut series =
        vec![Series::exact("meshopt_reached_of_indices", "", reached).at_most(TARGET), simplify];
    for run in [one_thread, all_cores] {
        series.push(run.total);
        series.extend(run.stages);
    }
    series.extend([one_thread_ratio, all_cores_ratio]);
    Ok(Section { series })
}

/// Times of the sequence, and of its stages.
struct Run {
    total: Series,
    stages: [Series; STAGES.len()],
}

impl Run {
    fn new([total, edges, weights, sort, collapse]: [&'static str; 5]) -> Self {
        let stages = [edges, weights, sort, collapse];
        Self {
            total: Series::new(total, "ms"),
            stages: stages.map(|stage| Series::new(stage, "ms")),
        }
    }

    fn measure(&mut self, work: impl FnOnce() -> Result<CollapseList>) -> Result<()> {
        let list = self.total.time(work)?;
        for (series, stage) in self.stages.iter_mut().zip(STAGES) {
            let times = list.stages().iter().filter(|(name, _)| *name == stage);
            series.push(times.map(|(_, millis)| millis).sum());
        }
        Ok(())
    }
}
