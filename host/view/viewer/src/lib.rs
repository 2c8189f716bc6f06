//! The viewer: a loaded scene becomes frames.
//!
//! [`Viewer`] steps a loaded scene frame by frame, in a window or offscreen. [`reload::Reloader`]
//! watches the configuration and applies its changes.
//!
//! Invariant: no Vulkan type and no protocol message crosses this public interface.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod clock;
mod detail_control;
mod device_recovery;
mod environment;
mod equipment_panels;
mod equipment_tree;
mod error;
mod faceplate;
mod frame_budget;
mod frame_statistics;
mod freed_memory;
mod graphics_device;
mod hidden_labels;
mod host_program;
mod interaction;
mod measurement_chain;
mod motion_resolution;
mod object_numbers;
mod panel_frame;
mod panel_rows;
mod pick_queue;
mod ray_casting;
mod records;
pub mod reload;
mod renderer_options;
mod scene_draw_list;
mod scene_drawing;
mod search_index;
mod site_definition;
mod stats;
mod tag_filter;
mod uploaded_models;
mod view_renderer;
mod view_target;
mod viewer;

pub use busbar_renderer::{
    Picture, Quality, RenderError, RendererOptions, SectionPlane, WindowHandles,
};
/// Highlights of equipment in alarm, of unknown state, or selected.
pub use busbar_scene_overlays::highlight_styles;
pub use busbar_scene_overlays::{ChartAxisStats, ChartEvidence, ChartStats};
pub use busbar_site::{HostTagValue, OverlayVerdicts, VerdictText};
/// States of alarms, and actions on them (IEC 62682).
pub use busbar_types::{AlarmAction, AlarmState};
pub use busbar_ui::ChartCommand;
pub use error::ViewError;
pub use frame_statistics::FrameStageMillis;
pub use freed_memory::set_memory_release;
pub use graphics_device::graphics_device;
pub use interaction::MAX_SELECTED;
pub use renderer_options::renderer_options;
pub use stats::{
    AlarmStats, CameraStats, FaceplateStats, LinkStats, PluginStats, RecordStats, ReloadStats,
    Stats, TagStats, ViewHealth,
};
pub use viewer::{CameraPose, ChangedAlarm, FrameOutput, Viewer};
