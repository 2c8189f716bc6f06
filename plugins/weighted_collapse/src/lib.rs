//! Weighted edge collapse after Z.-Y. Qu and J.-Y. Huang, "A Fast Scene
//! Constructing Method for 3D Power Big Data Visualization", Journal of
//! Communications 10 (10), 2015, pp. 773-777, as a Busbar optimiser plugin.
//!
//! Edges of the welded mesh are found (`edges`), measured by Eq. 1-4
//! (`factors`), weighted by Eq. 5-10 (`weights`), sorted ascending (`sort`),
//! and collapsed in that static order: the smaller class of joined vertices
//! moves onto the larger (`forest`). Where the paper contradicts itself or
//! leaves something open, a [`Reading`] says how it is taken.

mod edges;
mod factors;
mod forest;
mod moments;
mod reading;
#[cfg(test)]
mod reference;
mod shares;
mod sort;
mod threads;
mod vector;
mod weights;

use busbar_plugin_sdk::{Error, Host, MeshOptimizer, Plugin};

pub use busbar_plugin_sdk::{Collapse, CollapseList, Mesh, Progress};
pub use reading::{BorderFlag, BorderWeight, Curvature, Reading};
pub use shares::{VarianceShares, variance_shares};
pub use threads::MAX_THREADS;

/// Triangles of a mesh at most: their sides are counted in 32 bits.
pub const MAX_TRIANGLES: usize = (u32::MAX / 3) as usize;

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
        let protected = self.settings.border_protection;
        let reading = if protected { Reading::BUSBAR } else { Reading::UNPROTECTED };
        collapse_list(mesh, &reading, MAX_THREADS, progress)
    }
}

/// Makes the collapse sequence of a mesh, with the times of its stages: edges,
/// weights, sort, collapse. Uses at most `max_threads` threads, and the result
/// does not depend on how many.
///
/// # Errors
/// A mesh of more than [`MAX_TRIANGLES`], or more vertices than fit into 31
/// bits; and [`Error::cancelled`] when `progress` says so.
pub fn collapse_list(
    mesh: Mesh<'_>,
    reading: &Reading,
    max_threads: usize,
    progress: &mut Progress<'_>,
) -> Result<CollapseList, Error> {
    check_size(&mesh)?;
    let threads = threads::count(mesh.triangles.len(), max_threads);
    let mut list = CollapseList::default();
    let edges = list.stage("edges", || edges::find(&mesh, threads));
    progress.report(0.3)?;
    let weights = list.stage("weights", || {
        let measured = weights::measure_all(&mesh, &edges, reading, threads);
        let coefficients = measured.coefficients(reading);
        measured.weigh(&coefficients, threads)
    });
    progress.report(0.6)?;
    let sorted = list.stage("sort", || sort::sort(&weights, threads));
    progress.report(0.8)?;
    list.collapses = list.stage("collapse", || forest::collapse(&mesh, &edges, &sorted));
    progress.report(1.0)?;
    Ok(list)
}

fn check_size(mesh: &Mesh<'_>) -> Result<(), Error> {
    let limits = [
        ("triangles", mesh.triangles.len(), MAX_TRIANGLES),
        ("vertices", mesh.positions.len(), forest::Classes::MAX_VERTICES),
    ];
    for (what, count, limit) in limits {
        if count > limit {
            return Err(Error::failed(format!(
                "the mesh has {count} {what}, at most {limit} are possible: split it"
            )));
        }
    }
    Ok(())
}

busbar_plugin_sdk::export_plugin!(WeightedCollapse: mesh_optimizer);
