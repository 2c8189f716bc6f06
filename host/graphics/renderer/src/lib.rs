//! Draws collapse-stacked meshes: upload, resolve, draw, paint panels, pick.
//!
//! Invariant: the renderer knows no tags, no configuration and no plugins; it
//! is told what to draw, frame by frame.
//!
//! Vertices are uploaded once a model. What changes with a cursor is an index
//! buffer, resolved when a (model, mesh, cursor) is first asked for and shared
//! by all instances at that cursor. A frame waits for what it draws; whoever
//! asks for it before ([`Renderer::request`]) and draws it when it is there
//! ([`Renderer::triangles_at`]) never waits. Between two cursors a mesh may be drawn on
//! its way ([`DrawInstance::morph`]).
#![doc = include_str!("../DESIGN.md")]

mod ambient_occlusion;
mod camera;
mod cpu_triangle_culling;
mod density;
mod draw_list;
mod draw_plan;
mod error;
mod features;
mod first_pass_depth;
mod frame;
mod frame_buffers;
mod frustum;
mod ground;
mod index_cache;
mod instance_buckets;
mod layer;
mod masked_occlusion;
mod material;
mod model;
mod morph;
mod occluders;
mod outline;
mod panels;
mod pick;
mod pipeline_description;
mod pipelines;
mod polylines;
mod renderer;
mod resolver;
mod scene_pass;
mod scene_resources;
mod screen_box;
mod section;
mod shader_set;
mod shadows;
mod slender;
mod targets;
mod two_pass_occlusion;
mod uniform;
mod visibility;

pub use busbar_gpu::{
    GpuError, HugePageAllocator, MAX_STAGES, RecoveryAction, StageMillis, ValidationLog,
    WindowHandles, configure_allocator, release_freed_memory,
};
pub use camera::CameraView;
pub use density::{
    BrushedAxis, DensityCounts, DensityInput, DensityPlane, DensityProgress, DensitySummary,
    MAX_DENSITY_AXES, MAX_DENSITY_BYTES, SLICE_RECORDS,
};
pub use draw_list::{DrawList, InstanceSource, MAX_DRAW_CHANGES};
pub use error::RenderError;
pub use frame::{
    DrawInstance, EguiFrame, Frame, FrameStats, MeshAtCursor, Morph, OutlineKind, OutlinedObject,
    PATTERNS, Picture, ResolveRequest, highlight_with_pattern,
};
pub use frame_buffers::{MAX_FEATURE_HIGHLIGHTS, MAX_INSTANCES};
pub use ground::Ground;
pub use index_cache::{MAX_CACHED_INDEX_BYTES, MAX_FRAME_INDEX_BYTES};
pub use model::{ModelHandle, ModelUpload};
pub use morph::{MAX_MORPHED_BYTES, VERTEX_BYTES};
pub use panels::MAX_PANEL_VERTICES;
pub use pick::{PickState, PixelArea};
pub use polylines::{MAX_POLYLINE_PARTS, Polylines, WorldFace, WorldStroke};
pub use renderer::{DeviceChoice, Quality, Renderer, RendererOptions};
pub use resolver::{MAX_PENDING_RESOLVE_BYTES, MAX_PENDING_RESOLVES};
pub use scene_resources::MAX_UPLOAD_BYTES_PER_FRAME;
pub use section::SectionPlane;
