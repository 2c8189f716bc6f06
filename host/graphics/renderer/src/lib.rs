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
mod batch;
mod density_planes;
mod draw_instance;
mod draw_list;
mod draw_reduction;
mod error;
mod features;
mod frame;
mod frame_buffers;
mod ground;
mod index_cache;
mod instance_buckets;
mod instance_culling;
mod instance_transform;
mod layer;
mod material;
mod mesh_preparation;
mod model;
mod morph;
mod outline;
mod pick;
mod pipeline_description;
mod pipelines;
mod polylines;
mod quads;
mod quality;
mod renderer;
mod resolver;
mod scene_layer;
mod scene_pass;
mod scene_resources;
mod section;
mod section_draw;
mod shader_set;
mod shadows;
mod slender;
mod software;
mod sun_view;
mod targets;
mod tile_pixels;
mod uniform;

pub use busbar_culling::CameraView;
pub use busbar_density::{
    BrushedAxis, DensityCounts, DensityInput, DensityProgress, DensitySummary, MAX_DENSITY_AXES,
    MAX_DENSITY_BYTES, SLICE_RECORDS,
};
pub use busbar_gpu::{
    GpuError, MAX_STAGES, RecoveryAction, StageMillis, ValidationLog, WindowFrames, WindowHandles,
};
pub use busbar_panel_painter::{EguiFrame, MAX_PANEL_VERTICES};
pub use density_planes::DensityPlane;
pub use draw_instance::{
    DrawInstance, MeshAtCursor, ModelHandle, Morph, PATTERNS, ResolveRequest,
    highlight_with_pattern,
};
pub use draw_list::{DrawList, InstanceSource, MAX_DRAW_CHANGES};
pub use error::RenderError;
pub use frame::{Frame, FrameStats, MIN_SCENE_RESOLUTION, OutlineKind, OutlinedObject, Picture};
pub use frame_buffers::{MAX_FEATURE_HIGHLIGHTS, MAX_INSTANCES};
pub use ground::Ground;
pub use index_cache::{MAX_CACHED_INDEX_BYTES, MAX_FRAME_INDEX_BYTES};
pub use model::ModelUpload;
pub use morph::{MAX_MORPHED_BYTES, VERTEX_BYTES};
pub use pick::{PickState, PixelArea};
pub use polylines::{MAX_POLYLINE_PARTS, Polylines, WorldFace, WorldStroke};
pub use quality::Quality;
pub use renderer::{DeviceChoice, Renderer, RendererOptions};
pub use resolver::{MAX_PENDING_RESOLVE_BYTES, MAX_PENDING_RESOLVES};
pub use scene_resources::MAX_UPLOAD_BYTES_PER_FRAME;
pub use section::SectionPlane;
