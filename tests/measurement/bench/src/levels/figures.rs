//! Figures of a level, measured alike for all methods.

use anyhow::{Context, Result};
use busbar_geometry::{Topology, count_components};
use measure::{
    EdgeCounts, Gallery, PictureError, Reference, SurfaceError, duplicates, vertices_in_use,
};
use serde::Serialize;

/// Number of points drawn on each surface, with their seed.
const SAMPLES: usize = 100_000;
const SEED: u64 = 20_150_773;

/// Original mesh as the reference of its levels.
pub(crate) struct Original {
    reference: Reference,
    gallery: Gallery,
    /// Counts before any simplification.
    pub(crate) counts: Counts,
}

/// Counts of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Counts {
    /// Number of vertices that triangles use.
    pub(crate) vertices: usize,
    pub(crate) triangles: usize,
    /// Number of connected components.
    pub(crate) components: u32,
    /// Number of connected sets of edges with one triangle.
    pub(crate) border_loops: u64,
    /// Number of edges with more than two triangles.
    pub(crate) non_manifold: u64,
    /// Number of triangles on the same vertices as another, as a share of all.
    pub(crate) duplicates: f64,
}

/// Figures of a level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Figures {
    pub(crate) counts: Counts,
    /// Distances and normals; none without a surface.
    pub(crate) error: Option<SurfaceError>,
    pub(crate) picture: PictureError,
}

impl Counts {
    fn count(mesh: &Topology) -> Self {
        let edges = EdgeCounts::count(mesh.positions.len(), &mesh.triangles);
        let triangles = mesh.triangles.len();
        Self {
            vertices: vertices_in_use(&mesh.triangles),
            triangles,
            components: count_components(mesh.positions.len() as u32, &mesh.triangles).referenced,
            border_loops: edges.border_loops,
            non_manifold: edges.non_manifold,
            duplicates: duplicates(&mesh.triangles) as f64 / triangles.max(1) as f64,
        }
    }
}

impl Original {
    pub(crate) fn new(mesh: &Topology) -> Result<Self> {
        Ok(Self {
            reference: Reference::new(mesh, SAMPLES, SEED)?,
            gallery: Gallery::new(mesh)?,
            counts: Counts::count(mesh),
        })
    }

    /// Returns the diagonal that distances are relative to, metres.
    pub(crate) fn diagonal(&self) -> f64 {
        self.reference.diagonal()
    }

    pub(crate) fn figures(&self, level: &Topology) -> Result<Figures> {
        Ok(Figures {
            counts: Counts::count(level),
            error: self.reference.compare(level),
            picture: self.gallery.compare(level).context("pictures cannot be compared")?,
        })
    }
}
