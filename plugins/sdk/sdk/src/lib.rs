//! SDK for authors of plugins: the C ABI as safe Rust.
//!
//! A plugin is a type with settings that implements [`Plugin`] and one or more
//! capabilities: [`MeshOptimizer`], [`Telemetry`], [`Overlay`], [`Simulator`], [`Command`],
//! [`Chart`], [`Records`], [`Alarms`], [`Notify`].
//! [`export_plugin!`] makes the library's entry from it. Build it as a
//! `cdylib` and put the library into a plugin directory of the configuration.
//! `busbar plugin new` makes a project to start from; the [`book`] tells the rest.
//!
//! ```no_run
//! use busbar_plugin_sdk::{Error, Host, Plugin, Sample, SampleSink, TagSpec, Telemetry, Value};
//!
//! #[derive(serde::Deserialize, schemars::JsonSchema)]
//! struct Settings {
//!     value: f64,
//! }
//!
//! struct Constant(f64);
//!
//! impl Plugin for Constant {
//!     const ID: &'static str = "com.example.constant";
//!     const NAME: &'static str = "Constant";
//!     const VERSION: &'static str = "1.0.0";
//!     const DESCRIPTION: &'static str = "Publishes one value once.";
//!     type Settings = Settings;
//!     fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
//!         Ok(Self(settings.value))
//!     }
//! }
//!
//! impl Telemetry for Constant {
//!     fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
//!         let samples: Vec<_> =
//!             tags.iter().map(|tag| Sample::good(tag.tag, Value::F64(self.0))).collect();
//!         sink.publish(&samples);
//!         Ok(())
//!     }
//!     fn stop(&mut self) {}
//! }
//!
//! busbar_plugin_sdk::export_plugin!(Constant: telemetry);
//! # fn main() {}
//! ```
//!
//! Panics are caught at the boundary and reported as the plugin's fault; a
//! plugin instance is locked by the SDK, so that capability methods may take
//! `&mut self` whatever threads the host uses.

pub use busbar_plugin_abi as abi;

mod alarms;
pub mod book;
mod boundary;
mod chart;
mod clock;
mod command;
pub mod designations;
mod error;
pub mod export;
mod host;
mod huge_pages;
mod judgment;
mod mesh_optimizer;
mod notify;
mod overlay;
mod overlay_description;
mod records;
mod sample_flags;
mod secret;
pub mod simulation;
mod simulator;
mod state_file;
mod states;
mod telemetry;
pub mod testing;
pub mod units;
mod value;
mod worker;

/// Vocabulary that host and plugins share.
pub use busbar_types::{
    AlarmState, DefectSeverity, DoublePoint, MAX_TEXT_BYTES, Origin, Pattern, Priority, Quality,
    QualityLevel, Reason, Severity, Text, Value, ValueKind, Verdict, VerdictSeverity,
};

pub use alarms::{AlarmReport, Alarms, MAX_SOURCE_ALARM_TEXT, MAX_SOURCE_ALARMS, SourceAlarm};
pub use chart::{
    Chart, ChartAxis, ChartBand, ChartDescription, ChartRecord, ChartRecords, ChartState, Diagram,
    DiagramZone, Evidence, ExplainedRow, ExplainedTable, Explanation,
};
pub use command::{Command, CommandExit, CommandInfo, MAX_CHUNK, Streams};
pub use error::Error;
pub use host::{Host, LogLevel};
pub use huge_pages::on_huge_pages;
pub use judgment::{Basis, Judgment};
pub use mesh_optimizer::{Collapse, CollapseList, Mesh, MeshOptimizer, Progress, Wedges};
pub use notify::{
    AlarmChange, AlarmNotification, AlarmOrigin, MAX_NOTIFY_CHANGES, MAX_NOTIFY_MESSAGE,
    MAX_NOTIFY_STANDING, NotificationBatch, NotificationReport, Notify, StandingAlarms,
};
pub use overlay::{Binding, Canvas, MAX_LINE_TEXT, Overlay, OverlayFrame, TagValue};
pub use overlay_description::{Contour, Description, LegendEntry, MAX_FINDINGS};
pub use records::{
    MAX_RECORD_BYTES, MAX_RECORD_COLUMNS, MAX_RECORD_LISTS, MAX_RECORD_ROWS, MAX_RECORD_TEXT,
    Record, RecordColumn, RecordColumnType, RecordKind, RecordList, RecordRowFault, RecordSet,
    Records,
};
pub use sample_flags::SampleFlags;
pub use secret::{MAX_SECRET_BYTES, Secret, SecretText};
pub use simulator::{SimulatedTag, Simulation, SimulationStatus, Simulator};
pub use state_file::{StateFile, StateFileLayout, StoredState, state_file_fault};
pub use states::parse_states;
pub use telemetry::{LinkState, Sample, SampleSink, TagSpec, Telemetry};
pub use value::{text_value, text_value_of_bytes};
pub use worker::{MAX_STOP, StopToken, Worker};

/// Plugin type: its identity, its settings, and the creation of instances.
pub trait Plugin: Sized + Send + Sync + 'static {
    /// Unique id in reverse notation, such as `com.example.mine`.
    const ID: &'static str;
    /// Display name of the plugin.
    const NAME: &'static str;
    /// Version of the plugin.
    const VERSION: &'static str;
    /// Description of the plugin in one sentence.
    const DESCRIPTION: &'static str;
    /// Settings as the configuration gives them. Their JSON Schema goes to the
    /// host, which checks them before `create` is called.
    type Settings: serde::de::DeserializeOwned + schemars::JsonSchema;

    /// Creates an instance of the plugin.
    ///
    /// # Errors
    /// What the user must change, in words.
    fn create(settings: Self::Settings, host: Host) -> Result<Self, Error>;
}
