//! The viewer: a configuration becomes a scene, a scene becomes frames.
//!
//! [`LoadedScene::load`] reads a configuration and everything it names, and
//! finds every fault in it. [`Viewer`] steps it frame by frame, into a window
//! or an offscreen picture. [`optimize`] runs one model through one optimiser;
//! [`import_scene`] makes a configuration from a model and a point list.
//!
//! Invariant: no Vulkan type and no protocol word crosses this façade.

mod alarms;
mod arrows;
mod camera;
mod chart;
mod clock;
mod color;
mod commands;
mod contour;
mod cpu_clock;
mod cursors;
mod drawn;
pub mod embedded;
mod equipment;
mod equipment_tree;
mod error;
mod faceplate;
mod file_version;
mod flags;
mod graphics;
mod ground_marks;
mod highlight;
mod labels;
mod load;
pub mod looks;
mod measuring;
mod moving;
mod numbers;
mod occlusion;
pub mod optimize;
mod origins;
mod outlines;
mod pace;
mod pause_watch;
mod picker;
mod point_import;
mod ray;
mod records;
mod recovery;
pub mod reload;
mod rows;
mod running;
mod search_text;
mod served;
mod shown_model;
mod stacks;
mod stats;
mod surroundings;
mod tag_list;
mod verdicts;
mod viewer;

pub use busbar_alarm_log::{LogError as AlarmLogError, Verification, verify as verify_alarm_log};
/// The states of an alarm, by the letters of IEC 62682.
pub use busbar_alarms::State as AlarmState;
pub use busbar_chart as charts;
pub use busbar_config::{
    Diagnostic, LogConfig, LogFormatConfig, MAX_THETA_SCALE, MetricsConfig, Severity, schema,
};
pub use busbar_plugin_host::{
    Catalog, CommandExit, CommandReport, DiagnosticLevel, FaultKind, LoadRules, PluginInfo,
    Refused, Simulation, SimulationStatus, sign_library,
};
pub use busbar_plugin_process::{
    CommandError, Isolation, Plugin, PluginCatalog, serve as serve_plugin,
};
pub use busbar_point_import::{ListFault, PluginInstance};
pub use busbar_renderer::{
    HugePageAllocator, Picture, Quality, RenderError, RendererOptions, SectionPlane, WindowHandles,
    configure_allocator,
};
pub use busbar_ui::{AlarmAction, ChartCommand};
pub use commands::{OfferedCommand, offered_commands, plugin_with_command};
pub use error::{LoadError, ViewError};
pub use graphics::graphics_device;
pub use load::{
    CheckedLink, DevicePoints, LoadProgress, LoadedScene, MAX_CONFIG_FILE_BYTES, POINTS_COMMAND,
    PointSource, Reload, ReloadError, SimulatedDevice, SimulatedDevices, check_links,
    plugin_catalog,
};
pub use point_import::{ImportedScene, SceneImportError, SceneRequest, import_scene};
pub use stats::{
    AlarmStats, CameraStats, ChartAxisStats, ChartEvidence, ChartStats, FaceplateStats, Health,
    LinkStats, LoadMillis, PluginStats, RecordStats, ReloadStats, Stats, TagStats,
};
pub use viewer::{FrameOutput, MAX_SELECTED, PartMillis, Viewer};
