//! Occlusion test of boxes, against large faces or drawn depth.

use busbar_culling::DepthTiles;
use busbar_geometry::Bounds;
use busbar_shaders::Instance;
use glam::Mat4;

use super::large_faces::OcclusionBuffer;
use crate::instance_transform::world_from_mesh;

/// Occlusion test against large faces or against the depth of the first pass.
#[derive(Clone, Copy)]
pub(super) enum OcclusionTest<'a> {
    LargeFaces(&'a OcclusionBuffer),
    FirstPassDepth(&'a DepthTiles),
}

impl OcclusionTest<'_> {
    /// Returns the transform from an instance's mesh to clip space, for
    /// [`OcclusionTest::is_box_visible`].
    pub(super) fn clip_from_mesh(self, instance: &Instance) -> Mat4 {
        match self {
            Self::LargeFaces(buffer) => buffer.clip_from_mesh(instance),
            Self::FirstPassDepth(drawn) => *drawn.clip_from_world() * world_from_mesh(instance),
        }
    }

    /// Reports whether any part of a box is in the picture and not occluded.
    #[inline]
    pub(super) fn is_box_visible(self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
        match self {
            Self::LargeFaces(buffer) => buffer.is_box_visible(clip_from_mesh, bounds),
            Self::FirstPassDepth(drawn) => drawn.is_visible(clip_from_mesh, bounds),
        }
    }
}
