//! Alarms as the panels show them.

use std::collections::HashSet;
use std::time::Duration;

use busbar_alarms::{AlarmHandle, AlarmSource, AlarmSpec, AlarmStatus};
use busbar_scene::NodeIndex;
use busbar_site::{AlarmService, ExternalAlarm, ExternalSource};
use busbar_tags::{Snapshot, SourceTime, TagSet};
use busbar_types::{AlarmState, Origin, Priority};
use busbar_ui::{Age, AlarmDetail, AlarmList, AlarmModel, AlarmRow, AlarmRows};

use super::external_text::{long_uncertainty, short_uncertainty, statuses};
use super::{AlarmPresentation, text};
use crate::panel_rows::value_text;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::{node_of, number_of};

/// Alarms as rows, made one by one as they are looked at. Without alarms there are none.
#[derive(Clone, Copy)]
pub(crate) struct AlarmListRows<'a> {
    pub(crate) alarm_service: Option<&'a AlarmService>,
    pub(crate) presentation: &'a AlarmPresentation,
    pub(crate) scene: &'a LoadedScene,
    pub(crate) snapshot: Snapshot<'a>,
}

impl AlarmListRows<'_> {
    fn shown(&self) -> &[AlarmHandle] {
        self.alarm_service.map_or(&[], |alarm_service| match self.presentation.list {
            AlarmList::Alarms => alarm_service.listing().alarms(),
            AlarmList::Held => alarm_service.listing().held(),
            AlarmList::Log => &[],
        })
    }

    fn row_of(&self, alarm_service: &AlarmService, alarm: AlarmHandle) -> Option<AlarmRow> {
        if let Some((source, external)) = alarm_service.sources().get(alarm) {
            return Some(self.external_row(alarm_service, source, external));
        }
        let (spec, status) =
            (alarm_service.table().set().spec(alarm)?, alarm_service.table().status(alarm)?);
        let (state, is_saving) = alarm_service.shown_state(alarm, status.state);
        let (value, uncertainty) = self.value_of(alarm_service, alarm, (spec, &status));
        let wall_clock = alarm_service.wall_clock();
        Some(AlarmRow {
            number: alarm.0,
            id: spec.id.clone(),
            message: spec.message.clone(),
            priority: spec.priority,
            state: state.name(),
            is_unacknowledged: state.is_unacknowledged(),
            is_active: status.standing.is_active,
            uncertainty,
            time: status.occurred.map_or_else(String::new, |at| text::time(at, wall_clock)),
            age: status.since.map(|since| elapsed(since, wall_clock).into()),
            value,
            equipment: self.equipment(alarm_service, alarm),
            occurrences: status.occurrences,
            chatters: status.chatters,
            is_first_out: status.is_first_out,
            shelf_left: status.shelf_left.filter(|_| state == AlarmState::Shelved).map(Age::from),
            is_saving,
            origin: status.origin | self.origin_of(spec),
            ..AlarmRow::default()
        })
    }

    fn external_row(
        &self,
        alarm_service: &AlarmService,
        source: &ExternalSource,
        external: &ExternalAlarm,
    ) -> AlarmRow {
        let (alarm, wall_clock) = (&external.alarm, alarm_service.wall_clock());
        let standing = alarm.standing();
        AlarmRow {
            number: external.number.0,
            id: external.id(source),
            message: external.message().to_owned(),
            priority: external.priority,
            state: alarm.state_name(),
            is_unacknowledged: standing.state().is_unacknowledged(),
            is_active: standing.is_active,
            uncertainty: short_uncertainty(source, alarm),
            time: alarm.since().map_or_else(String::new, |at| text::time(at, wall_clock)),
            age: alarm.since().map(|since| elapsed(since, wall_clock).into()),
            equipment: self.equipment(alarm_service, external.number),
            source: Some(source.name().to_owned()),
            origin: self.declared_origin(source),
            ..AlarmRow::default()
        }
    }

    /// Origin of an alarm's tag as it is.
    pub(super) fn origin_of(&self, spec: &AlarmSpec) -> Origin {
        let AlarmSource::Tag { trigger, .. } = &spec.source else { return Origin::LIVE };
        self.snapshot.state(trigger.tag).map_or(Origin::LIVE, |state| state.origin)
    }

    /// Origin that the configuration declares of another system's alarms.
    pub(super) fn declared_origin(&self, source: &ExternalSource) -> Origin {
        let plugin = self.scene.config.plugins.get(source.name());
        let is_simulated = plugin.is_some_and(|plugin| plugin.simulated);
        if is_simulated { Origin::SIMULATED } else { Origin::LIVE }
    }

    /// The value of an alarm's tag or the reason of its verdict, and why nothing is known of it.
    fn value_of(
        &self,
        alarm_service: &AlarmService,
        alarm: AlarmHandle,
        (spec, status): (&AlarmSpec, &AlarmStatus),
    ) -> (String, Option<String>) {
        let trigger = match &spec.source {
            AlarmSource::Tag { trigger, .. } => trigger,
            AlarmSource::Verdict { .. } => return verdict_texts(alarm_service, alarm, status),
            AlarmSource::Mirrored => return (String::new(), None),
        };
        let tags: &TagSet = &self.scene.tags;
        let (Some(tag), Some(state)) = (tags.spec(trigger.tag), self.snapshot.state(trigger.tag))
        else {
            return (String::new(), None);
        };
        let value = state.value.as_ref().map_or_else(|| "–".into(), value_text);
        let value = if tag.unit.is_empty() { value } else { format!("{value} {}", tag.unit) };
        let reason = || state.quality.reason().map(|reason| reason.to_string());
        (value, (!status.is_certain).then(reason).flatten())
    }

    fn equipment(&self, alarm_service: &AlarmService, alarm: AlarmHandle) -> Option<String> {
        let equipment = alarm_service.equipment_of(alarm);
        if let Some(equipment) = equipment {
            return Some(self.scene.graph.node(node_of(equipment)).id());
        }
        if let Some((_, external)) = alarm_service.sources().get(alarm) {
            return Some(external.alarm.source.clone()).filter(|text| !text.is_empty());
        }
        alarm_service.table().set().spec(alarm)?.equipment.clone()
    }

    /// Returns rows of the abnormal alarms among `alarms` and of external alarms at `nodes`, the
    /// most urgent first, at most `most`. The count is that of normal alarms.
    pub(crate) fn for_equipment(
        &self,
        alarms: &[AlarmHandle],
        nodes: &HashSet<NodeIndex>,
        most: usize,
    ) -> (Vec<AlarmRow>, usize) {
        let Some(alarm_service) = self.alarm_service else { return (Vec::new(), 0) };
        let state = |alarm| alarm_service.table().status(alarm).map(|status| status.state);
        let is_open =
            |alarm: &&AlarmHandle| state(**alarm).is_some_and(|s| s != AlarmState::Normal);
        let of_templates =
            nodes.iter().flat_map(|node| alarm_service.of_templates_at(number_of(*node)));
        let all = || alarms.iter().chain(of_templates.clone());
        let open = all().filter(is_open);
        let mut rows: Vec<AlarmRow> =
            open.filter_map(|alarm| self.row_of(alarm_service, *alarm)).collect();
        let calm = all().count() - rows.len();
        let is_here = |external: &ExternalAlarm| {
            external.equipment.is_some_and(|equipment| nodes.contains(&node_of(equipment)))
        };
        let external = alarm_service.sources().iter().filter(|(_, external)| is_here(external));
        rows.extend(
            external.map(|(source, external)| self.external_row(alarm_service, source, external)),
        );
        let age = |row: &AlarmRow| row.age.map(Age::duration);
        rows.sort_by_key(|row| (!row.is_unacknowledged, row.priority as u8, age(row)));
        rows.truncate(most);
        (rows, calm)
    }

    /// Returns the view model of the alarm panel.
    pub(crate) fn model(&self, flashes: bool) -> Option<AlarmModel> {
        let alarm_service = self.alarm_service?;
        let (table, listing) = (alarm_service.table(), alarm_service.listing());
        let (presentation, handling) = (self.presentation, &self.scene.config.alarm_handling);
        let of_priority = |priority| {
            let counts = table.counts(priority);
            let [unacknowledged, all] = listing.external_counts()[priority as usize];
            [counts.unacknowledged() + unacknowledged, counts.annunciated() + all]
        };
        let newest =
            alarm_service.log_tail().iter().rev().filter(|_| presentation.list == AlarmList::Log);
        Some(AlarmModel {
            counts: Priority::ALL.map(of_priority),
            held: listing.held().len(),
            list: presentation.list,
            selected: presentation.selected.and_then(|alarm| self.detail(alarm_service, alarm)),
            banner: listing.most_urgent().and_then(|alarm| self.row_of(alarm_service, alarm)),
            log: newest.map(|record| text::record(record, alarm_service.wall_clock())).collect(),
            sources: statuses(alarm_service.sources()),
            trouble: presentation.fault_text(alarm_service),
            max_shelving: handling.max_shelving,
            flashes,
        })
    }

    fn detail(&self, alarm_service: &AlarmService, alarm: AlarmHandle) -> Option<AlarmDetail> {
        if let Some((source, external)) = alarm_service.sources().get(alarm) {
            return Some(AlarmDetail {
                row: AlarmRow {
                    uncertainty: long_uncertainty(source, &external.alarm),
                    ..self.external_row(alarm_service, source, external)
                },
                condition: external.alarm.name.clone(),
                decided_by: Some(format!("'{}'", source.name())),
                can_ask: alarm_service.has_host(),
                is_shelved: external.alarm.is_shelved,
                is_out_of_service: external.alarm.is_out_of_service,
                ..AlarmDetail::default()
            });
        }
        let (spec, status) =
            (alarm_service.table().set().spec(alarm)?, alarm_service.table().status(alarm)?);
        let is_mirrored = spec.source.is_mirrored();
        Some(AlarmDetail {
            row: self.row_of(alarm_service, alarm)?,
            condition: text::condition(&spec.source, &self.scene.tags),
            consequence: spec.consequence.clone(),
            response: spec.response.clone(),
            decided_by: is_mirrored.then(|| "The host's alarm system".to_owned()),
            can_ask: alarm_service.has_host(),
            can_reset: status.state == AlarmState::LatchedAcknowledged,
            can_shelve: !matches!(
                status.state,
                AlarmState::SuppressedByDesign | AlarmState::OutOfService
            ) && !is_mirrored,
            is_shelved: status.standing.is_shelved,
            is_out_of_service: status.standing.is_out_of_service,
        })
    }
}

impl AlarmRows for AlarmListRows<'_> {
    fn len(&self) -> usize {
        self.shown().len()
    }

    fn row(&self, index: usize) -> AlarmRow {
        let alarm = self.alarm_service.zip(self.shown().get(index));
        alarm
            .and_then(|(alarm_service, alarm)| self.row_of(alarm_service, *alarm))
            .unwrap_or_default()
    }

    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)> {
        let alarm_service = self.alarm_service?;
        let alarms = alarm_service.listing().alarms();
        let selected = self.presentation.selected;
        let chosen = selected.and_then(|chosen| alarms.iter().position(|a| *a == chosen));
        let (before, after) = alarms.split_at(chosen.map_or(0, |chosen| chosen + 1));
        let waits = |alarm: &&AlarmHandle| {
            alarm_service.state_of(**alarm).is_some_and(AlarmState::is_unacknowledged)
        };
        let next = *after.iter().chain(before).find(waits)?;
        Some((next.0, self.equipment(alarm_service, next)))
    }
}

/// Reason of the verdict by which an alarm came, and why the verdict is unknown now.
fn verdict_texts(
    alarm_service: &AlarmService,
    alarm: AlarmHandle,
    status: &AlarmStatus,
) -> (String, Option<String>) {
    let uncertainty = alarm_service.table().uncertainty(alarm).unwrap_or("not judged yet");
    (alarm_service.reason_of(alarm), (!status.is_certain).then(|| uncertainty.to_owned()))
}

fn elapsed(since: SourceTime, now: SourceTime) -> Duration {
    Duration::from_nanos(now.0.saturating_sub(since.0).max(0) as u64)
}
