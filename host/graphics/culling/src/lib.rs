//! Culling on the processor: what of a scene cannot be seen by a camera.
//!
//! Frustum culling of bounding spheres, back-face culling of triangles in blocks, and occlusion
//! culling of boxes: behind large flat faces (masked depth), or behind depth that was drawn
//! (tiles).
//!
//! Invariants: nothing here knows a device or what is drawn with it. Tests are conservative: what
//! can be seen is never culled.

mod camera;
mod depth_tiles;
mod face_filter;
mod frustum;
mod masked_occlusion;
mod occluders;
mod screen_box;
mod triangle_blocks;

pub use camera::CameraView;
pub use depth_tiles::{DepthTiles, TILE_PIXELS};
pub use face_filter::{FaceFilter, is_outside_frustum};
pub use frustum::{BoundingSphere, Frustum};
pub use masked_occlusion::MaskedDepthBuffer;
pub use occluders::{MAX_CORNERS, Occluder, occluder_bytes, occluders_of};
pub use screen_box::{ScreenBox, hull};
pub use triangle_blocks::TriangleBlocks;
