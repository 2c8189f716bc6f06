//! Instances to draw: a mesh of a model at a cursor, with its transform and tint.

use glam::Mat4;

/// Names an uploaded model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ModelHandle(pub(crate) u32);

impl ModelHandle {
    /// Makes the handle of an index, which [`Renderer::upload_model_at`] gives a model.
    ///
    /// [`Renderer::upload_model_at`]: crate::Renderer::upload_model_at
    pub fn from_index(index: u32) -> Self {
        Self(index)
    }
}

/// Patterns that tints may have: plain, striped, crossed and dotted, on the screen.
pub const PATTERNS: u32 = 4;

/// Makes a highlight with a pattern, by its number below [`PATTERNS`]. Between the pattern's marks
/// the tint is faint.
pub const fn highlight_with_pattern(
    [red, green, blue]: [f32; 3],
    strength: f32,
    pattern: u32,
) -> [f32; 4] {
    [red, green, blue, strength.clamp(0.0, 1.0) + 2.0 * pattern as f32]
}

/// One mesh drawn once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawInstance {
    /// Model that the mesh belongs to.
    pub model: ModelHandle,
    /// Index into the model's meshes.
    pub mesh: u32,
    /// Collapses done; beyond the last it means all.
    pub cursor: u32,
    /// Morph between this cursor and a coarser one, if any.
    pub morph: Option<Morph>,
    /// Transform from the mesh's space to the world; it may mirror.
    pub world_from_mesh: Mat4,
    /// Non-zero id that picking gives back.
    pub object: u32,
    /// Tint for hover, selection, alarm or state: linear rgb, strength from 0 to 1; more
    /// by a pattern, as [`highlight_with_pattern`] has it.
    pub highlight: [f32; 4],
    /// Object of the mesh's feature 0, those of the others after it. Features
    /// then stand in for this instance, in picking and in
    /// [`Frame::object_highlights`](crate::Frame::object_highlights); `None`, or 0,
    /// shows the mesh as one piece.
    pub first_feature: Option<u32>,
}

/// Geomorph of a mesh between its cursor and a coarser one: vertices move straight to their
/// representatives there. Its shadow stays that of the finer mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Morph {
    /// Collapses done there; beyond the last it means all.
    pub coarser: u32,
    /// 0 where it leaves, 1 where it arrives.
    pub weight: f32,
}

/// Request for geometry before a frame needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResolveRequest {
    /// A mesh to draw.
    Mesh(MeshAtCursor),
    /// The way to and from a cursor, for instances that are finer.
    MorphTarget(MeshAtCursor),
}

/// Mesh of a model with a number of collapses done; numbers beyond the last mean all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshAtCursor {
    /// Model that the mesh belongs to.
    pub model: ModelHandle,
    /// Index into the model's meshes.
    pub mesh: u32,
    /// Number of collapses done.
    pub cursor: u32,
}
