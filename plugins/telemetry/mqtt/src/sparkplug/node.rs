//! One edge node as its host applications must see it (Sparkplug 3.0, 5.6 and 6.4): births
//! tell its metrics and their aliases, sequence numbers tell whether anything is missing.
//!
//! A message, or a metric of it, that can be assigned to no metric is a gap of its device:
//! what it brought is newer than what is shown, so all of the device is bad.

use std::collections::HashMap;
use std::ops::Range;

use busbar_plugin_sdk::{LogLevel, Reason, SampleFlags};
use srad_types::payload::{DataType, Metric};

use super::aliases::{Alias, AliasTable};
use super::metric_value::{data_type, instant, quality, raw_value, unit};
use super::payload::{Entry, MAX_METRIC_BYTES, Payload, PayloadFault};
use crate::point_states::{PointStates, Stamp, StatedUnit};

/// Aliases of one edge node.
pub(crate) const MAX_ALIASES: usize = 100_000;
/// Largest lead of a death certificate's bdSeq over the birth's by which it belongs to a later
/// life, whose birth was lost. All others are old wills.
const MAX_UNSEEN_LIVES: u64 = 8;
/// Most missing messages before one; beyond, it counts as older than the last.
const MAX_AHEAD: u8 = 127;
/// Count of the values of bdSeq, which begin anew after the last (Sparkplug 3.0, 6.4.16).
const BD_SEQ_VALUES: u64 = 256;
/// Index of the edge node's own metrics among its devices.
const ITSELF: usize = 0;
/// Remedy of a gap, in messages.
const UNTIL_BIRTH: &str = "its values are bad until they come by name, or it is born again: see \
                           sparkplug.request_rebirth";

/// Kind of a message (Sparkplug 3.0, 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Birth,
    Data,
    Death,
}

/// An edge node with the metrics that tags name of it.
pub(crate) struct Node {
    pub(crate) group: String,
    pub(crate) id: String,
    devices: Vec<Device>,
    device_by_name: HashMap<String, usize>,
    metrics: Vec<NamedMetric>,
    life: Life,
    /// The number that the next message has, once one came.
    next: Option<u8>,
}

/// A device, or the edge node itself.
#[derive(Default)]
struct Device {
    name: Option<String>,
    metric_by_name: HashMap<String, usize>,
    points: Vec<Range<usize>>,
    aliases: AliasTable,
    state: DeviceState,
    /// True where points had a sample since all of them were marked bad.
    has_samples: bool,
    /// True where a loss of values was logged since the device's birth.
    is_loss_told: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum DeviceState {
    /// Aliases are valid as the birth certificate defined them.
    #[default]
    Sound,
    /// Messages contradict the birth certificate: aliases are valid only after the next birth.
    Gapped,
    /// The device died: nothing is valid before its next birth certificate.
    Dead,
}

/// A metric that tags name.
#[derive(Default)]
struct NamedMetric {
    points: Range<usize>,
    /// Data type from the birth certificate.
    data_type: Option<DataType>,
    is_born: bool,
    /// True where another metric has its alias.
    is_ambiguous: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Life {
    /// No birth was seen in this connection.
    Unknown,
    Alive {
        bd_seq: Option<u64>,
    },
    /// Messages are missing since the birth. A lost one may be a birth, so aliases are no longer
    /// valid.
    Gapped {
        bd_seq: Option<u64>,
    },
    Dead,
}

/// Order of a message by its sequence number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    /// The one that was due.
    Next,
    /// Messages before it are missing.
    Ahead,
    /// A repeated or overtaken one, or more than [`MAX_AHEAD`] are missing.
    Behind,
}

/// Outcome of the metrics of a message.
#[derive(Default)]
struct Taken {
    /// Metrics by an alias that no birth defined, or that contradicts their name.
    unknown: u64,
    /// Metrics that cannot be read, or have neither name nor alias.
    lost: u64,
}

enum Found {
    /// A metric that tags name.
    Named(usize),
    /// A metric that none names.
    Unnamed,
    /// Alias that no birth defined, or that is not valid now.
    Unknown,
    /// Neither name nor alias: encoders that leave out zeros leave out alias 0.
    Nameless,
}

impl Node {
    pub(crate) fn new(group: String, id: String) -> Self {
        Self {
            group,
            id,
            devices: vec![Device::default()],
            device_by_name: HashMap::new(),
            metrics: Vec::new(),
            life: Life::Unknown,
            next: None,
        }
    }

    /// Adds a point, in order of all points.
    pub(crate) fn add(&mut self, device: Option<&str>, metric: &str, point: usize) {
        let device = device.map_or(ITSELF, |name| {
            *self.device_by_name.entry(name.to_owned()).or_insert_with(|| {
                self.devices.push(Device { name: Some(name.to_owned()), ..Device::default() });
                self.devices.len() - 1
            })
        });
        let device = &mut self.devices[device];
        match device.points.last_mut() {
            Some(last) if last.end == point => last.end = point + 1,
            _ => device.points.push(point..point + 1),
        }
        match device.metric_by_name.get(metric) {
            Some(known) => self.metrics[*known].points.end = point + 1,
            None => {
                device.metric_by_name.insert(metric.to_owned(), self.metrics.len());
                let points = point..point + 1;
                self.metrics.push(NamedMetric { points, ..NamedMetric::default() });
            }
        }
    }

    /// Begins a connection and drops all that is known of the node.
    pub(crate) fn begin(&mut self) {
        (self.life, self.next) = (Life::Unknown, None);
        self.forget_births();
        for device in &mut self.devices {
            device.has_samples = false;
        }
    }

    /// Marks all points of the node and its devices.
    pub(crate) fn mark_all(&mut self, reason: Reason, point_states: &mut PointStates) {
        for index in 0..self.devices.len() {
            self.mark_device(index, reason, point_states);
        }
    }

    /// Handles an unreadable message of the node whose device is unknown.
    pub(crate) fn lose_all(&mut self, what: &str, point_states: &mut PointStates) {
        if self.mark_sampled(point_states) {
            self.tell(point_states, ITSELF, &format!("{what}: {UNTIL_BIRTH}"));
        }
    }

    /// Handles a message of the node or of a device, or the fault of an unreadable one. Returns
    /// true where a birth is needed.
    pub(crate) fn handle(
        &mut self,
        kind: Kind,
        device: Option<&str>,
        payload: Result<Payload<'_>, PayloadFault>,
        point_states: &mut PointStates,
    ) -> bool {
        point_states.ignored.malformed += u64::from(payload.is_err());
        match (kind, device) {
            (Kind::Birth, None) => return self.take_node_birth(payload, point_states),
            (Kind::Death, None) => return self.take_node_death(payload, point_states),
            _ => {}
        }
        let order = self.follow(&payload, point_states);
        let is_missing = !self.is_followed();
        // A device that no tag names still counts in the node's sequence.
        let index = match device {
            None => Some(ITSELF),
            Some(name) => self.device_by_name.get(name).copied(),
        };
        let Some(index) = index else { return is_missing };
        // Nothing of a dead node counts before it is born again, and nothing that is older
        // than what came already: all stays bad.
        if self.life == Life::Dead || order == Order::Behind {
            return true;
        }
        let is_birth_needed = match (kind, payload) {
            (Kind::Birth, Ok(payload)) => self.take_birth(index, payload, point_states),
            (Kind::Birth, Err(fault)) => {
                self.forget_device(index);
                self.lose_births(
                    index,
                    &format!("a birth of it cannot be read ({fault})"),
                    point_states,
                )
            }
            (Kind::Data, Ok(payload)) => self.take_data(index, payload, point_states),
            (Kind::Data, Err(fault)) => {
                self.lose(index, &format!("a message of it cannot be read ({fault})"), point_states)
            }
            (Kind::Death, _) => {
                self.forget_device(index);
                self.devices[index].state = DeviceState::Dead;
                self.mark_device(index, Reason::Communication, point_states);
                false
            }
        };
        is_birth_needed || is_missing
    }

    /// Takes an NBIRTH: all that was known of node and devices is void.
    fn take_node_birth(
        &mut self,
        payload: Result<Payload<'_>, PayloadFault>,
        point_states: &mut PointStates,
    ) -> bool {
        self.forget_births();
        self.mark_all(Reason::NotConnected, point_states);
        (self.life, self.next) = (Life::Unknown, None);
        let payload = match payload {
            Ok(payload) => payload,
            Err(fault) => {
                self.tell(point_states, ITSELF, &format!("its birth cannot be read ({fault})"));
                return true;
            }
        };
        let Some(sequence) = sequence(payload) else {
            self.tell(point_states, ITSELF, "its birth has no sequence number, and is not used");
            return true;
        };
        self.life = Life::Alive { bd_seq: payload.bd_seq() };
        self.next = Some(sequence.wrapping_add(1));
        self.take_birth(ITSELF, payload, point_states)
    }

    /// Takes an NDEATH; one of an earlier life is not the node's end (Sparkplug 3.0, 6.4.16).
    fn take_node_death(
        &mut self,
        payload: Result<Payload<'_>, PayloadFault>,
        point_states: &mut PointStates,
    ) -> bool {
        let of_death = payload.ok().and_then(Payload::bd_seq);
        if let Life::Alive { bd_seq: Some(of_birth) } | Life::Gapped { bd_seq: Some(of_birth) } =
            self.life
            && let Some(of_death) = of_death
            && of_death.wrapping_sub(of_birth) % BD_SEQ_VALUES > MAX_UNSEEN_LIVES
        {
            let text = format!(
                "a death certificate of another life (bdSeq {of_death}, its birth has \
                 {of_birth}) changes nothing"
            );
            self.tell(point_states, ITSELF, &text);
            return false;
        }
        (self.life, self.next) = (Life::Dead, None);
        self.forget_births();
        self.mark_all(Reason::Communication, point_states);
        self.tell(point_states, ITSELF, "it is gone (death certificate)");
        false
    }

    /// Follows the sequence of the node's messages: after a gap, all that is known of the
    /// node may be outdated.
    fn follow(
        &mut self,
        payload: &Result<Payload<'_>, PayloadFault>,
        point_states: &mut PointStates,
    ) -> Order {
        if self.life == Life::Dead {
            return Order::Next;
        }
        let expected = self.next;
        let (found, order) = match payload {
            // Its number, too, cannot be read; the next message shows whether it was due.
            Err(_) => (expected, Order::Next),
            Ok(payload) => {
                let found = sequence(*payload);
                let order = match (expected, found) {
                    (_, None) => Order::Ahead,
                    (None, Some(_)) => Order::Next,
                    (Some(expected), Some(found)) => match found.wrapping_sub(expected) {
                        0 => Order::Next,
                        1..=MAX_AHEAD => Order::Ahead,
                        _ => Order::Behind,
                    },
                };
                (found, order)
            }
        };
        if order != Order::Behind {
            self.next = found.or(expected).map(|sequence| sequence.wrapping_add(1));
        }
        if order != Order::Next {
            self.note_gap(point_states);
        }
        order
    }

    /// Takes the sign that messages are missing: births, too, may be among them.
    fn note_gap(&mut self, point_states: &mut PointStates) {
        let mut is_new = false;
        if let Life::Alive { bd_seq } = self.life {
            self.life = Life::Gapped { bd_seq };
            is_new = true;
        }
        for device in &mut self.devices {
            device.state = DeviceState::Sound;
        }
        if self.mark_sampled(point_states) || is_new {
            let text = format!("a message is missing (sequence number): {UNTIL_BIRTH}");
            self.tell(point_states, ITSELF, &text);
        }
    }

    /// Reports whether no message is missing since the node's birth.
    fn is_followed(&self) -> bool {
        matches!(self.life, Life::Alive { .. })
    }

    /// Takes the metrics of a birth in two passes: all aliases are known before the first value is
    /// published. Returns true where another birth is needed.
    fn take_birth(
        &mut self,
        device: usize,
        payload: Payload<'_>,
        point_states: &mut PointStates,
    ) -> bool {
        self.forget_device(device);
        let mut aliases: usize = self.devices.iter().map(|device| device.aliases.len()).sum();
        let (mut lost, mut ambiguous, mut too_many) = (0_u64, Vec::new(), 0_u64);
        payload.each_metric(|entry| match entry {
            Entry::Metric(metric) | Entry::TooLong(metric) => {
                let Some(name) = metric.name.as_deref().filter(|name| !name.is_empty()) else {
                    lost += 1;
                    return;
                };
                let named = self.devices[device].metric_by_name.get(name).copied();
                if let Some(known) = named.and_then(|index| self.metrics.get_mut(index)) {
                    known.is_born = true;
                    known.data_type = data_type(metric).ok().flatten();
                    // A birth tells all of a metric's properties.
                    for point in known.points.clone() {
                        point_states.note_unit(point, unit(metric));
                    }
                }
                let Some(alias) = metric.alias else { return };
                if aliases >= MAX_ALIASES {
                    too_many += 1;
                    return;
                }
                let table = &mut self.devices[device].aliases;
                let before = table.len();
                ambiguous.extend(table.learn(alias, named).into_iter().flatten());
                aliases += table.len() - before;
            }
            Entry::Malformed => lost += 1,
        });
        for index in &ambiguous {
            self.metrics[*index].is_ambiguous = true;
        }
        let is_lossy = lost + too_many > 0;
        if is_lossy {
            point_states.ignored.malformed += lost;
            point_states.ignored.aliases += too_many;
            let text = format!(
                "{lost} metrics of its birth cannot be read or have no name, {too_many} aliases \
                 are beyond {MAX_ALIASES}"
            );
            self.lose_births(device, &text, point_states);
        }
        self.take_metrics(device, payload, point_states);
        self.mark_unborn(device, is_lossy, point_states);
        self.mark_ambiguous(device, point_states);
        is_lossy
    }

    /// Marks the metrics that tags name and the birth did not have.
    fn mark_unborn(&mut self, device: usize, is_lossy: bool, point_states: &mut PointStates) {
        let unborn = self.points_of(device, |metric| !metric.is_born);
        if unborn.is_empty() || is_lossy {
            return;
        }
        for point in &unborn {
            point_states.mark(*point..point + 1, Reason::Configuration);
        }
        let list = point_states.list(&unborn);
        let text = format!("its birth does not have what {list} name: correct their metrics");
        self.tell(point_states, device, &text);
    }

    /// Marks the metrics whose alias another one has, too: no value by it can be assigned.
    fn mark_ambiguous(&mut self, device: usize, point_states: &mut PointStates) {
        let ambiguous = self.points_of(device, |metric| metric.is_ambiguous);
        if ambiguous.is_empty() {
            return;
        }
        for point in &ambiguous {
            point_states.mark(*point..point + 1, Reason::Configuration);
        }
        let list = point_states.list(&ambiguous);
        let text = format!("its birth gives one alias to two metrics, one of them that of {list}");
        self.tell(point_states, device, &text);
    }

    fn points_of(&self, device: usize, is_wanted: impl Fn(&NamedMetric) -> bool) -> Vec<usize> {
        let metrics = self.devices[device].metric_by_name.values();
        let metrics = metrics.filter_map(|index| self.metrics.get(*index));
        metrics
            .filter(|metric| is_wanted(metric))
            .flat_map(|metric| metric.points.clone())
            .collect()
    }

    /// Takes the metrics of a data message; returns true where a birth is needed.
    fn take_data(
        &mut self,
        device: usize,
        payload: Payload<'_>,
        point_states: &mut PointStates,
    ) -> bool {
        if self.devices[device].state == DeviceState::Dead {
            return true;
        }
        point_states.hold();
        let Taken { unknown, lost } = self.take_metrics(device, payload, point_states);
        if unknown + lost > 0 {
            point_states.ignored.aliases += unknown;
            point_states.ignored.malformed += lost;
            // What cannot be assigned may be a newer value of any of its metrics.
            point_states.drop_held();
            if unknown > 0 {
                self.devices[device].state = DeviceState::Gapped;
            }
            let text = match (unknown, lost) {
                (0, _) => format!(
                    "{lost} metrics of a message cannot be read or have neither name nor alias"
                ),
                (_, 0) => format!(
                    "{unknown} metrics of a message have aliases that its birth did not tell"
                ),
                _ => format!(
                    "{lost} metrics of a message cannot be read, {unknown} have aliases that its \
                     birth did not tell"
                ),
            };
            self.lose(device, &text, point_states);
        }
        point_states.release();
        unknown + lost > 0
    }

    fn take_metrics(
        &mut self,
        device: usize,
        payload: Payload<'_>,
        point_states: &mut PointStates,
    ) -> Taken {
        let mut taken = Taken::default();
        payload.each_metric(|entry| {
            let (metric, is_too_long) = match entry {
                Entry::Metric(metric) => (metric, false),
                Entry::TooLong(metric) => (metric, true),
                Entry::Malformed => {
                    taken.lost += 1;
                    return;
                }
            };
            match self.find(device, metric) {
                Found::Named(index) => {
                    self.devices[device].has_samples = true;
                    self.take(index, metric, is_too_long, payload.head.timestamp, point_states);
                }
                Found::Unnamed => {}
                Found::Unknown => taken.unknown += 1,
                Found::Nameless => taken.lost += 1,
            }
        });
        taken
    }

    fn find(&self, device: usize, metric: &Metric) -> Found {
        let Device { metric_by_name, aliases, state, .. } = &self.devices[device];
        let is_trusted = self.is_followed() && *state == DeviceState::Sound;
        let by_alias = metric.alias.filter(|_| is_trusted).and_then(|alias| aliases.get(alias));
        let Some(name) = metric.name.as_deref().filter(|name| !name.is_empty()) else {
            return match (metric.alias, by_alias) {
                (None, _) => Found::Nameless,
                (Some(_), None) => Found::Unknown,
                (Some(_), Some(Alias::Named(index))) => Found::Named(index),
                // Both metrics are bad already, where tags name them.
                (Some(_), Some(Alias::Unnamed | Alias::Ambiguous)) => Found::Unnamed,
            };
        };
        let by_name = metric_by_name.get(name).copied();
        match (by_name, by_alias) {
            (Some(index), Some(Alias::Named(other))) if index != other => Found::Unknown,
            (None, Some(Alias::Named(_))) | (Some(_), Some(Alias::Unnamed)) => Found::Unknown,
            (Some(index), _) => Found::Named(index),
            (None, _) => Found::Unnamed,
        }
    }

    fn take(
        &self,
        named: usize,
        metric: &Metric,
        is_too_long: bool,
        sent: Option<u64>,
        point_states: &mut PointStates,
    ) {
        let Some(NamedMetric { points, data_type: of_birth, is_ambiguous, .. }) =
            self.metrics.get(named)
        else {
            return;
        };
        if *is_ambiguous {
            return;
        }
        let is_historical = metric.is_historical == Some(true);
        // When it was sent says nothing of when a value of the past was so.
        let millis = metric.timestamp.or(sent.filter(|_| !is_historical));
        let source_time = millis.and_then(instant);
        let mut flags = SampleFlags::LIVE;
        if is_historical {
            flags |= SampleFlags::BUFFERED | SampleFlags::HISTORICAL;
        }
        if source_time.is_none() {
            flags |= SampleFlags::TIME_UNUSABLE;
        }
        let stamp = Stamp { quality: quality(metric), source_time, flags };
        // A birth that was lost may have told another type.
        let of_birth = of_birth.filter(|_| self.is_followed());
        let raw = raw_value(metric, of_birth);
        let stated = unit(metric);
        for point in points.clone() {
            // Data without the property leaves the unit as the birth told it.
            if stated != StatedUnit::Absent {
                point_states.note_unit(point, stated);
            }
            if source_time.is_none() {
                point_states.tell_time(point, || match millis {
                    None => "missing (metric and message have no timestamp)".into(),
                    Some(millis) => format!("impossible (timestamp {millis}, not milliseconds?)"),
                });
            }
            match raw {
                _ if is_too_long => {
                    point_states.ignored.too_long += 1;
                    let text = format!("a metric of more than {MAX_METRIC_BYTES} bytes");
                    point_states.take_misfit(point, &text);
                }
                _ if metric.is_null == Some(true) => point_states.take_null(point, stamp),
                Ok(raw) => match point_states.value_of(point, raw) {
                    Some(value) => point_states.take_value(point, value, stamp),
                    None => point_states.take_misfit(point, crate::convert::name_of(raw)),
                },
                Err(what) => point_states.take_misfit(point, what),
            }
        }
    }

    /// Handles the loss of a device's values: those that are shown turn bad. Aliases stay valid.
    /// Returns true, because a birth is needed.
    fn lose(&mut self, device: usize, what: &str, point_states: &mut PointStates) -> bool {
        let known = &mut self.devices[device];
        let is_told = std::mem::replace(&mut known.is_loss_told, true);
        let is_shown = known.has_samples;
        if is_shown {
            self.mark_device(device, Reason::Communication, point_states);
        }
        if is_shown || !is_told {
            self.tell(point_states, device, &format!("{what}: {UNTIL_BIRTH}"));
        }
        true
    }

    /// Handles an unreadable birth of a device: its aliases are no longer valid. Returns true,
    /// because another birth is needed.
    fn lose_births(&mut self, device: usize, what: &str, point_states: &mut PointStates) -> bool {
        self.devices[device].state = DeviceState::Gapped;
        self.mark_device(device, Reason::Communication, point_states);
        self.tell(point_states, device, &format!("{what}: {UNTIL_BIRTH}"));
        true
    }

    fn mark_device(&mut self, device: usize, reason: Reason, point_states: &mut PointStates) {
        let device = &mut self.devices[device];
        device.has_samples = false;
        for points in &device.points {
            point_states.mark(points.clone(), reason);
        }
    }

    /// Marks the devices that had samples since they were marked last; false if none had.
    fn mark_sampled(&mut self, point_states: &mut PointStates) -> bool {
        let mut is_any = false;
        for index in 0..self.devices.len() {
            if self.devices[index].has_samples {
                is_any = true;
                self.mark_device(index, Reason::Communication, point_states);
            }
        }
        is_any
    }

    fn forget_births(&mut self) {
        for index in 0..self.devices.len() {
            self.forget_device(index);
        }
    }

    fn forget_device(&mut self, device: usize) {
        let known = &mut self.devices[device];
        (known.state, known.is_loss_told) = (DeviceState::Sound, false);
        known.aliases.clear();
        for index in known.metric_by_name.values() {
            if let Some(metric) = self.metrics.get_mut(*index) {
                let points = metric.points.clone();
                *metric = NamedMetric { points, ..NamedMetric::default() };
            }
        }
    }

    fn tell(&self, point_states: &mut PointStates, device: usize, what: &str) {
        let Self { group, id, .. } = self;
        let text = match self.devices.get(device).and_then(|device| device.name.as_ref()) {
            Some(name) => format!("device '{group}/{id}/{name}': {what}"),
            None => format!("edge node '{group}/{id}': {what}"),
        };
        point_states.tell(LogLevel::Warning, &text);
    }
}

/// Reads the sequence number, 0 to 255 (Sparkplug 3.0, 6.4.4).
fn sequence(payload: Payload<'_>) -> Option<u8> {
    payload.head.sequence.and_then(|sequence| u8::try_from(sequence).ok())
}
