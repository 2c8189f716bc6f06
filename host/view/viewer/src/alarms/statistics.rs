//! Alarms as the statistics tell them.

use busbar_alarms::AlarmSource;

use super::AlarmListRows;
use super::external_text::short_uncertainty;
use crate::stats::AlarmStats;

impl AlarmListRows<'_> {
    /// Returns the statistics of the alarms that are not normal.
    pub(crate) fn stats(&self) -> Vec<AlarmStats> {
        let Some(alarm_service) = self.alarm_service else { return Vec::new() };
        let table = alarm_service.table();
        let own = table.open().filter_map(|alarm| {
            let (spec, status) = (table.set().spec(alarm)?, table.status(alarm)?);
            Some(AlarmStats {
                id: spec.id.clone(),
                state: status.state,
                priority: spec.priority.name(),
                certain: status.is_certain,
                occurrences: status.occurrences,
                origin: (status.origin | self.origin_of(spec)).names().collect(),
                source: None,
                overlay: match &spec.source {
                    AlarmSource::Verdict { trigger, .. } => Some(trigger.overlay.clone()),
                    AlarmSource::Tag { .. } | AlarmSource::Mirrored => None,
                },
                assumed: status.is_assumed,
                reason: table.reason(alarm).map(str::to_owned),
                uncertainty: table.uncertainty(alarm).map(str::to_owned),
            })
        });
        let external = alarm_service.sources().iter().map(|(source, external)| AlarmStats {
            id: external.id(source),
            state: external.alarm.standing().state(),
            priority: external.priority.name(),
            certain: external.is_certain(source),
            occurrences: 0,
            origin: self.declared_origin(source).names().collect(),
            source: Some(source.name().to_owned()),
            overlay: None,
            assumed: false,
            reason: None,
            uncertainty: short_uncertainty(source, &external.alarm),
        });
        own.chain(external).collect()
    }
}
