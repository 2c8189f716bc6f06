//! The site: the half of Busbar without a camera. It runs the plugins of telemetry, overlays,
//! alarms, records and charts, and holds what they report; views read it.
//!
//! A site refers to equipment by number, and a view maps numbers to its scene. [`Site::step`] takes
//! over all reports; the getters of [`Site`] lend the state without a copy. Operators act through
//! [`Site::act_on_alarm`].
//!
//! Invariant: no scene, camera, graphics device or panel is named here.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod chart_reader;
mod cpu_clock;
mod definition;
mod equipment;
mod host_values;
mod index_remap;
mod origin_tracker;
mod overlay_instance;
mod pause_monitor;
mod plugin_poller;
mod records;
mod reload;
mod sample_intake;
mod site;
mod telemetry_instance;
mod verdicts;

pub use alarms::{
    ActionOutcome, AlarmListing, AlarmService, ChangedAlarm, EquipmentAlarms, EquipmentInAlarm,
    ExternalAlarm, ExternalSource, ExternalSources, JudgedAlarmTint,
};
pub use chart_reader::{ChartData, ChartReader, ExplanationRequest};
pub use cpu_clock::CpuClock;
pub use definition::{SiteDefinition, StartedPlugins};
pub use equipment::{EquipmentDirectory, EquipmentNumber};
pub use host_values::HostTagValue;
pub use index_remap::IndexRemap;
pub use origin_tracker::{OriginInterval, OriginTracker};
pub use overlay_instance::{LATE_DISPLAY, OverlayInstance};
pub use records::RecordStore;
pub use reload::{ReplacedSite, SiteReload};
pub use site::{PluginHealth, Site, SiteStepMillis};
pub use verdicts::{OverlayVerdicts, VerdictBoard, VerdictText};
