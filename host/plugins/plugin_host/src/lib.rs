//! Plugins: discovery, ABI check, lifecycle, and one file a capability.
//!
//! Everything that comes back from a plugin is checked here, so that the rest
//! of the host only ever sees valid values.
//!
//! Invariant: no concrete plugin is named here, or anywhere in the host.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod catalog;
mod chart;
mod command;
mod digest;
mod error;
mod instance;
mod json_output;
mod library;
mod log;
mod mesh_optimizer;
mod notify;
mod overlay;
mod overlay_quantity;
mod overlay_verdict;
mod program_value;
mod published_sample;
mod records;
mod sample_intake;
mod scene_clock;
mod signature;
mod simulator;
mod source_clock;
mod telemetry;
mod text;
mod trust;

/// Pictures of overlays, as data.
pub use busbar_overlay_picture::{
    Contour, LegendEntry, MAX_PART_BYTES, OverlayBinding, OverlayDescription, OverlayLine,
    OverlayPicture, OverlayQuantity, OverlayState, OverlayTint, OverlayVerdict, PictureRules,
    Quantity, Verdicts,
};

pub use alarms::Alarms;
pub use catalog::Catalog;
pub use chart::{Chart, ChartPage, MAX_PAGE_RECORDS};
pub use command::{
    CommandExit, CommandInfo, CommandReport, CommandStreams, Commands, Diagnostic, DiagnosticLevel,
    MAX_DIAGNOSTICS, check_commands,
};
pub use digest::Digest;
pub use error::{PluginError, SettingsError};
pub use instance::Instance;
pub use library::PluginInfo;
pub use mesh_optimizer::{
    MeshOptimizer, MeshView, OptimizedMesh, Stage, WedgesView, WrittenCollapses, check_stages,
};
pub use notify::Notifier;
pub use overlay::Overlay;
pub use program_value::ProgramValue;
pub use published_sample::{PublishedBatch, PublishedSample};
pub use records::{MAX_PAGE_ROWS, RecordPage, Records};
pub use sample_intake::{SampleIntake, SampleSink, SourcePolicy};
pub use scene_clock::SceneClock;
pub use signature::{PublicKey, sign_library};
pub use simulator::{
    DeviceScenario, SimulatedBehavior, SimulatedEvent, SimulatedLinkFault, SimulatedTag,
    Simulation, SimulationStatus, Simulator,
};
pub use source_clock::{ClockReport, FreshnessBasis, MAX_CLOCK_AHEAD};
pub use telemetry::{
    LinkReport, LinkState, MAX_LINK_MESSAGE_BYTES, SampleReceiver, Telemetry, TelemetryStream,
    TelemetryTag, wall_clock,
};
pub use text::shown;
pub use trust::{
    LibraryFile, LoadRules, MAX_LIBRARIES, MAX_LIBRARY_BYTES, RejectedLibrary, libraries,
};
