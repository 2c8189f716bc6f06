//! The viewer: a configuration becomes a scene, a scene becomes frames.
//!
//! [`LoadedScene::load`] reads a configuration and everything it names, and reports every fault.
//! [`Viewer`] steps the scene frame by frame, in a window or offscreen. [`optimize`] runs one model
//! through one optimizer; [`import_scene`] creates a configuration from a model and a point list.
//!
//! Invariant: no Vulkan type and no protocol message crosses this public interface.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod camera;
mod chart;
mod clock;
mod color;
mod commands;
mod contour;
mod detail_control;
mod device_recovery;
mod environment;
mod equipment;
mod equipment_panels;
mod equipment_tree;
mod error;
mod faceplate;
mod file_version;
mod flow_arrows;
mod frame_budget;
mod frame_statistics;
mod graphics_device;
mod highlight;
pub mod highlight_styles;
mod host_program;
mod interaction;
mod labels;
mod load;
mod lod;
mod measurement_chain;
mod moving_parts;
mod object_numbers;
pub mod optimize;
mod outlines;
mod overlay_geometry;
mod overlay_layers;
mod panel_frame;
mod panel_rows;
mod pick_queue;
mod point_import;
mod ray_casting;
mod records;
pub mod reload;
mod scene_draw_list;
mod scene_drawing;
mod scene_overlays;
mod search_index;
mod site_definition;
mod stack_builder;
mod stats;
mod switch_symbols;
mod tag_filter;
mod uploaded_models;
mod view_renderer;
mod view_target;
mod viewer;

/// The states of an alarm, by the letters of IEC 62682.
pub use busbar_alarms::State as AlarmState;
pub use busbar_audit_log::{LogError as AuditLogError, Verification, verify as verify_audit_log};
pub use busbar_chart as charts;
pub use busbar_config::{
    Diagnostic, LogConfig, LogFormatConfig, MAX_THETA_SCALE, MetricsConfig, Severity, schema,
};
pub use busbar_plugin_host::{
    Catalog, CommandExit, CommandReport, DiagnosticLevel, FaultKind, LoadRules, PluginInfo,
    RejectedLibrary, Simulation, SimulationStatus, sign_library,
};
pub use busbar_plugin_process::{
    CommandError, Isolation, Plugin, PluginCatalog, serve as serve_plugin,
};
pub use busbar_point_import::{ListFault, PluginInstance};
pub use busbar_renderer::{
    HugePageAllocator, Picture, Quality, RenderError, RendererOptions, SectionPlane, WindowHandles,
    configure_allocator,
};
pub use busbar_site::{HostTagValue, OverlayVerdicts, VerdictText};
pub use busbar_ui::{AlarmAction, ChartCommand};
pub use commands::{OfferedCommand, offered_commands, plugin_with_command};
pub use error::{LoadError, ViewError};
pub use frame_statistics::FrameStageMillis;
pub use graphics_device::graphics_device;
pub use interaction::MAX_SELECTED;
pub use load::{
    CheckedLink, DevicePointSource, DevicePoints, LoadProgress, LoadedScene, MAX_CONFIG_FILE_BYTES,
    POINTS_COMMAND, PreparedReload, ReloadError, SimulatedDevice, SimulatedDevices, check_links,
    plugin_catalog,
};
pub use point_import::{ImportedScene, SceneImportError, SceneRequest, import_scene};
pub use stats::{
    AlarmStats, CameraStats, ChartAxisStats, ChartEvidence, ChartStats, FaceplateStats, LinkStats,
    LoadMillis, PluginStats, RecordStats, ReloadStats, Stats, TagStats, ViewHealth,
};
pub use viewer::{CameraPose, ChangedAlarm, FrameOutput, Viewer};
