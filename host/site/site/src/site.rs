//! State of a site, and the step that takes over the reports of its plugins.

use std::time::{Duration, SystemTime};

use busbar_alarms::AlarmFlags;
use busbar_history::History;
use busbar_plugin_host::{LinkReport, PluginError, SceneClock, wall_clock};
use busbar_plugin_process::Plugin;
use busbar_tags::{EventLog, Moment, Snapshot, SourceTime, TagHandle, TagSet, TagTable};
use busbar_types::{AlarmAction, AlarmState, Origin};

use crate::alarms::{ActionOutcome, AlarmService, VerdictValues};
use crate::chart_reader::ChartReader;
use crate::cpu_clock::CpuClock;
use crate::definition::{SiteDefinition, StartedPlugins};
use crate::equipment::EquipmentDirectory;
use crate::host_values::{HostIntake, HostTagValue, empty_table, host_tag};
use crate::origin_tracker::OriginTracker;
use crate::overlay_instance::{self, LIVE_TIMEOUT, OverlayInstance, SETTLING_TIMEOUT};
use crate::pause_monitor::PauseMonitor;
use crate::records::RecordStore;
use crate::sample_intake::{ChangeListeners, SampleUpdates};
use crate::telemetry_instance::TelemetryInstance;
use crate::verdicts::OverlayVerdicts;

/// The longest that a site which settles waits for the first records of its chart.
const FIRST_CHART_TIMEOUT: Duration = Duration::from_secs(20);

/// Site with its plugins running.
pub struct Site {
    // Telemetry first: it stops before what it feeds is gone.
    pub(crate) telemetry: Vec<TelemetryInstance>,
    pub(crate) overlays: Vec<OverlayInstance>,
    pub(crate) table: TagTable,
    pauses: PauseMonitor,
    /// Sequence of switching events.
    pub(crate) events: EventLog,
    /// Histories of tag values.
    pub(crate) history: History,
    /// Origins of the values in history.
    origins: OriginTracker,
    /// Alarm service; none without configured alarms.
    pub(crate) alarms: Option<AlarmService>,
    /// Judges the values that a host program sets.
    pub(crate) host_intake: HostIntake,
    /// Reader of the chart's records; none without a configured chart.
    pub(crate) chart: Option<ChartReader>,
    /// Records of business and asset management systems.
    pub(crate) records: RecordStore,
    /// True if steps wait for plugins, and nothing is written to the audit log.
    pub(crate) settles: bool,
    /// True if a host program embeds the site.
    pub(crate) has_host: bool,
    pub(crate) definition: SiteDefinition,
}

/// CPU time of the parts of a step, milliseconds of this thread. Waiting time, such as for an
/// overlay's process, is not included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SiteStepMillis {
    /// Taking over samples; histories.
    pub tags: f64,
    /// Stepping and listing alarms.
    pub alarms: f64,
    /// Drawing with all overlays.
    pub overlays: f64,
}

/// Plugin instance with its link and the last fault of its overlay.
pub struct PluginHealth<'a> {
    /// Plugin instance of the configuration.
    pub plugin: &'a Plugin,
    /// Link to the data source, or of messages to people; none for other plugins.
    pub link: Option<LinkReport>,
    /// Reason why its overlay is late, or why it cannot tell of alarms; none while all is well.
    pub fault: Option<&'a str>,
}

impl Site {
    /// Starts a site with plugins that were started for it. One that `settles` waits for its
    /// plugins and does not write the audit log, so that a picture does not depend on timing.
    ///
    /// # Errors
    /// A chart or records that cannot be read.
    pub fn start(
        definition: SiteDefinition,
        plugins: StartedPlugins,
        settles: bool,
    ) -> Result<Self, PluginError> {
        // Before any wait: values age from when they came.
        let table = empty_table(&definition);
        let StartedPlugins { telemetry, mut overlays } = plugins;
        let shown = definition.config.overlays.iter();
        let overlays: Vec<_> =
            shown.filter_map(|overlay| overlays.remove(&overlay.plugin)).collect();
        let chart = start_chart(&definition, settles)?;
        let records = RecordStore::start(&definition, settles)?;
        let alarms = start_alarms(&definition, !settles);
        Ok(Self {
            telemetry: telemetry.into_iter().map(TelemetryInstance::new).collect(),
            overlays: overlays.into_iter().map(OverlayInstance::new).collect(),
            table,
            pauses: PauseMonitor::start(),
            events: EventLog::default(),
            history: empty_history(&definition),
            origins: OriginTracker::default(),
            alarms,
            host_intake: HostIntake::new(&definition),
            chart,
            records,
            settles,
            has_host: false,
            definition,
        })
    }

    /// Takes over all that plugins have reported since the last step, advances time, and draws with
    /// all overlays. Returns the CPU time.
    pub fn step(&mut self, directory: &dyn EquipmentDirectory) -> SiteStepMillis {
        let began = CpuClock::start();
        let now = self.take_samples();
        let tags = began.millis();
        // Before the alarms, which follow the verdicts of this very step.
        self.draw_overlays();
        let overlays = began.millis() - tags;
        self.step_alarms(directory, now);
        let alarms = began.millis() - tags - overlays;
        self.records.step(directory);
        let began = CpuClock::start();
        let Self { origins, definition, table, history, .. } = self;
        origins.follow(definition, table.snapshot(), history, Moment::now());
        SiteStepMillis { tags, alarms, overlays: overlays + began.millis() }
    }

    /// Takes the samples of all plugins; values beyond their freshness limit become stale.
    fn take_samples(&mut self) -> Moment {
        let Self { telemetry, table, events, history, alarms, pauses, .. } = self;
        let mut listeners = ChangeListeners { events, history, alarms: alarms.as_mut() };
        if let Some(pause) = pauses.take() {
            // Values from before a pause of the process or the machine are stale.
            tracing::warn!("{pause}");
            table.mark_stale_before(&pause, |change| listeners.note(change));
        }
        let mut updates = SampleUpdates { table, listeners };
        for telemetry in telemetry {
            telemetry.log_clock();
            telemetry.drain(&mut updates);
        }
        let SampleUpdates { table, mut listeners } = updates;
        let now = Moment::now();
        table.advance(now, |change| listeners.note(change));
        listeners.history.follow(table.snapshot(), now);
        now
    }

    fn step_alarms(&mut self, directory: &dyn EquipmentDirectory, now: Moment) {
        if let Some(alarms) = &mut self.alarms {
            alarms.take_sources(directory);
            let values =
                VerdictValues { tags: &self.definition.tags, snapshot: self.table.snapshot() };
            alarms.take_verdicts(&self.overlays, values, directory);
            alarms.step(self.table.snapshot(), now, wall_clock());
            alarms.hand_over(&self.definition.tags, directory);
        }
    }

    fn draw_overlays(&mut self) {
        let clock = SceneClock { wall: SystemTime::now(), recorded: self.scene_time() };
        let timeout = if self.settles { SETTLING_TIMEOUT } else { LIVE_TIMEOUT };
        overlay_instance::draw_all(&mut self.overlays, self.table.snapshot(), clock, timeout);
    }

    /// Sets whether steps wait for plugins, so that a picture does not depend on timing.
    pub fn set_settles(&mut self, settles: bool) {
        self.settles = settles;
    }

    /// Marks the site as embedded in a host program, which decides on mirrored alarms.
    pub fn attach_host_program(&mut self) {
        self.has_host = true;
        if let Some(alarms) = &mut self.alarms {
            alarms.set_host();
        }
    }

    /// Sets a tag that is the host program's.
    ///
    /// # Errors
    /// A text: the tag does not exist or is not set by the host.
    pub fn set_tag(&mut self, id: &str, value: HostTagValue) -> Result<(), String> {
        let tag = host_tag(&self.definition, id)?;
        let now = (Moment::now(), wall_clock());
        let Self { table, events, history, alarms, host_intake, .. } = self;
        let listeners = ChangeListeners { events, history, alarms: alarms.as_mut() };
        host_intake.take(tag, value, now, &mut SampleUpdates { table, listeners });
        Ok(())
    }

    /// Starts a plugin again that waits for that or is in quarantine.
    pub fn start_plugin(&self, name: &str) {
        if let Some(plugin) = self.definition.plugins.get(name) {
            plugin.restart();
        }
    }

    /// Performs an operator's action on an alarm, or requests it from the host program that decides
    /// on the alarm.
    ///
    /// # Errors
    /// A text with the reason of the refusal.
    pub fn act_on_alarm(
        &mut self,
        alarm: busbar_alarms::AlarmHandle,
        action: AlarmAction,
        operator: &str,
    ) -> Result<ActionOutcome, String> {
        let alarms = self.alarms.as_mut().ok_or_else(|| "there are no alarms".to_owned())?;
        alarms.act(alarm, action, operator)
    }

    /// Performs an action of the host program's operator on an alarm, by its id.
    ///
    /// # Errors
    /// A text with the reason of the refusal.
    pub fn act_on_alarm_by_id(
        &mut self,
        id: &str,
        action: AlarmAction,
        operator: &str,
    ) -> Result<(), String> {
        let alarms = self.alarms.as_mut().ok_or_else(|| format!("there is no alarm '{id}'"))?;
        alarms.act_by_id(id, action, operator)
    }

    /// Sets a mirrored alarm to the state that the host's alarm system has it in. `until` is the
    /// end of its time on the shelf.
    ///
    /// # Errors
    /// A text: an alarm that does not exist or is not mirrored.
    pub fn mirror_alarm(
        &mut self,
        id: &str,
        state: AlarmState,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<(), String> {
        let alarms = self.alarms.as_mut().ok_or_else(|| format!("there is no alarm '{id}'"))?;
        alarms.mirror(id, state, until, operator)
    }

    /// Takes the operator's requests for the host program since the last call, by alarm id.
    pub fn take_alarm_requests(&mut self) -> Vec<(String, AlarmAction)> {
        self.alarms.as_mut().map(AlarmService::take_host_requests).unwrap_or_default()
    }

    /// Restores the alarm states of a previous process.
    pub fn restore_alarms(&mut self, standings: &[(String, AlarmFlags, SourceTime)]) {
        if let Some(alarms) = &mut self.alarms {
            alarms.restore(standings, &self.definition.tags);
        }
    }

    /// Returns the tags as of the last step, with the host program's changes since.
    pub fn snapshot(&self) -> Snapshot<'_> {
        self.table.snapshot()
    }

    /// Returns the specifications of all tags.
    pub fn tags(&self) -> &TagSet {
        &self.definition.tags
    }

    /// Returns the switching events since the start, in order of arrival.
    pub fn events(&self) -> &EventLog {
        &self.events
    }

    /// Returns the histories of tag values.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Returns the origins of the values in history.
    pub fn origins(&self) -> &OriginTracker {
        &self.origins
    }

    /// Returns the alarm service; none without configured alarms.
    pub fn alarms(&self) -> Option<&AlarmService> {
        self.alarms.as_ref()
    }

    /// Returns the reader of the chart's records; none without a configured chart.
    pub fn chart(&self) -> Option<&ChartReader> {
        self.chart.as_ref()
    }

    /// Returns the records of business and asset management systems.
    pub fn records(&self) -> &RecordStore {
        &self.records
    }

    /// Returns the overlays in the order of the configuration.
    pub fn overlays(&self) -> &[OverlayInstance] {
        &self.overlays
    }

    /// Returns the verdicts of all overlays, hidden ones too.
    pub fn overlay_verdicts(&self) -> impl Iterator<Item = OverlayVerdicts<'_>> {
        let (tags, snapshot) = (self.tags(), self.snapshot());
        self.overlays.iter().map(move |overlay| OverlayVerdicts {
            name: overlay.name(),
            equipment: &overlay.description().equipment,
            verdicts: overlay.verdicts(),
            tags,
            snapshot,
        })
    }

    /// Returns all plugin instances with their links and faults, in the order of their names.
    pub fn plugins(&self) -> impl Iterator<Item = PluginHealth<'_>> {
        self.definition.plugins.iter().map(|(name, plugin)| {
            let link = self.telemetry.iter().find(|telemetry| telemetry.name() == name);
            let overlay = self.overlays.iter().find(|overlay| overlay.name() == name);
            let alarms = self.alarms.as_ref();
            let notifier = alarms.and_then(|alarms| alarms.notifier_health(name));
            let notifier_fault = notifier.and_then(|notifier| notifier.fault.as_deref());
            PluginHealth {
                plugin,
                link: link
                    .map(TelemetryInstance::link)
                    .or_else(|| notifier.map(|notifier| notifier.link.clone())),
                fault: overlay.and_then(OverlayInstance::fault).or(notifier_fault),
            }
        })
    }

    /// Returns the number of pauses of the process or the machine since the start.
    pub fn pauses(&self) -> u64 {
        self.pauses.count()
    }

    /// Returns the time of a recording that telemetry replays; none for live values.
    pub fn scene_time(&self) -> Option<SourceTime> {
        self.telemetry.iter().filter_map(TelemetryInstance::scene_time).max()
    }

    /// Returns the origins of all values. Origins that plugins declare count even without good
    /// values.
    pub fn origin(&self) -> Origin {
        let links = self.telemetry.iter().map(|telemetry| telemetry.link().origin);
        let is_simulated = self.definition.config.plugins.values().any(|plugin| plugin.simulated);
        let declared = if is_simulated { Origin::SIMULATED } else { Origin::LIVE };
        links.fold(self.origins.shown() | declared, Origin::union)
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.definition.plugins.values().for_each(Plugin::quit);
    }
}

/// Starts the alarms of a site; none without configured alarms. Only if `acts` is set, the audit log
/// is written and people are told.
pub(crate) fn start_alarms(site: &SiteDefinition, acts: bool) -> Option<AlarmService> {
    let mut alarms = AlarmService::new(site, acts, wall_clock())?;
    if acts {
        alarms.start_notifications(site);
    }
    Some(alarms)
}

/// Starts reading the chart's records; none without a configured chart.
pub(crate) fn start_chart(
    site: &SiteDefinition,
    settles: bool,
) -> Result<Option<ChartReader>, PluginError> {
    let Some(config) = &site.config.chart else { return Ok(None) };
    let Some(plugin) = site.plugins.get(&config.plugin) else { return Ok(None) };
    let reader = ChartReader::start(plugin)?;
    if settles {
        reader.wait_for_first(FIRST_CHART_TIMEOUT);
    }
    Ok(Some(reader))
}

/// Creates empty histories of numbers: of tags at equipment first, of as many as are kept.
pub(crate) fn empty_history(site: &SiteDefinition) -> History {
    let is_number =
        |tag: &TagHandle| site.tags.spec(*tag).is_some_and(|spec| spec.kind.is_quantity());
    let bound = site.bound_tags.iter().copied();
    let all = (0..site.tags.specs().len() as u32).map(TagHandle);
    History::new(bound.chain(all).filter(is_number))
}
