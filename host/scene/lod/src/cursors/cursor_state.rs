//! Cursor of one instance, and the values that cursors are told in.

use busbar_geometry::Bounds;
use glam::Vec3;

use super::active_morphs::NO_TRANSITION;

/// Cursor of an instance that is not shown.
pub(super) const NOT_SHOWN: u32 = u32::MAX;
/// The level where the past plays no part.
pub(super) const NO_LEVEL: u32 = u32::MAX;

/// Bounds of a mesh without vertices.
pub(super) const EVERYWHERE: Bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

/// Drawn item: an instance of the graph or a merged group, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DrawItem {
    /// Mesh instance of the scene graph.
    Instance(usize),
    /// Merged group, drawn as its proxy.
    Group(usize),
}

/// A mesh at a cursor, by the indices of model and mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshCursor {
    /// Index of the model.
    pub model: usize,
    /// Index of the mesh in its model.
    pub mesh: usize,
    /// Number of collapses that are applied to the mesh.
    pub cursor: u32,
}

/// Resource that an instance needs before its cursor moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LodRequest {
    /// Mesh at the cursor.
    Mesh(MeshCursor),
    /// Morph data of the finer mesh, to or from this cursor.
    Morph(MeshCursor),
}

/// Level of detail of a model, summed over its instances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelDetail {
    /// Least and greatest theta wanted.
    pub theta: [f64; 2],
    /// True if policies choose theta instead of the operator.
    pub by_policy: bool,
    /// Entries to be collapsed.
    pub s1: u64,
    /// Number of collapsed entries.
    pub s2: u64,
    /// Number of live triangles.
    pub triangles: u64,
}

/// Cursor state of an instance; a site has a hundred thousand of them.
pub(super) struct InstanceCursor {
    /// Index of its kind.
    pub(super) kind: u32,
    /// Level of the policy, or [`NO_LEVEL`].
    pub(super) level: u32,
    /// World bounds, cached for each frame; infinite for a mesh without vertices.
    pub(super) bounds: Bounds,
    /// Theta that the policy wants.
    pub(super) theta: f64,
    pub(super) wanted: u32,
    /// Cursor shown; during a morph, that of the finer mesh.
    pub(super) shown: u32,
    /// Index of the way that it is on.
    pub(super) transition: u32,
    /// Live triangles where it is shown.
    pub(super) triangles: u32,
}

impl InstanceCursor {
    /// Creates the state of an instance in full detail.
    pub(super) fn new(kind: u32, bounds: Option<Bounds>, triangles: u32) -> Self {
        let (level, theta, transition) = (NO_LEVEL, 0.0, NO_TRANSITION);
        let bounds = bounds.unwrap_or(EVERYWHERE);
        Self { kind, level, bounds, theta, wanted: 0, shown: 0, transition, triangles }
    }

    pub(super) fn level(&self) -> Option<u32> {
        (self.level != NO_LEVEL).then_some(self.level)
    }

    /// Marks the instance as not shown.
    pub(super) fn hide(&mut self) {
        (self.wanted, self.shown, self.level) = (NOT_SHOWN, NOT_SHOWN, NO_LEVEL);
    }

    /// Reports whether the instance is shown at its wanted cursor.
    pub(super) fn is_ready(&self) -> bool {
        self.shown == self.wanted && self.shown != NOT_SHOWN
    }
}
