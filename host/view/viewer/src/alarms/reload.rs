//! Alarm service across a configuration reload.

use super::*;

impl AlarmService {
    /// Continues with the alarms of a reloaded scene. Standings, pending actions and, if its
    /// settings are the same, the audit log are carried over.
    pub(crate) fn into_reloaded(
        mut self,
        before: &LoadedScene,
        scene: &LoadedScene,
        logs: bool,
        wall_clock: SourceTime,
    ) -> Option<Self> {
        let is = &scene.config.alarm_handling;
        let same_log = before.audit_log == scene.audit_log;
        let mut next = if same_log {
            let log = self.log.take();
            let mut next = Self::new(scene, false, wall_clock)?;
            (next.log, next.log_remark) = (log, self.log_remark.take());
            next
        } else {
            // One may be within the other: the old one ends first.
            self.log = None;
            Self::new(scene, logs, wall_clock)?
        };
        let is_same = |id: &str| {
            let origin = |scene: &LoadedScene| Some(scene.config.alarms.get(id)?.origin.clone());
            origin(before) == origin(scene)
        };
        let old = self.table.set().clone();
        next.table = AlarmTable::new(scene.alarms.set.clone(), longest_shelf(is), Moment::now());
        next.table.inherit(self.table, is_same);
        next.sources.inherit(self.sources, scene);
        next.note_instances(scene);
        let now_of = |alarm: AlarmHandle| match old.spec(alarm) {
            Some(spec) => next.table.set().find(&spec.id),
            // Those of other systems keep their numbers.
            None => next.sources.get(alarm).map(|_| alarm),
        };
        next.selected = self.selected.and_then(now_of);
        let pending = self.pending.into_iter();
        next.pending = pending
            .filter_map(|pending| Some(PendingAction { alarm: now_of(pending.alarm)?, ..pending }))
            .collect();
        let host_requests = self.host_requests.into_iter();
        next.host_requests =
            host_requests.filter_map(|(alarm, action)| Some((now_of(alarm)?, action))).collect();
        (next.operator, next.list, next.tail) = (self.operator, self.list, self.tail);
        (next.refusal, next.has_host) = (self.refusal, self.has_host);
        Some(next)
    }
}
