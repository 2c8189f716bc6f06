//! Definition of a site: the checked configuration with its tags, alarms and plugin instances.

use std::collections::BTreeMap;
use std::sync::Arc;

use busbar_alarms::{AlarmSet, AlarmTemplate};
use busbar_audit_log::AuditLogOptions;
use busbar_config::Config;
use busbar_plugin_process::{Plugin, RunningOverlay, RunningTelemetry};
use busbar_tags::{TagHandle, TagSet};

use crate::equipment::EquipmentNumber;

/// Definition of a site, valid until the next reload. Clones share all of it.
#[derive(Clone)]
pub struct SiteDefinition {
    /// Checked configuration with all settings.
    pub config: Arc<Config>,
    /// Tags in the order of their ids.
    pub tags: Arc<TagSet>,
    /// Tags at equipment, in the order of the bindings.
    pub bound_tags: Vec<TagHandle>,
    /// Alarms in the order of their ids.
    pub alarms: Arc<AlarmSet>,
    /// Alarms on all equipment that an overlay judges, in the order of their ids.
    pub alarm_templates: Arc<[AlarmTemplate]>,
    /// Equipment of each alarm, by the alarm's handle.
    pub alarm_equipment: Arc<[Option<EquipmentNumber>]>,
    /// Options of the audit log; none without a configured log.
    pub audit_log: Option<AuditLogOptions>,
    /// Plugin instances by their names in the configuration.
    pub plugins: BTreeMap<String, Plugin>,
}

/// Plugins that were started on the tags and bindings of a site.
#[derive(Default)]
pub struct StartedPlugins {
    /// Sources of samples, in the order of their names.
    pub telemetry: Vec<RunningTelemetry>,
    /// Overlays by the names of their plugin instances.
    pub overlays: BTreeMap<String, RunningOverlay>,
}
