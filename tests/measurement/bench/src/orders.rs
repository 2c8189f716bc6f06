//! Orders that evaluate the current mesh, beside the paper's; on all cores, by the clock.

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

/// Greatest number of rounds: one takes seconds, and no bar is judged on them.
const MAX_ROUNDS: usize = 3;

pub(crate) fn run(scene: &Scene, rounds: usize, progress: &ProgressBar) -> Result<Section> {
    let input = Input::new(&scene.mesh);
    let mut times = ORDERS.map(|(_, name, _)| Series::new(name, "ms"));
    let mut shares = ORDERS.map(|(_, _, name)| Series::exact(name, "", 0.0));
    progress.set_length(rounds.min(MAX_ROUNDS) as u64);
    for _ in 0..rounds.min(MAX_ROUNDS) {
        for (i, (order, _, share_name)) in ORDERS.into_iter().enumerate() {
            let list = times[i].time(|| input.weighted(order, MAX_THREADS))?;
            let share = list.collapses.len() as f64 / scene.mesh.positions.len() as f64;
            shares[i] = Series::exact(share_name, "", share);
        }
        progress.inc(1);
    }
    Ok(Section { series: times.into_iter().chain(shares).collect() })
}
