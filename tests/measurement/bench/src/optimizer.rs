//! Optimizer times: whole sequences, which hold every level, beside one level made by
//! meshoptimizer's `simplify`; all on one core, in its processor time.

use std::path::Path;

use anyhow::{Context, Result};
use busbar_geometry::CollapseStacks;
use busbar_plugin_host::{Catalog, MeshOptimizer};
use busbar_plugin_sdk::CollapseList;
use indicatif::ProgressBar;
use measure::meshoptimizer::{Input as PeerInput, Simplifier};
use serde_json::{Map, Value};
use weighted_collapse::Order;

use crate::affinity::OneCore;
use crate::optimizers::{Input, sequence};
use crate::report::Section;
use crate::scene::Scene;
use crate::series::Series;

/// Share of the triangles that `simplify` is to leave.
const TARGET: f64 = 0.30;
/// Greatest ratio of the paper's order to one `simplify` in time, from positions to death indices;
/// both see positions and triangles alone.
const PAPER_BAR: f64 = 0.25;
/// Greatest ratio of the order by quadric error to one `simplify` in time.
const QUADRIC_BAR: f64 = 1.5;

/// Measures without the plugins' boundary, and with it where `plugins` is a
/// folder of libraries.
pub(crate) fn run(
    scene: &Scene,
    rounds: usize,
    plugins: Option<&Path>,
    progress: &ProgressBar,
) -> Result<Section> {
    let _core = OneCore::hold()?;
    let peer = PeerInput::new(&scene.topology)?;
    let wanted = (scene.topology.triangles.len() as f64 * TARGET) as usize;
    let input = Input::new(&scene.mesh);
    let through = plugins.map(LoadedPlugins::load).transpose()?;

    let mut simplify = Series::new("meshoptimizer_simplify", "ms");
    let mut paper = Sequence::new("paper");
    let bare = scene.bare();
    let mut stacks = Series::new("paper_stacks_of_positions", "ms");
    let mut stacks_of_wedges = Series::new("paper_stacks_of_wedges", "ms");
    let mut quadric = Sequence::new("quadric");
    let mut ratios = [
        Series::new("paper_with_stacks_to_meshoptimizer", "").at_most(PAPER_BAR),
        Series::new("quadric_to_meshoptimizer", "").at_most(QUADRIC_BAR),
    ];
    let mut transport =
        [Series::new("paper_through_plugin", "ms"), Series::new("quadric_through_plugin", "ms")];
    let mut reached = 0;
    for _ in 0..rounds {
        reached = simplify.processor(|| peer.simplify(Simplifier::Plain, wanted))?.len();
        let list = paper.measure(|| input.weighted(Order::Paper, 1))?;
        let count = scene.mesh.positions.len();
        for (series, mesh) in [(&mut stacks, &bare), (&mut stacks_of_wedges, &scene.mesh)] {
            let mesh = mesh.clone();
            series
                .processor(|| anyhow::Ok(CollapseStacks::build(mesh, &sequence(&list, count)?)))?;
        }
        quadric.measure(|| input.quadric())?;
        ratios[0].push((paper.total.last() + stacks.last()) / simplify.last());
        ratios[1].push(quadric.total.last() / simplify.last());
        if let Some(through) = &through {
            for (series, plugin) in transport.iter_mut().zip(&through.plugins) {
                series.processor(|| plugin.optimize(&scene.mesh, |_| true))?;
            }
        }
        progress.inc(1);
    }
    let reached = reached as f64 / scene.topology.triangles.len() as f64;
    let mut series =
        vec![Series::exact("meshoptimizer_reached_of_triangles", "", reached), simplify];
    series.extend(paper.into_series());
    series.extend([stacks, stacks_of_wedges]);
    series.extend(quadric.into_series());
    series.extend(ratios);
    if through.is_some() {
        series.extend(transport);
    }
    Ok(Section { series })
}

/// Times of a sequence, and of its stages as the optimiser names them.
struct Sequence {
    name: &'static str,
    total: Series,
    stages: Vec<Series>,
}

impl Sequence {
    fn new(name: &'static str) -> Self {
        Self { name, total: Series::new(format!("{name}_sequence"), "ms"), stages: Vec::new() }
    }

    fn measure(&mut self, work: impl FnOnce() -> Result<CollapseList>) -> Result<CollapseList> {
        let list = self.total.processor(work)?;
        for (stage, millis) in list.stages() {
            let name = format!("{}_{stage}", self.name);
            let known = self.stages.iter().position(|series| series.name == name);
            let index = known.unwrap_or_else(|| {
                self.stages.push(Series::new(name, "ms"));
                self.stages.len() - 1
            });
            self.stages[index].push(*millis);
        }
        Ok(list)
    }

    fn into_series(self) -> impl Iterator<Item = Series> {
        std::iter::once(self.total).chain(self.stages)
    }
}

/// Optimisers loaded as a viewer loads them.
struct LoadedPlugins {
    plugins: [MeshOptimizer; 2],
}

impl LoadedPlugins {
    fn load(folder: &Path) -> Result<Self> {
        let catalog = Catalog::discover(&[folder.to_owned()]);
        let load = |id: &str| {
            let plugin = catalog.create(id, id, &Value::Object(Map::new()));
            plugin
                .and_then(MeshOptimizer::from_instance)
                .with_context(|| format!("no plugin {id} in {}: build it there", folder.display()))
        };
        Ok(Self { plugins: [load("weighted_collapse")?, load("quadric_collapse")?] })
    }
}
