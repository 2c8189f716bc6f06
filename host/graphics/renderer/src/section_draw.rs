//! Draws of one section of a batch, sorted by render state.

use std::ops::Range;

use busbar_gpu::{BindGroup, DrawCall};

use crate::index_cache::ResolvedIndices;

/// Render state shared by merged draws: pipeline, raster state, material, and the blocks of
/// vertices and indices.
pub(crate) type StateKey = (u8, [bool; 3], u32, [u32; 2]);

/// A draw of one section.
pub(crate) struct SectionDraw<'a> {
    pub(crate) order: StateKey,
    pub(crate) groups: [&'a BindGroup; 4],
    /// All but the groups.
    pub(crate) draw: DrawCall<'a>,
    /// Origin of the triangles; `None` where shaders count vertices from the mesh's first.
    pub(crate) source: Option<TriangleSource<'a>>,
}

/// Origin of a section's triangles.
#[derive(Clone)]
pub(crate) struct TriangleSource<'a> {
    pub(crate) resolved: &'a ResolvedIndices,
    /// Number of the batch among those that are drawn together.
    pub(crate) batch: u32,
    /// Morphing batch: its vertices move.
    pub(crate) morphs: bool,
    /// Slender triangles, which are widened and seen from all sides.
    pub(crate) is_slender: bool,
    /// Range of triangles within the mesh.
    pub(crate) range: Range<u32>,
}

impl SectionDraw<'_> {
    /// Returns the draw call of all instances and triangles.
    pub(crate) fn call(&self) -> DrawCall<'_> {
        let groups = &self.groups[..self.draw.pipeline.group_count()];
        DrawCall { groups, ..self.draw.clone() }
    }
}
