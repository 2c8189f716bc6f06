//! Busbar's optimisers, called without their plugins' boundary.

use anyhow::{Result, anyhow};
use busbar_geometry::{Collapse, CollapseSequence, Mesh};
use busbar_plugin_sdk::{self as sdk, CollapseList, MeshOptimizer, Plugin, Progress};
use quadric_collapse::{QuadricCollapse, Settings};
use weighted_collapse::{Interpretation, Order};

/// Mesh in the form of an optimiser's input.
pub(crate) struct Input<'a> {
    mesh: &'a Mesh,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
}

impl<'a> Input<'a> {
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        Self {
            mesh,
            positions: mesh.positions.iter().map(|p| p.to_array()).collect(),
            triangles: mesh.triangles.iter().map(|&t| mesh.corner_positions(t)).collect(),
            normals: mesh.wedges.normal.iter().map(|n| n.to_array()).collect(),
            uvs: mesh.wedges.uv.iter().map(|uv| uv.to_array()).collect(),
        }
    }

    /// Runs the paper's weights in some order.
    pub(crate) fn weighted(&self, order: Order, max_threads: usize) -> Result<CollapseList> {
        let progress = &mut Progress::detached();
        weighted_collapse::collapse_list(
            self.view(),
            &Interpretation::BUSBAR,
            order,
            max_threads,
            progress,
        )
        .map_err(|error| anyhow!("weighted_collapse: {}", error.message()))
    }

    /// Runs the order by quadric error, on all cores that the thread may use.
    pub(crate) fn quadric(&self) -> Result<CollapseList> {
        let optimize = || {
            let plugin = QuadricCollapse::create(Settings::default(), sdk::testing::host())?;
            plugin.optimize(self.view(), &mut Progress::detached())
        };
        optimize().map_err(|error| anyhow!("quadric_collapse: {}", error.message()))
    }

    fn view(&self) -> sdk::Mesh<'_> {
        sdk::Mesh {
            positions: &self.positions,
            triangles: &self.triangles,
            wedges: Some(sdk::Wedges {
                corners: &self.mesh.triangles,
                positions: &self.mesh.wedges.position,
                normals: &self.normals,
                uvs: &self.uvs,
                sections: &self.mesh.wedges.section,
            }),
        }
    }
}

/// Converts a list to a checked sequence over so many positions.
pub(crate) fn sequence(list: &CollapseList, positions: usize) -> Result<CollapseSequence> {
    let entry = |c: &sdk::Collapse| Collapse { removed: c.removed, kept: c.kept, error: c.error };
    Ok(CollapseSequence::new(list.collapses.iter().map(entry).collect(), positions as u32)?)
}
