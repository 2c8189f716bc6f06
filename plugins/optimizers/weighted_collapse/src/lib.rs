//! Weighted edge collapse after Z.-Y. Qu and J.-Y. Huang, "A Fast Scene
//! Constructing Method for 3D Power Big Data Visualization", Journal of
//! Communications 10 (10), 2015, pp. 773-777, as a Busbar optimiser plugin.
//!
//! Edges of the welded mesh are found (`edges`), measured by Eq. 1-4
//! (`factors`), weighted by Eq. 5-10 (`weights`), sorted ascending (`sort`),
//! and collapsed in that static order: the smaller class of joined vertices
//! moves onto the larger (`forest`). Where the paper contradicts itself or
//! leaves something open, a [`Interpretation`] says how it is taken. Beyond the paper,
//! [`Order`] has two orders that keep the surface whole (`greedy`).

mod arc_cosine;
mod edges;
mod factors;
mod forest;
mod greedy;
mod guards;
mod interpretation;
mod moments;
mod queue;
#[cfg(test)]
mod reference;
mod regularity;
mod sort;
mod surface;
mod threads;
mod variance_shares;
mod vector;
mod weights;

use busbar_plugin_sdk::{Error, Host, MeshOptimizer, Plugin};

use crate::regularity::RegularMesh;
pub use busbar_plugin_sdk::{Collapse, CollapseList, Mesh, Progress};

pub use interpretation::{BorderFlag, BorderWeight, Curvature, Interpretation};
pub use threads::MAX_THREADS;
pub use variance_shares::{VarianceShares, variance_shares};

/// Triangles of a mesh at most: their sides are counted in 32 bits.
pub const MAX_TRIANGLES: usize = (u32::MAX / 3) as usize;

/// Progress when the static order is known.
const SORTED: f32 = 0.5;

/// Settings of the optimiser.
#[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Border protection: the paper's flag F, with curvature pi on borders. Off is the paper's Fig.
    /// 8.
    border_protection: bool,
    /// Order in which edges are collapsed.
    order: Order,
}

impl Default for Settings {
    fn default() -> Self {
        Self { border_protection: true, order: Order::Paper }
    }
}

/// Order in which edges are collapsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// By W of the whole mesh, as the paper has it.
    Paper,
    /// By W of the whole mesh, but a collapse that would fold a face over or
    /// change the topology waits until it would not.
    Guarded,
    /// By W of the mesh as it is after each collapse, guarded too.
    Reweighted,
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
    // The paper's factors are of the shape alone.
    const READS_WEDGES: bool = false;

    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error> {
        let protected = self.settings.border_protection;
        let interpretation =
            if protected { Interpretation::BUSBAR } else { Interpretation::UNPROTECTED };
        collapse_list(mesh, &interpretation, self.settings.order, MAX_THREADS, progress)
    }
}

/// Makes the collapse sequence of a mesh, with the times of its stages: edges,
/// weights, sort, collapse. Uses at most `max_threads` threads, and the result
/// does not depend on how many.
///
/// # Errors
/// A mesh of more than [`MAX_TRIANGLES`] or 2^31 - 1 vertices, or with a
/// triangle that does not have three different ones of them; and
/// [`Error::cancelled`] when `progress` says so.
pub fn collapse_list(
    mesh: Mesh<'_>,
    interpretation: &Interpretation,
    order: Order,
    max_threads: usize,
    progress: &mut Progress<'_>,
) -> Result<CollapseList, Error> {
    check(&mesh)?;
    let threads = threads::count(mesh.triangles.len(), max_threads);
    // A mesh is the paper's model.
    let mut list = CollapseList::default();
    list.theta_by_mesh = order == Order::Paper;
    let regular = match order {
        Order::Paper => None,
        Order::Guarded | Order::Reweighted => list.stage("shells", || RegularMesh::new(&mesh)),
    };
    let mesh = regular.as_ref().map_or(mesh, RegularMesh::mesh);
    let edges = list.stage("edges", || edges::find(&mesh, threads));
    progress.report(0.2)?;
    let (mut weights, coefficients) = list.stage("weights", || {
        let measured = weights::measure_all(&mesh, &edges, interpretation, threads);
        let coefficients = measured.coefficients(interpretation);
        (measured.weigh(&coefficients, threads), coefficients)
    });
    progress.report(0.4)?;
    if order == Order::Paper {
        forest::collapse(&mesh, &edges, &weights, sort::PART, &mut list);
    } else {
        if let Some(regular) = &regular {
            for (weight, &ends) in weights.iter_mut().zip(&edges.ends) {
                *weight = regular.ordering_weight(*weight, ends);
            }
        }
        let sorted = list.stage("sort", || sort::sort(&weights));
        progress.report(SORTED)?;
        let reweighting = (order == Order::Reweighted)
            .then_some(greedy::Reweighting { interpretation, coefficients });
        let keys = greedy::EdgeKeys { weights: &weights, regular: regular.as_ref(), reweighting };
        let collapses = || greedy::collapse(mesh, &edges, &sorted, &keys, progress);
        list.collapses = list.stage("collapse", collapses)?;
        if let Some(regular) = &regular {
            regular.restore_numbers(&mut list.collapses);
        }
    }
    progress.report(1.0)?;
    Ok(list)
}

/// Refuses meshes that the stages cannot count or index.
fn check(mesh: &Mesh<'_>) -> Result<(), Error> {
    let vertices = mesh.positions.len();
    let limits = [
        ("triangles", mesh.triangles.len(), MAX_TRIANGLES),
        ("vertices", vertices, forest::Classes::MAX_VERTICES),
    ];
    for (what, count, limit) in limits {
        if count > limit {
            return Err(Error::failed(format!(
                "the mesh has {count} {what}, at most {limit} are possible: split it"
            )));
        }
    }
    let is_bad =
        |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a || a.max(b).max(c) as usize >= vertices;
    match mesh.triangles.iter().position(is_bad) {
        None => Ok(()),
        Some(triangle) => Err(Error::failed(format!(
            "triangle {triangle} has no three different corners among {vertices} vertices: weld \
             the mesh and drop such triangles first"
        ))),
    }
}

busbar_plugin_sdk::export_plugin!(WeightedCollapse: mesh_optimizer);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_cannot_be_are_refused() {
        let positions = [[0.0; 3]; 3];
        for corners in [[0, 1, 1], [2, 1, 2], [0, 0, 1], [0, 1, 3]] {
            let mesh =
                Mesh { positions: &positions, triangles: &[[0, 1, 2], corners], wedges: None };
            for order in [Order::Paper, Order::Guarded, Order::Reweighted] {
                let progress = &mut Progress::detached();
                let error =
                    collapse_list(mesh, &Interpretation::BUSBAR, order, 1, progress).unwrap_err();
                assert!(error.message().contains("triangle 1"), "{error}");
            }
            assert!(variance_shares(mesh, &Interpretation::BUSBAR).is_err());
        }
    }
}
