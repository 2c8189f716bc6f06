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

mod batch;
mod camera;
mod content;
mod density;
mod draw_list;
mod drawn_depth;
mod error;
mod features;
mod frame;
mod frustum;
mod gathering;
mod ground;
mod index_cache;
mod layer;
mod masked_depth;
mod material;
mod model;
mod morph;
mod near_first;
mod occluders;
mod occlusion;
mod outline;
mod panels;
mod pick;
mod pipelines;
mod polylines;
mod recipe;
mod renderer;
mod resolver;
mod roster;
mod scene_pass;
mod screen_box;
mod section;
mod shadows;
mod sight;
mod slender;
mod stream;
mod targets;
mod uniform;
mod words;

pub use busbar_gpu::{
    Cure, GpuError, LargePages, MAX_STAGES, StageMillis, ValidationLog, WindowHandles,
    give_back_freed_memory, load_within_one_heap,
};
pub use camera::CameraView;
pub use content::MAX_UPLOAD_BYTES_PER_FRAME;
pub use density::{
    BrushedAxis, DensityCounts, DensityInput, DensityProgress, DensitySummary, MAX_DENSITY_AXES,
    MAX_DENSITY_BYTES, PlaneInWorld, SLICE_RECORDS,
};
pub use draw_list::{DrawList, Instances, MAX_DRAW_CHANGES};
pub use error::RenderError;
pub use frame::{
    DrawInstance, EguiFrame, Frame, FrameStats, MeshAtCursor, Morph, OutlineKind, Outlined,
    PATTERNS, Picture, Wanted, patterned,
};
pub use ground::Ground;
pub use index_cache::{MAX_CACHED_INDEX_BYTES, MAX_FRAME_INDEX_BYTES};
pub use model::{ModelHandle, ModelUpload};
pub use morph::{MAX_MORPHED_BYTES, VERTEX_BYTES};
pub use panels::MAX_PANEL_VERTICES;
pub use pick::{PickState, PixelArea};
pub use polylines::{FaceInWorld, MAX_POLYLINE_PARTS, Polylines, StrokeInWorld};
pub use renderer::{DeviceChoice, Quality, Renderer, RendererOptions};
pub use resolver::{MAX_PENDING_RESOLVE_BYTES, MAX_PENDING_RESOLVES};
pub use section::SectionPlane;
pub use stream::{MAX_FEATURE_HIGHLIGHTS, MAX_INSTANCES};
