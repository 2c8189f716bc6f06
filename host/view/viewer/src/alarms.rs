//! The alarms of a view: their table, their log, and which of them are shown.

mod alarm_listing;
mod external_alarms;
mod external_sources;
mod host_api;
mod reload;
mod rows;
mod statistics;
mod text;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use busbar_alarms::{Action, AlarmHandle, AlarmRecord, AlarmTable, State};
use busbar_audit_log::{AuditLog, RecoveredLog};
use busbar_config::AlarmHandlingConfig;
use busbar_plugin_host::OverlayTint;
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{Change, Moment, Snapshot, SourceTime};
use busbar_ui::{AlarmAction, AlarmList};

pub(crate) use self::alarm_listing::ExternalAlarmTint;
use self::alarm_listing::{AlarmListing, EquipmentInAlarm};
use self::external_alarms::ExternalSources;
pub(crate) use self::rows::{AlarmListRows, alarm_markers, nodes_in_alarm};
use busbar_scene_loader::LoadedScene;

/// Newest log records that are kept for display.
const MAX_LOG_TAIL: usize = 200;
/// Actions of operators that wait for the disk.
const MAX_PENDING_ACTIONS: usize = 10_000;
/// Display time of the reason why an action was refused.
const REFUSAL_SHOWN_FOR: std::time::Duration = std::time::Duration::from_secs(10);

/// The alarms of a view.
pub(crate) struct AlarmService {
    table: AlarmTable,
    /// Alarms that other systems decide on.
    sources: ExternalSources,
    log: Option<AuditLog>,
    /// Reason why there is no log, or remarks from opening it.
    log_remark: Option<String>,
    operator: String,
    selected: Option<AlarmHandle>,
    list: AlarmList,
    listing: AlarmListing,
    /// The equipment of each alarm, and the instances of each piece of equipment.
    nodes: Arc<[Option<NodeIndex>]>,
    instances: HashMap<NodeIndex, Vec<usize>>,
    /// Operator actions whose records are not on the disk yet.
    pending: VecDeque<PendingAction>,
    tail: VecDeque<AlarmRecord>,
    refusal: Option<(Moment, String)>,
    /// True if a host program receives the operator's requests for its alarms.
    has_host: bool,
    /// Requests that the host program has not received yet.
    host_requests: VecDeque<(AlarmHandle, AlarmAction)>,
    now: Moment,
    wall_clock: SourceTime,
}

/// An action that is done once its record is on the disk.
struct PendingAction {
    alarm: AlarmHandle,
    number: u64,
    /// The state that is shown till then.
    before: State,
}

impl AlarmService {
    /// Creates the alarms of a scene; none if none is configured. Only live views write the log. An
    /// unusable log does not hide the alarms.
    pub(crate) fn new(scene: &LoadedScene, logs: bool, wall_clock: SourceTime) -> Option<Self> {
        let LoadedScene { alarms, config, graph, audit_log, .. } = scene;
        if alarms.set.specs().is_empty() && config.alarm_handling.sources.is_empty() {
            return None;
        }
        let handling = &config.alarm_handling;
        let longest = longest_shelf(handling);
        let now = Moment::now();
        let mut table = AlarmTable::new(alarms.set.clone(), longest, now);
        let rules = audit_log.clone().filter(|_| logs);
        let (mut log, mut tail) = (None, VecDeque::new());
        let log_remark = match rules.map(AuditLog::open) {
            None if logs && !alarms.set.specs().is_empty() => {
                Some("no audit log: name one in \"alarm_handling\"".to_owned())
            }
            None => None,
            Some(Err(error)) => {
                tracing::error!("{error}");
                Some(error.to_string())
            }
            Some(Ok((opened, found))) => {
                let RecoveredLog { open, tail: records, last_number, remarks } = found;
                let last = open.values().map(|r| (r.alarm.as_str(), r.standing, r.time));
                table.restore(last, last_number, wall_clock);
                (log, tail) = (Some(opened), records);
                (!remarks.is_empty()).then(|| format!("the audit log: {}", remarks.join("; ")))
            }
        };
        tail.drain(..tail.len().saturating_sub(MAX_LOG_TAIL));
        Some(Self {
            instances: instances_of(graph, alarms.nodes.iter().flatten()),
            nodes: Arc::clone(&alarms.nodes),
            sources: ExternalSources::start(scene),
            table,
            log,
            log_remark,
            operator: String::new(),
            selected: None,
            list: AlarmList::default(),
            listing: AlarmListing::default(),
            pending: VecDeque::new(),
            tail,
            refusal: None,
            has_host: false,
            host_requests: VecDeque::new(),
            now,
            wall_clock,
        })
    }

    /// Sets the operator who acts from now on.
    pub(crate) fn set_operator(&mut self, name: &str) {
        name.clone_into(&mut self.operator);
    }

    pub(crate) fn table(&self) -> &AlarmTable {
        &self.table
    }

    pub(crate) fn selected(&self) -> Option<AlarmHandle> {
        self.selected
    }

    /// Notes a change of a tag as it comes.
    #[inline]
    pub(crate) fn note(&mut self, change: &Change) {
        self.table.note(change);
    }

    /// Steps the alarm table by the tags, appends records to the log, and updates the listing.
    pub(crate) fn step(&mut self, tags: Snapshot<'_>, now: Moment, wall_clock: SourceTime) {
        (self.now, self.wall_clock) = (now, wall_clock);
        let Self { table, log, tail, .. } = self;
        table.step(tags, now, wall_clock, |record| append_record(log.as_mut(), tail, record));
        self.refresh();
    }

    /// Flushes the log, drops actions that are on the disk, and updates the listing.
    fn refresh(&mut self) {
        if let Some(log) = &mut self.log {
            log.flush();
            let durable = log.durable();
            self.pending.retain(|pending| pending.number > durable);
        }
        self.listing.update(&self.table, &self.nodes, &self.sources);
    }

    /// Does what an operator asks for; a refusal is shown.
    pub(crate) fn act(&mut self, alarm: AlarmHandle, action: AlarmAction) {
        if self.has_host && self.is_mirrored(alarm) {
            return self.request_from_host(alarm, action);
        }
        let result = match self.sources.get(alarm) {
            Some((source, _)) => {
                Err(format!("'{}' decides on this alarm: act on it there", source.name()))
            }
            None => self.perform(alarm, action_of(action)),
        };
        self.refusal = result.err().map(|refusal| (self.now, refusal));
    }

    fn perform(&mut self, alarm: AlarmHandle, action: Action) -> Result<(), String> {
        if self.log.as_ref().is_some_and(|log| !log.keeps_up()) {
            return Err("the audit log does not keep up: wait, or check its disk".to_owned());
        }
        if self.pending.len() >= MAX_PENDING_ACTIONS {
            return Err("too many actions wait for the audit log: check its disk".to_owned());
        }
        let before = self.table.status(alarm).map(|status| status.state);
        let operator = self.operator.as_str();
        let record =
            self.table.perform(alarm, action, operator).map_err(|error| error.to_string())?;
        if let Some(before) = before.filter(|_| self.log.is_some()) {
            self.pending.push_back(PendingAction { alarm, number: record.number, before });
        }
        append_record(self.log.as_mut(), &mut self.tail, record);
        self.refresh();
        Ok(())
    }

    /// Sets an alarm of the host's to a state.
    pub(crate) fn mirror(
        &mut self,
        id: &str,
        state: State,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<(), String> {
        let alarm = self.table.set().find(id).ok_or_else(|| format!("there is no alarm '{id}'"))?;
        let record = self.table.mirror(alarm, state, until, operator);
        if let Some(record) = record.map_err(|error| format!("'{id}': {error}"))? {
            append_record(self.log.as_mut(), &mut self.tail, record);
        }
        self.refresh();
        Ok(())
    }

    pub(crate) fn select(&mut self, alarm: AlarmHandle) {
        let is_known = self.table.set().spec(alarm).is_some() || self.sources.get(alarm).is_some();
        self.selected = is_known.then_some(alarm);
    }

    pub(crate) fn show_list(&mut self, list: AlarmList) {
        self.list = list;
    }

    /// Colour on equipment in alarm.
    pub(crate) fn tints(&self) -> &[OverlayTint] {
        &self.listing.tints
    }

    /// Instances of equipment in unacknowledged alarm, which are drawn in full detail, and in
    /// any, which are drawn by themselves; none where that is as when it was last asked.
    pub(crate) fn changed_detail(&mut self) -> Option<[BTreeSet<usize>; 2]> {
        let EquipmentInAlarm { unacknowledged, all } = self.listing.take_in_alarm()?;
        let instances = |nodes: &BTreeSet<NodeIndex>| {
            nodes.iter().filter_map(|node| self.instances.get(node)).flatten().copied().collect()
        };
        Some([instances(unacknowledged), instances(all)])
    }

    /// The state that an operator sees.
    fn shown_state(&self, alarm: AlarmHandle, state: State) -> (State, bool) {
        let pending = self.pending.iter().find(|pending| pending.alarm == alarm);
        pending.map_or((state, false), |pending| (pending.before, true))
    }

    /// Returns the current refusal, else the fault or the remark of the log.
    fn fault_text(&self) -> Option<String> {
        let fresh = |at: Moment| self.now.since(at) < REFUSAL_SHOWN_FOR;
        let refusal = self.refusal.as_ref().filter(|(at, _)| fresh(*at));
        let log = self.log.as_ref().and_then(AuditLog::fault);
        refusal.map(|(_, words)| words.clone()).or(log).or_else(|| self.log_remark.clone())
    }
}

/// The longest that an alarm is shelved.
fn longest_shelf(handling: &AlarmHandlingConfig) -> std::time::Duration {
    handling.max_shelving
}

/// Appends a record to the log and to the displayed tail.
fn append_record(
    log: Option<&mut AuditLog>,
    tail: &mut VecDeque<AlarmRecord>,
    record: AlarmRecord,
) {
    if tail.len() == MAX_LOG_TAIL {
        tail.pop_front();
    }
    tail.push_back(record.clone());
    if let Some(log) = log {
        log.append(record);
    }
}

fn action_of(action: AlarmAction) -> Action {
    match action {
        AlarmAction::Acknowledge => Action::Acknowledge,
        AlarmAction::Reset => Action::Reset,
        AlarmAction::Shelve(time) => Action::Shelve(time),
        AlarmAction::Unshelve => Action::Unshelve,
        AlarmAction::RemoveFromService => Action::RemoveFromService,
        AlarmAction::ReturnToService => Action::ReturnToService,
    }
}

/// The instances that show each of these nodes: those at it or below it; of a feature, the
/// one that it is a part of.
fn instances_of<'a>(
    graph: &SceneGraph,
    nodes: impl Iterator<Item = &'a NodeIndex>,
) -> HashMap<NodeIndex, Vec<usize>> {
    let mut found: HashMap<NodeIndex, Vec<usize>> = nodes.map(|&node| (node, Vec::new())).collect();
    for (index, instance) in graph.instances().enumerate() {
        let mut above = Some(instance.node);
        while let Some(node) = above {
            if let Some(instances) = found.get_mut(&node) {
                instances.push(index);
            }
            above = graph.node(node).parent();
        }
    }
    let mut of_features: HashMap<NodeIndex, Vec<NodeIndex>> = HashMap::new();
    for (&node, _) in found.iter().filter(|(_, instances)| instances.is_empty()) {
        if let Some(parent) = graph.node(node).parent() {
            of_features.entry(parent).or_default().push(node);
        }
    }
    for (index, instance) in graph.instances().enumerate() {
        for node in of_features.get(&instance.node).into_iter().flatten() {
            found.entry(*node).or_default().push(index);
        }
    }
    found
}
