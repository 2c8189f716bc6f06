//! The viewer: a loaded scene becomes frames.
//!
//! [`Viewer`] steps a loaded scene frame by frame, in a window or offscreen. [`reload::Reloader`]
//! watches the configuration and applies its changes.
//!
//! Invariant: no Vulkan type and no protocol message crosses this public interface.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod camera;
mod chart;
mod clock;
mod contour;
mod cpu_clock;
mod device_recovery;
mod environment;
mod equipment_tree;
mod error;
mod faceplate;
mod flow_arrows;
mod frame_budget;
mod graphics_device;
mod highlight;
pub mod highlight_styles;
mod index_remap;
mod labels;
mod measurement_chain;
mod moving_parts;
mod origin_tracker;
mod outlines;
mod overlay_geometry;
mod overlay_instances;
mod panel_rows;
mod pause_monitor;
mod pick_queue;
mod ray_casting;
mod records;
pub mod reload;
mod renderer_options;
mod scene_draw_list;
mod search_index;
mod stats;
mod switch_symbols;
mod tag_filter;
mod telemetry_instance;
mod uploaded_models;
mod verdicts;
mod viewer;

/// The states of an alarm, by the letters of IEC 62682.
pub use busbar_alarms::State as AlarmState;
pub use busbar_renderer::{
    HugePageAllocator, Picture, Quality, RenderError, RendererOptions, SectionPlane, WindowHandles,
    configure_allocator,
};
pub use busbar_ui::{AlarmAction, ChartCommand};
pub use error::ViewError;
pub use graphics_device::graphics_device;
pub use renderer_options::renderer_options;
pub use stats::{
    AlarmStats, CameraStats, ChartAxisStats, ChartEvidence, ChartStats, FaceplateStats, LinkStats,
    PluginStats, RecordStats, ReloadStats, Stats, TagStats, ViewHealth,
};
pub use verdicts::{OverlayVerdicts, VerdictText};
pub use viewer::{
    CameraPose, ChangedAlarm, FrameOutput, FrameStageMillis, HostTagValue, MAX_SELECTED, Viewer,
};
