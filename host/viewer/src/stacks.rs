//! Meshes to collapse stacks, in parallel, with times a stage.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use busbar_geometry::{CollapseSequence, CollapseStacks, Mesh};
use busbar_plugin_host::{MeshOptimizer, PluginError};
use rayon::prelude::*;

/// Stacks of the meshes of one model, and what their making took.
pub(crate) struct BuiltStacks {
    /// One a mesh, in order.
    pub(crate) stacks: Vec<Arc<CollapseStacks>>,
    /// CPU milliseconds a stage, summed over meshes. `optimize` is the whole
    /// call of the plugin; `optimize/...` are the parts that it reported.
    pub(crate) millis: BTreeMap<String, f64>,
}

/// Builds the stacks of all meshes. Without an optimiser nothing collapses.
/// `done` is told how many meshes are done.
pub(crate) fn build(
    meshes: Vec<Mesh>,
    optimizer: Option<&MeshOptimizer>,
    done: &(dyn Fn(usize) + Sync),
) -> Result<BuiltStacks, PluginError> {
    let finished = AtomicUsize::new(0);
    let built: Vec<_> = meshes
        .into_par_iter()
        .map(|mesh| {
            let built = build_one(mesh, optimizer);
            done(finished.fetch_add(1, Ordering::Relaxed) + 1);
            built
        })
        .collect::<Result<_, _>>()?;
    let mut all = BuiltStacks { stacks: Vec::with_capacity(built.len()), millis: BTreeMap::new() };
    for (stacks, stages) in built {
        all.stacks.push(Arc::new(stacks));
        for (name, millis) in stages {
            *all.millis.entry(name).or_default() += millis;
        }
    }
    Ok(all)
}

fn build_one(
    mesh: Mesh,
    optimizer: Option<&MeshOptimizer>,
) -> Result<(CollapseStacks, Vec<(String, f64)>), PluginError> {
    let mut stages = Vec::new();
    let sequence = match optimizer {
        None => CollapseSequence::none(mesh.positions.len() as u32),
        Some(optimizer) => {
            let start = Instant::now();
            let optimised = optimizer.optimize(&mesh.topology(), |_| true)?;
            stages.push(("optimize".to_owned(), millis_since(start)));
            let parts = optimised.stages.into_iter();
            stages.extend(parts.map(|(name, millis)| (format!("optimize/{name}"), millis)));
            optimised.sequence
        }
    };
    let start = Instant::now();
    let stacks = CollapseStacks::build(mesh, &sequence);
    stages.push(("stacks".to_owned(), millis_since(start)));
    Ok((stacks, stages))
}

/// Milliseconds since an instant.
pub(crate) fn millis_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
