//! The orders that look at the mesh as it is, beside the paper's.

use anyhow::Result;
use indicatif::ProgressBar;
use weighted_collapse::{MAX_THREADS, Order};

use crate::optimizers::Input;
use crate::report::Section;
use crate::scene::Scene;
use crate::series::Series;

const ORDERS: [(Order, &str, &str); 3] = [
    (Order::Paper, "paper", "paper_collapses_of_vertices"),
    (Order::Guarded, "guarded", "guarded_collapses_of_vertices"),
    (Order::Reweighted, "reweighted", "reweighted_collapses_of_vertices"),
];

pub(crate) fn run(scene: &Scene, rounds: usize, progress: &ProgressBar) -> Result<Section> {
    let input = Input::new(&scene.mesh);
    let mut times = ORDERS.map(|(_, name, _)| Series::new(name, "ms"));
    let mut shares = ORDERS.map(|(_, _, name)| Series::exact(name, "", 0.0));
    for _ in 0..rounds {
        for (i, (order, _, share_name)) in ORDERS.into_iter().enumerate() {
            let list = times[i].time(|| input.weighted(order, MAX_THREADS))?;
            let share = list.collapses.len() as f64 / scene.mesh.positions.len() as f64;
            shares[i] = Series::exact(share_name, "", share);
        }
        progress.inc(1);
    }
    Ok(Section { series: times.into_iter().chain(shares).collect() })
}
