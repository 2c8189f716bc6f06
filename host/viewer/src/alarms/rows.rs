//! Alarms as the panels show them.

use std::collections::{BTreeSet, HashSet};
use std::time::Duration;

use busbar_alarms::{AlarmHandle, AlarmSource, AlarmSpec, AlarmStatus, Priority, State};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{Origin, Snapshot, SourceTime, TagSet};
use busbar_ui::{AlarmDetail, AlarmList, AlarmModel, AlarmPriority, AlarmRow, AlarmRows, Beacon};

use super::sources::{Source, Sourced};
use super::{Alarming, words};
use crate::labels::{Sight, top_of};
use crate::load::LoadedScene;
use crate::rows::value_text;

/// Alarms as rows, made one by one as they are looked at. Without alarms there are none.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) alarming: Option<&'a Alarming>,
    pub(crate) scene: &'a LoadedScene,
    pub(crate) snapshot: Snapshot<'a>,
}

impl Rows<'_> {
    fn shown(&self) -> &[AlarmHandle] {
        self.alarming.map_or(&[], |alarming| match alarming.list {
            AlarmList::Alarms => &alarming.listing.alarms,
            AlarmList::Held => &alarming.listing.held,
            AlarmList::Log => &[],
        })
    }

    fn row_of(&self, alarming: &Alarming, alarm: AlarmHandle) -> Option<AlarmRow> {
        if let Some((source, sourced)) = alarming.sources.get(alarm) {
            return Some(self.sourced_row(alarming, source, sourced));
        }
        let (spec, status) = (alarming.table.set().spec(alarm)?, alarming.table.status(alarm)?);
        let (state, is_saving) = alarming.shown_state(alarm, status.state);
        let (value, doubt) = self.value_of(spec, &status);
        let wall_clock = alarming.wall_clock;
        Some(AlarmRow {
            number: alarm.0,
            id: spec.id.clone(),
            message: spec.message.clone(),
            priority: priority(spec.priority),
            state: state.name(),
            is_unacknowledged: state.is_unacknowledged(),
            is_active: status.standing.is_active,
            doubt,
            time: status.occurred.map_or_else(String::new, |at| words::time(at, wall_clock)),
            age: status.since.map(|since| elapsed(since, wall_clock)),
            value,
            equipment: self.equipment(alarming, alarm),
            occurrences: status.occurrences,
            chatters: status.chatters,
            is_first_out: status.is_first_out,
            shelf_left: status.shelf_left.filter(|_| state == State::G),
            is_saving,
            origin: status.origin | self.origin_of(spec),
            ..AlarmRow::default()
        })
    }

    fn sourced_row(&self, alarming: &Alarming, source: &Source, sourced: &Sourced) -> AlarmRow {
        let (alarm, wall_clock) = (&sourced.alarm, alarming.wall_clock);
        let standing = alarm.standing();
        AlarmRow {
            number: sourced.number.0,
            id: sourced.id(source),
            message: sourced.message().to_owned(),
            priority: priority(sourced.priority),
            state: alarm.state_name(),
            is_unacknowledged: standing.state().is_unacknowledged(),
            is_active: standing.is_active,
            doubt: source.doubt_of(alarm),
            time: alarm.since().map_or_else(String::new, |at| words::time(at, wall_clock)),
            age: alarm.since().map(|since| elapsed(since, wall_clock)),
            equipment: self.equipment(alarming, sourced.number),
            source: Some(source.name().to_owned()),
            origin: self.declared_origin(source),
            ..AlarmRow::default()
        }
    }

    /// Origin of an alarm's tag as it is.
    fn origin_of(&self, spec: &AlarmSpec) -> Origin {
        let AlarmSource::Tag { trigger, .. } = &spec.source else { return Origin::LIVE };
        self.snapshot.state(trigger.tag).map_or(Origin::LIVE, |state| state.origin)
    }

    /// Origin that the configuration declares of another system's alarms.
    fn declared_origin(&self, source: &Source) -> Origin {
        let plugin = self.scene.config.plugins.get(source.name());
        let is_simulated = plugin.is_some_and(|plugin| plugin.simulated);
        if is_simulated { Origin::SIMULATED } else { Origin::LIVE }
    }

    /// The value of an alarm's tag as it is, and why nothing is known of it.
    fn value_of(&self, spec: &AlarmSpec, status: &AlarmStatus) -> (String, Option<String>) {
        let AlarmSource::Tag { trigger, .. } = &spec.source else {
            return (String::new(), None);
        };
        let tags: &TagSet = &self.scene.tags;
        let (Some(tag), Some(state)) = (tags.spec(trigger.tag), self.snapshot.state(trigger.tag))
        else {
            return (String::new(), None);
        };
        let value = state.value.map_or_else(|| "–".into(), value_text);
        let value = if tag.unit.is_empty() { value } else { format!("{value} {}", tag.unit) };
        let reason = || state.quality.reason().map(|reason| reason.to_string());
        (value, (!status.is_certain).then(reason).flatten())
    }

    fn equipment(&self, alarming: &Alarming, alarm: AlarmHandle) -> Option<String> {
        let id = |node| self.scene.graph.node(node).id();
        if let Some((_, sourced)) = alarming.sources.get(alarm) {
            let called = || Some(sourced.alarm.source.clone()).filter(|text| !text.is_empty());
            return sourced.node.map(id).or_else(called);
        }
        let node = alarming.nodes.get(alarm.0 as usize).copied().flatten();
        node.map(id).or_else(|| alarming.table.set().spec(alarm)?.equipment.clone())
    }

    /// Of these alarms, and of those that other systems have at these nodes, the rows of those that are not normal, the most urgent first, at
    /// most `most`; and how many are normal.
    pub(crate) fn of(
        &self,
        alarms: &[AlarmHandle],
        nodes: &HashSet<NodeIndex>,
        most: usize,
    ) -> (Vec<AlarmRow>, usize) {
        let Some(alarming) = self.alarming else { return (Vec::new(), 0) };
        let state = |alarm| alarming.table.status(alarm).map(|status| status.state);
        let is_open = |alarm: &&AlarmHandle| state(**alarm).is_some_and(|s| s != State::A);
        let open = alarms.iter().filter(is_open);
        let mut rows: Vec<AlarmRow> =
            open.filter_map(|alarm| self.row_of(alarming, *alarm)).collect();
        let calm = alarms.len() - rows.len();
        let is_here = |sourced: &Sourced| sourced.node.is_some_and(|node| nodes.contains(&node));
        let sourced = alarming.sources.iter().filter(|(_, sourced)| is_here(sourced));
        rows.extend(sourced.map(|(source, sourced)| self.sourced_row(alarming, source, sourced)));
        rows.sort_by_key(|row| (!row.is_unacknowledged, row.priority as u8, row.age));
        rows.truncate(most);
        (rows, calm)
    }

    /// What is said beside the list.
    pub(crate) fn model(&self, flashes: bool) -> Option<AlarmModel> {
        let alarming = self.alarming?;
        let table = &alarming.table;
        let handling = &self.scene.config.alarm_handling;
        let of_priority = |priority| {
            let counts = table.counts(priority);
            let [unacknowledged, all] = alarming.listing.sourced_counts[priority as usize];
            [counts.unacknowledged() + unacknowledged, counts.annunciated() + all]
        };
        let newest = alarming.tail.iter().rev().filter(|_| alarming.list == AlarmList::Log);
        Some(AlarmModel {
            counts: Priority::ALL.map(of_priority),
            held: alarming.listing.held.len(),
            list: alarming.list,
            selected: alarming.selected.and_then(|alarm| self.detail(alarming, alarm)),
            banner: alarming.listing.most_urgent.and_then(|alarm| self.row_of(alarming, alarm)),
            log: newest.map(|record| words::record(record, alarming.wall_clock)).collect(),
            sources: alarming.sources.lamps(),
            trouble: alarming.trouble(),
            max_shelving: Duration::from_secs(u64::from(handling.max_shelving_minutes) * 60),
            flashes,
        })
    }

    fn detail(&self, alarming: &Alarming, alarm: AlarmHandle) -> Option<AlarmDetail> {
        if let Some((source, sourced)) = alarming.sources.get(alarm) {
            return Some(AlarmDetail {
                row: AlarmRow {
                    doubt: source.long_doubt_of(&sourced.alarm),
                    ..self.sourced_row(alarming, source, sourced)
                },
                condition: sourced.alarm.name.clone(),
                decided_by: Some(format!("'{}'", source.name())),
                can_ask: alarming.has_host,
                is_shelved: sourced.alarm.is_shelved,
                is_out_of_service: sourced.alarm.is_out_of_service,
                ..AlarmDetail::default()
            });
        }
        let (spec, status) = (alarming.table.set().spec(alarm)?, alarming.table.status(alarm)?);
        let is_mirrored = spec.source == AlarmSource::Mirrored;
        Some(AlarmDetail {
            row: self.row_of(alarming, alarm)?,
            condition: words::source(&spec.source, &self.scene.tags),
            consequence: spec.consequence.clone(),
            response: spec.response.clone(),
            decided_by: is_mirrored.then(|| "The host's alarm system".to_owned()),
            can_ask: alarming.has_host,
            can_reset: status.state == State::F,
            can_shelve: !matches!(status.state, State::H | State::I) && !is_mirrored,
            is_shelved: status.standing.is_shelved,
            is_out_of_service: status.standing.is_out_of_service,
        })
    }
}

impl AlarmRows for Rows<'_> {
    fn len(&self) -> usize {
        self.shown().len()
    }

    fn row(&self, index: usize) -> AlarmRow {
        let alarm = self.alarming.zip(self.shown().get(index));
        alarm.and_then(|(alarming, alarm)| self.row_of(alarming, *alarm)).unwrap_or_default()
    }

    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)> {
        let alarming = self.alarming?;
        let alarms = &alarming.listing.alarms;
        let chosen = alarming.selected.and_then(|chosen| alarms.iter().position(|a| *a == chosen));
        let (before, after) = alarms.split_at(chosen.map_or(0, |chosen| chosen + 1));
        let waits =
            |alarm: &&AlarmHandle| alarming.state_of(**alarm).is_some_and(State::is_unacknowledged);
        let next = *after.iter().chain(before).find(waits)?;
        Some((next.0, self.equipment(alarming, next)))
    }
}

/// Marks at the equipment in alarm that is before the camera.
pub(crate) fn beacons(alarming: &Alarming, graph: &SceneGraph, sight: Sight) -> Vec<Beacon> {
    let of_place = |(node, place): &(_, super::listing::Place)| {
        Some(Beacon {
            anchor: sight.projection.to_screen(top_of(graph.node(*node)))?,
            priority: priority(place.priority),
            is_unacknowledged: place.is_unacknowledged,
            is_doubtful: place.is_doubtful,
            count: place.count,
            origin: place.origin,
        })
    };
    alarming.listing.places.iter().filter_map(of_place).collect()
}

/// The equipment that beacons stand at.
pub(crate) fn nodes_in_alarm(alarming: &Alarming) -> BTreeSet<NodeIndex> {
    alarming.listing.places.iter().map(|(node, _)| *node).collect()
}

fn priority(priority: Priority) -> AlarmPriority {
    AlarmPriority::ALL[priority as usize]
}

fn elapsed(since: SourceTime, now: SourceTime) -> Duration {
    Duration::from_nanos(now.0.saturating_sub(since.0).max(0) as u64)
}
