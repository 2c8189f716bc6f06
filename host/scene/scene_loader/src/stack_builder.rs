//! Meshes to collapse stacks, in parallel, with times a stage.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use busbar_geometry::{CollapseSequence, CollapseStacks, Mesh, removal_ranks, share_theta};
use busbar_plugin_host::PluginError;
use busbar_plugin_process::Optimizer;
use busbar_stack_cache::{CacheKey, Lookup, OptimizerDigest, StackCache};
use rayon::prelude::*;

/// Makes stacks, with an optimiser or (nothing then collapses) without.
pub struct StackBuilder<'a> {
    /// Optimizer of the meshes; none keeps them without collapses.
    pub optimizer: Option<&'a Optimizer>,
    /// Cache of stacks, and the digest of this optimizer.
    pub cache: Option<(&'a StackCache, OptimizerDigest)>,
    /// True if collapses are ordered by error instead of the plugin's order.
    pub by_error: bool,
    /// True if a mesh on which the optimizer fails is kept without collapses.
    pub allows_failure: bool,
}

/// Stacks of the meshes of one model, and what their making took.
#[derive(Default)]
pub struct BuiltStacks {
    /// Stacks of the meshes, in order.
    pub stacks: Vec<Arc<CollapseStacks>>,
    /// CPU milliseconds a stage, summed over meshes. `optimize` is the whole
    /// call of the plugin; `optimize/...` are the parts that it reported.
    pub millis: BTreeMap<String, f64>,
    /// Meshes whose stacks were in the cache.
    pub cached: usize,
    /// Remarks on faults of the cache.
    pub notes: Vec<String>,
    /// Failure of the optimizer on a mesh that is kept without collapses.
    pub optimizer_failure: Option<PluginError>,
}

impl StackBuilder<'_> {
    /// Builds the stacks of all meshes, which share a theta; `scales` has metres of the model to a
    /// unit of each mesh, and `done` receives the number of finished meshes.
    ///
    /// # Errors
    /// Error of the optimizer, unless its failure is allowed.
    pub fn build(
        &self,
        meshes: Vec<Mesh>,
        scales: &[f32],
        done: &(dyn Fn(usize) + Sync),
    ) -> Result<BuiltStacks, PluginError> {
        let finished = AtomicUsize::new(0);
        let built: Vec<_> = meshes
            .into_par_iter()
            .map(|mesh| {
                let built = self.find_or_build(mesh);
                done(finished.fetch_add(1, Ordering::Relaxed) + 1);
                built
            })
            .collect::<Result<_, _>>()?;
        let mut all = BuiltStacks::default();
        for one in built {
            all.stacks.extend(one.stacks);
            all.cached += one.cached;
            all.notes.extend(one.notes);
            all.optimizer_failure = all.optimizer_failure.or(one.optimizer_failure);
            for (stage, millis) in one.millis {
                *all.millis.entry(stage).or_default() += millis;
            }
        }
        share_theta(&mut all.stacks, scales);
        Ok(all)
    }

    fn find_or_build(&self, mut mesh: Mesh) -> Result<BuiltStacks, PluginError> {
        let mut built = BuiltStacks::default();
        let (Some((cache, maker)), Some(_)) = (self.cache, self.optimizer) else {
            self.build_one(mesh, &mut built)?;
            return Ok(built);
        };
        let start = Instant::now();
        let key = CacheKey::new(&mesh, maker);
        let found = cache.load(key, &mut mesh);
        built.millis.insert("cache".into(), millis_since(start));
        match found {
            Lookup::Found(stacks) => {
                built.stacks.push(Arc::new(*stacks));
                built.cached = 1;
                return Ok(built);
            }
            Lookup::Absent => {}
            Lookup::Damaged(reason) => {
                let path = cache.path(key);
                built.notes.push(format!("{} is built anew: {reason}", path.display()));
            }
        }
        let sequence = self.build_one(mesh, &mut built)?;
        if built.optimizer_failure.is_some() {
            return Ok(built);
        }
        let start = Instant::now();
        let stacks = &built.stacks[0];
        if let Err(error) = cache.store(key, &removal_ranks(&sequence), stacks.tables()) {
            built.notes.push(error.to_string());
        }
        built.millis.insert("cache/store".into(), millis_since(start));
        Ok(built)
    }

    fn build_one(
        &self,
        mesh: Mesh,
        built: &mut BuiltStacks,
    ) -> Result<CollapseSequence, PluginError> {
        let start = Instant::now();
        let optimised = self.optimizer.map(|optimizer| optimizer.optimize(&mesh, |_| true));
        let sequence = match optimised {
            None => CollapseSequence::empty(mesh.positions.len() as u32),
            Some(Err(error)) if self.allows_failure && error.is_reported_by_plugin() => {
                built.optimizer_failure = Some(error);
                CollapseSequence::empty(mesh.positions.len() as u32)
            }
            Some(optimised) => {
                let optimised = optimised?;
                built.millis.insert("optimize".into(), millis_since(start));
                let parts = optimised.stages.into_iter();
                built.millis.extend(parts.map(|(name, spent)| (format!("optimize/{name}"), spent)));
                match self.by_error {
                    true => optimised.sequence.ordered_by_error(&mesh),
                    false => optimised.sequence,
                }
            }
        };
        let start = Instant::now();
        built.stacks.push(Arc::new(CollapseStacks::build(mesh, &sequence)));
        built.millis.insert("stacks".into(), millis_since(start));
        Ok(sequence)
    }
}

/// Returns the milliseconds since an instant.
pub fn millis_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
