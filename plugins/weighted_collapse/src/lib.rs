//! Weighted edge collapse after Z.-Y. Qu and J.-Y. Huang, "A Fast Scene
//! Constructing Method for 3D Power Big Data Visualization", Journal of
//! Communications 10 (10), 2015, pp. 773-777, as a Busbar optimiser plugin.
//!
//! Edges of the welded mesh are weighted by Eq. 1-10 ([`weights`]), sorted
//! ascending, and collapsed in that static order: the smaller class of joined
//! vertices moves onto the larger ([`order`]). Where the paper contradicts
//! itself or leaves something open, the reading is documented at the function
//! that makes it.

mod edges;
mod order;
mod weights;

use busbar_plugin_sdk::{CollapseList, Error, Host, Mesh, MeshOptimizer, Plugin, Progress};

/// Settings of the optimiser.
#[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Whether borders are kept longer: the paper's flag F, with curvature pi
    /// on borders. Off is the paper's Fig. 8.
    border_protection: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { border_protection: true }
    }
}

struct WeightedCollapse {
    settings: Settings,
}

impl Plugin for WeightedCollapse {
    const ID: &'static str = "weighted_collapse";
    const NAME: &'static str = "Weighted collapse";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Orders edge collapses by length, border, area and curvature (Qu and Huang, 2015).";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl MeshOptimizer for WeightedCollapse {
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error> {
        let mut list = CollapseList::default();
        let edges = list.stage("edges", || edges::find(&mesh));
        progress.report(0.4)?;
        let weights = list
            .stage("weights", || weights::weigh(&mesh, &edges, self.settings.border_protection));
        progress.report(0.6)?;
        let sorted = list.stage("sort", || order::sort(&weights));
        progress.report(0.8)?;
        list.collapses = list.stage("collapse", || order::collapse(&mesh, &edges, &sorted));
        progress.report(1.0)?;
        Ok(list)
    }
}

busbar_plugin_sdk::export_plugin!(WeightedCollapse: mesh_optimizer);
