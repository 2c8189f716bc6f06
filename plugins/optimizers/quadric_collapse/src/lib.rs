//! Plugin `quadric_collapse`: the best picture at a given number of vertices.
//!
//! Each connected piece of the mesh, a *shell*, is simplified greedily down to
//! one vertex by half-edge collapses (`reduce`), the cheapest first; no
//! vertex moves to a new place. What a collapse costs is how far the faces that
//! its vertex stands for are left behind (plane quadrics, Garland and Heckbert,
//! SIGGRAPH 1997), area that is lost, and attributes that do not fit
//! (`collapse_cost`). The collapses that were done, those of all shells in order of
//! cost (`sequence`), are the static list that the host goes up and down.
//!
//! Order: costs are integrals over area of squared distance (fourth power of
//! metres), so the sequence keeps the mean distance small. Error: each entry
//! carries the largest error of a collapse so far in metres, see
//! `reduce::Step`.
#![doc = include_str!("../DESIGN.md")]

mod attributes;
mod collapse_cost;
mod features;
mod pieces;
mod quadric;
mod queue;
mod reduce;
mod sequence;
mod surface;

use busbar_plugin_sdk::{CollapseList, Error, Host, Mesh, MeshOptimizer, Plugin, Progress};
use mesh_shells::Shells;

use crate::attributes::Attributes;
use crate::collapse_cost::{Source, Weights};

/// Largest value of a weight.
const MAX_WEIGHT: f64 = 1e6;

/// Settings of the optimiser.
#[derive(Clone, Copy, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Weight of shading and textures against shape, 0 to 1,000,000. A normal turned by an angle
    /// counts like a surface left behind by that angle times the edge's length times the root of
    /// this.
    pub attribute_weight: f64,
    /// Weight of open borders and of the seams of textures and materials against area, 0 to
    /// 1,000,000.
    pub border_weight: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { attribute_weight: 0.1, border_weight: 1.0 }
    }
}

/// Mesh optimiser by quadric error.
pub struct QuadricCollapse {
    weights: Weights,
}

impl Plugin for QuadricCollapse {
    const ID: &'static str = "quadric_collapse";
    const NAME: &'static str = "Quadric collapse";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Orders half-edge collapses by quadric error, lost area and attributes.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        let Settings { attribute_weight, border_weight } = settings;
        for (name, weight) in
            [("attribute_weight", attribute_weight), ("border_weight", border_weight)]
        {
            if !(0.0..=MAX_WEIGHT).contains(&weight) {
                let text = format!("settings, {name}: {weight} is not in 0 to {MAX_WEIGHT}");
                return Err(Error::settings(text));
            }
        }
        Ok(Self { weights: Weights { attribute: attribute_weight, border: border_weight } })
    }
}

/// Limits of the work. The sequence does not depend on `threads`.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Threads, at least 1.
    pub threads: usize,
    /// A shell with more triangles is worked on in parts of at most as many.
    pub part_triangles: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { threads: usize::MAX, part_triangles: 1 << 16 }
    }
}

impl MeshOptimizer for QuadricCollapse {
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error> {
        self.optimize_within(&Limits::default(), mesh, progress)
    }
}

impl QuadricCollapse {
    /// Makes the sequence within limits.
    ///
    /// # Errors
    /// [`Error::cancelled`].
    pub fn optimize_within(
        &self,
        limits: &Limits,
        mesh: Mesh<'_>,
        progress: &mut Progress<'_>,
    ) -> Result<CollapseList, Error> {
        let mut list = CollapseList::default();
        progress.report(0.0)?;
        let shells = list.stage("shells", || Shells::find(&mesh));
        let attributes = list.stage("wedges", || Attributes::new(&mesh));
        let source = Source {
            mesh: &mesh,
            shells: &shells,
            attributes: attributes.as_ref(),
            weights: self.weights,
        };
        let mut steps =
            list.stage("collapse", || sequence::reduce_all(source, limits, progress))?;
        list.collapses = list.stage("merge", || {
            sequence::remove_collapsed_shells(&shells, &mut steps);
            sequence::merge(steps)
        });
        progress.report(1.0)?;
        Ok(list)
    }
}

busbar_plugin_sdk::export_plugin!(QuadricCollapse: mesh_optimizer);
