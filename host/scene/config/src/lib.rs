//! Configuration text to valid values, with error positions.
//!
//! [`parse`] reads the text as JSON, checks its shape against the JSON Schema
//! of the raw types ([`schema`]), then its meaning: every name that refers to
//! something, every id, every band. It reports all faults of a text at once,
//! and gives a [`Config`] only where there is none.
//!
//! Invariant: no I/O. Whether a file or a plugin exists is for others to find
//! out; they place their errors with [`Positions::diagnostic`].
#![doc = include_str!("../DESIGN.md")]

mod alarm_rules;
mod alarm_sources;
mod alarms;
mod band;
mod changes;
mod config;
mod diagnostic;
mod durations;
mod equipment;
mod former_names;
mod item_names;
mod json_index;
mod limits;
mod model_scene;
mod moving_parts;
mod placement_rules;
mod plugins;
mod pointer;
mod positions;
mod raw;
mod report;
mod resolve;
mod rules;
mod scenario;
mod scene;
mod scene_rules;
mod schema;
mod service;
mod simulate;
mod structure;
mod suggestions;
mod syntax;
mod theta;
mod upgrade;
mod view;
mod world_transform;

pub use alarm_sources::AlarmSourceConfig;
pub use alarms::{
    AlarmConfig, AlarmHandlingConfig, AlarmOriginConfig, ConditionConfig, TagConditionConfig,
    VerdictSeverityConfig,
};
pub use band::Band;
pub use changes::{Change, ChangeKind, Changes, Fingerprints, Section};
pub use config::{
    BindingConfig, CacheConfig, ChartConfig, Config, DirectoryConfig, ModelConfig,
    NotificationConfig, OriginConfig, OverlayConfig, RecordsConfig, SourceConfig, TagConfig,
};
pub use diagnostic::{Diagnostic, Severity};
pub use equipment::EquipmentConfig;
pub use former_names::{FORMER_NAMES, FormerNames, RenamedSetting, RenamedSettings, UPGRADE_HINT};
pub use limits::*;
pub use model_scene::ModelSceneConfig;
pub use moving_parts::{EndConfig, MovingPartConfig};
pub use plugins::{FreshnessBasis, Isolation, PluginConfig, SignatureConfig, SupervisionConfig};
pub use pointer::join_pointer;
pub use positions::Positions;
pub use scenario::{LinkFaultConfig, ScenarioConfig, ScenarioEventConfig, parse_scenario};
pub use scene::{NodeConfig, SceneConfig, SceneNodes, TransformConfig};
pub use schema::schema;
pub use service::{LogConfig, LogFormatConfig, MetricsConfig};
pub use simulate::SimulateConfig;
pub use theta::{ThetaConfig, ThetaLevelConfig};
pub use upgrade::{TextKind, UpgradedText, upgrade};
pub use view::{
    CameraConfig, ProjectionConfig, QualityConfig, SectionConfig, ThemeConfig, ViewConfig,
};

use report::Report;

/// Parses and validates a configuration.
///
/// Faults that do not stop Busbar are in [`Config::warnings`].
///
/// # Errors
/// Every fault of the text, in the order of the text, warnings included; at
/// most [`MAX_DIAGNOSTICS`], then one more that counts the rest. A text that
/// is not JSON has one fault: where it stops to be JSON.
pub fn parse(text: &str) -> Result<Config, Vec<Diagnostic>> {
    let mut document = syntax::read(text)?;
    let names = schema::CONFIGURATION.former_names.rename(&mut document.value);
    document.positions.add_former(names.renamed.iter().cloned());
    let mut report = Report::new(&document.positions);
    report.add_renamed(&names);
    report.extend(document.duplicate_keys);
    report.count_more(document.more_duplicate_keys);
    structure::check(&document.value, &schema::CONFIGURATION, &mut report);
    rules::check(&document.value, &mut report);
    if report.has_errors() {
        return Err(report.into_diagnostics());
    }
    let fingerprints = Fingerprints::from_document(&document.value);
    let raw = match resolve::deserialize(document.value) {
        Ok(raw) => raw,
        Err(fault) => {
            report.error(&fault.pointer, fault.cause, fault.remedy);
            return Err(report.into_diagnostics());
        }
    };
    let warnings = report.into_diagnostics();
    Ok(Config { fingerprints, ..resolve::resolve(raw, document.positions, warnings) })
}
