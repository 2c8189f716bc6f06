//! Hot reload of a site: a changed definition in place of the one that runs, in two phases.
//!
//! [`Site::prepare_reload`] starts what may fail and changes nothing; [`Site::apply_reload`] swaps.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use busbar_config::{PluginConfig, TagConfig};
use busbar_plugin_host::PluginError;
use busbar_plugin_process::{Plugin, RunningOverlay, RunningTelemetry};
use busbar_tags::HandleRemap;

use crate::chart_reader::ChartReader;
use crate::definition::{SiteDefinition, StartedPlugins};
use crate::equipment::EquipmentDirectory;
use crate::host_values::{HostIntake, empty_table};
use crate::index_remap::IndexRemap;
use crate::overlay_instance::OverlayInstance;
use crate::records::RecordStore;
use crate::site::{Site, empty_history, start_alarms, start_chart};
use crate::telemetry_instance::TelemetryInstance;

/// Changed definition of a site, ready to be applied: its new plugins run.
pub struct SiteReload {
    definition: SiteDefinition,
    plugins: StartedPlugins,
    /// Plugin instances that are kept unchanged.
    kept: BTreeSet<String>,
    /// Reader of the chart, if it is another one than before.
    chart: Option<Option<ChartReader>>,
    /// Records, if they come from elsewhere than before.
    records: Option<RecordStore>,
}

impl SiteReload {
    /// Returns the reader of the chart, if it is another one than before.
    pub fn replaced_chart(&self) -> Option<Option<&ChartReader>> {
        self.chart.as_ref().map(Option::as_ref)
    }
}

/// Definition that a reload replaced. Dropping it may wait for the end of processes.
pub struct ReplacedSite {
    _definition: SiteDefinition,
}

impl Site {
    /// Prepares a reload with plugins that were started for it, except for the `kept` ones.
    ///
    /// # Errors
    /// A chart or records that cannot be read.
    pub fn prepare_reload(
        &self,
        definition: SiteDefinition,
        plugins: StartedPlugins,
        kept: BTreeSet<String>,
    ) -> Result<SiteReload, PluginError> {
        let chart = self.next_chart(&definition, &kept)?;
        let records = self.next_records(&definition, &kept)?;
        Ok(SiteReload { definition, plugins, kept, chart, records })
    }

    /// Starts the reader of the chart, where it is another one than before.
    fn next_chart(
        &self,
        next: &SiteDefinition,
        kept: &BTreeSet<String>,
    ) -> Result<Option<Option<ChartReader>>, PluginError> {
        let (was, is) = (&self.definition.config.chart, &next.config.chart);
        let goes_on = is.as_ref().is_none_or(|chart| kept.contains(&chart.plugin));
        if was == is && goes_on {
            return Ok(None);
        }
        start_chart(next, self.settles).map(Some)
    }

    /// Starts the records, where they come from elsewhere than before.
    fn next_records(
        &self,
        next: &SiteDefinition,
        kept: &BTreeSet<String>,
    ) -> Result<Option<RecordStore>, PluginError> {
        let names = |site: &SiteDefinition| -> Vec<String> {
            site.config.records.iter().map(|records| records.plugin.clone()).collect()
        };
        let is_kept = |name: &String| kept.contains(name);
        if names(&self.definition) == names(next) && names(next).iter().all(is_kept) {
            return Ok(None);
        }
        RecordStore::start(next, self.settles).map(Some)
    }

    /// Applies a prepared reload. Unchanged parts are kept: plugins, values with their ages,
    /// histories, alarm states. Returns the replaced definition, whose plugins were told to quit.
    pub fn apply_reload(
        &mut self,
        reload: SiteReload,
        remap: &IndexRemap,
        directory: &dyn EquipmentDirectory,
    ) -> ReplacedSite {
        let SiteReload { definition, plugins, kept, chart, records } = reload;
        let mut before = std::mem::replace(&mut self.definition, definition);
        self.chart = chart.unwrap_or_else(|| self.chart.take());
        self.records = records.unwrap_or_else(|| std::mem::take(&mut self.records));
        self.carry_tags(&before, remap.tags());
        self.carry_alarms(&before, directory);
        let StartedPlugins { telemetry, overlays } = plugins;
        self.carry_telemetry(remap, &kept, telemetry);
        self.carry_overlays(remap, overlays);
        before.plugins.retain(|name, _| !kept.contains(name));
        before.plugins.values().for_each(Plugin::quit);
        ReplacedSite { _definition: before }
    }

    /// Carries over the values of tags with an unchanged source.
    fn carry_tags(&mut self, before: &SiteDefinition, remap: &HandleRemap) {
        let after = &self.definition;
        let (was, is) = (&before.config.tags, &after.config.tags);
        let (was_plugins, are_plugins) = (&before.config.plugins, &after.config.plugins);
        let same_origin = |id: &String| {
            let origin = |tag: &TagConfig| (tag.origin.clone(), tag.scale);
            let device = |plugins, tag| source_device(plugins, tag);
            was.get(id).map(origin) == is.get(id).map(origin)
                && was.get(id).map(|tag| device(was_plugins, tag))
                    == is.get(id).map(|tag| device(are_plugins, tag))
        };
        let specs = before.tags.specs();
        let all_same = remap.is_identity() && specs.iter().all(|spec| same_origin(&spec.id));
        if all_same && Arc::ptr_eq(&before.tags, &after.tags) {
            return;
        }
        let own: Vec<Option<u32>> = specs
            .iter()
            .zip(0..)
            .map(|(spec, old)| remap.index(old).filter(|_| same_origin(&spec.id)))
            .collect();
        let own = HandleRemap::new(own.into_iter());
        let mut table = empty_table(after);
        table.inherit(&self.table, &own);
        self.table = table;
        self.host_intake = HostIntake::new(after);
        self.events.renumber(&own);
        let history = std::mem::replace(&mut self.history, empty_history(after));
        self.history.inherit(history, &own);
    }

    fn carry_alarms(&mut self, before: &SiteDefinition, directory: &dyn EquipmentDirectory) {
        let (after, logs) = (&self.definition, !self.settles);
        self.alarms = match self.alarms.take() {
            Some(alarms) => alarms.into_reloaded(before, after, logs, directory),
            None => start_alarms(after, logs),
        };
        if let Some(alarms) = self.alarms.as_mut().filter(|_| self.has_host) {
            alarms.set_host();
        }
    }

    fn carry_telemetry(
        &mut self,
        remap: &IndexRemap,
        kept: &BTreeSet<String>,
        started: Vec<RunningTelemetry>,
    ) {
        self.telemetry.retain(|telemetry| kept.contains(telemetry.name()));
        self.telemetry.iter_mut().for_each(|telemetry| telemetry.remap_tags(remap.tags()));
        self.telemetry.extend(started.into_iter().map(TelemetryInstance::new));
    }

    fn carry_overlays(
        &mut self,
        remap: &IndexRemap,
        mut started: BTreeMap<String, RunningOverlay>,
    ) {
        let mut before = std::mem::take(&mut self.overlays);
        for overlay in &self.definition.config.overlays {
            let name = &overlay.plugin;
            let was = before.iter().position(|before| before.name() == name);
            let was = was.map(|index| before.swap_remove(index));
            let next = match (started.remove(name), was) {
                (Some(running), was) => {
                    let mut next = OverlayInstance::new(running);
                    was.into_iter().for_each(|was| next.inherit(was));
                    next
                }
                (None, Some(mut was)) => {
                    was.remap_numbers(remap);
                    was
                }
                (None, None) => continue,
            };
            self.overlays.push(next);
        }
    }
}

/// Returns the settings that decide on the device that a tag's values come from; none where no
/// plugin brings them.
fn source_device<'a>(
    plugins: &'a BTreeMap<String, PluginConfig>,
    tag: &TagConfig,
) -> Option<(&'a str, &'a serde_json::Value)> {
    let plugin = plugins.get(&tag.source()?.plugin)?;
    Some((&plugin.plugin, &plugin.settings))
}
