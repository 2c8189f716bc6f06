//! Alarm service across a configuration reload.

use std::collections::BTreeMap;

use busbar_alarms::{AlarmHandle, AlarmTable};
use busbar_plugin_host::wall_clock;
use busbar_tags::Moment;

use super::{AlarmService, PendingAction, VerdictAlarms, longest_shelf, verdict_alarms};
use crate::definition::SiteDefinition;
use crate::equipment::EquipmentDirectory;

impl AlarmService {
    /// Continues with the alarms of a reloaded site. Standings, pending actions and, if its
    /// settings are the same, the audit log are carried over.
    pub(crate) fn into_reloaded(
        mut self,
        before: &SiteDefinition,
        after: &SiteDefinition,
        logs: bool,
        directory: &dyn EquipmentDirectory,
    ) -> Option<Self> {
        let same_log = before.audit_log == after.audit_log;
        let mut next = if same_log {
            let log = self.log.take();
            let mut next = Self::new(after, false, wall_clock())?;
            (next.log, next.log_remark) = (log, self.log_remark.take());
            next
        } else {
            // One may be within the other: the old one ends first.
            self.log = None;
            Self::new(after, logs, wall_clock())?
        };
        if logs {
            next.start_notifications(after);
            next.notifications.inherit(std::mem::take(&mut self.notifications));
        }
        let old = self.table.set().clone();
        let longest = longest_shelf(&after.config.alarm_handling);
        next.table = AlarmTable::new(after.alarms.clone(), longest, Moment::now());
        next.verdicts = verdict_alarms(after, &next.table);
        (next.equipment, next.of_templates) = (after.alarm_equipment.to_vec(), BTreeMap::new());
        // An alarm goes with its equipment; any other one waits for the next verdict.
        let is_gone = |alarm: AlarmHandle| {
            let id = old.spec(alarm).and_then(|spec| spec.equipment.as_deref());
            let was_there = self.equipment.get(alarm.0 as usize).is_some_and(Option::is_some);
            was_there && id.is_none_or(|id| directory.find(id).is_none())
        };
        let has_past = |alarm: &AlarmHandle| {
            let occurrences = self.table.status(*alarm).map_or(0, |status| status.occurrences);
            occurrences > 0 || self.table.is_open(*alarm)
        };
        let kept = old.handles().filter(has_past).filter(|alarm| !is_gone(*alarm));
        let ids = kept.filter_map(|alarm| Some(old.spec(alarm)?.id.as_str()));
        next.verdicts.add_known(ids, &mut next.table, &after.tags);
        let is_same = |id: &str| {
            let origin = |site: &SiteDefinition, verdicts: &VerdictAlarms| {
                let template = verdicts.template_of(id).map(|(template, _)| &template.spec().id);
                let own = || site.config.alarms.get(template.map_or(id, String::as_str));
                Some(own()?.origin.clone())
            };
            origin(before, &self.verdicts) == origin(after, &next.verdicts)
        };
        next.table.inherit(self.table, is_same);
        next.place_new(directory);
        next.sources.inherit(self.sources, directory);
        let now_of = |alarm: AlarmHandle| match old.spec(alarm) {
            Some(spec) => next.table.set().find(&spec.id),
            // Those of other systems keep their numbers.
            None => next.sources.get(alarm).map(|_| alarm),
        };
        let pending = self.pending.into_iter();
        next.pending = pending
            .filter_map(|pending| Some(PendingAction { alarm: now_of(pending.alarm)?, ..pending }))
            .collect();
        let host_requests = self.host_requests.into_iter();
        next.host_requests =
            host_requests.filter_map(|(alarm, action)| Some((now_of(alarm)?, action))).collect();
        (next.tail, next.has_host) = (self.tail, self.has_host);
        Some(next)
    }
}
