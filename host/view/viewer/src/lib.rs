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
mod detail_control;
mod device_recovery;
mod environment;
mod equipment_panels;
mod equipment_tree;
mod error;
mod faceplate;
mod flow_arrows;
mod frame_budget;
mod frame_statistics;
mod freed_memory;
mod graphics_device;
mod highlight;
pub mod highlight_styles;
mod host_program;
mod interaction;
mod labels;
mod measurement_chain;
mod moving_parts;
mod object_numbers;
mod outlines;
mod overlay_geometry;
mod overlay_layers;
mod panel_frame;
mod panel_rows;
mod pick_queue;
mod ray_casting;
mod records;
pub mod reload;
mod renderer_options;
mod scene_draw_list;
mod scene_drawing;
mod scene_overlays;
mod search_index;
mod site_definition;
mod stats;
mod switch_symbols;
mod tag_filter;
mod uploaded_models;
mod view_renderer;
mod view_target;
mod viewer;

/// The states of an alarm, by the letters of IEC 62682.
pub use busbar_alarms::State as AlarmState;
pub use busbar_renderer::{
    Picture, Quality, RenderError, RendererOptions, SectionPlane, WindowHandles,
};
pub use busbar_site::{HostTagValue, OverlayVerdicts, VerdictText};
pub use busbar_ui::{AlarmAction, ChartCommand};
pub use error::ViewError;
pub use frame_statistics::FrameStageMillis;
pub use freed_memory::set_memory_release;
pub use graphics_device::graphics_device;
pub use interaction::MAX_SELECTED;
pub use renderer_options::renderer_options;
pub use stats::{
    AlarmStats, CameraStats, ChartAxisStats, ChartEvidence, ChartStats, FaceplateStats, LinkStats,
    PluginStats, RecordStats, ReloadStats, Stats, TagStats, ViewHealth,
};
pub use viewer::{CameraPose, ChangedAlarm, FrameOutput, Viewer};
