//! One edge node as its host applications must see it (Sparkplug 3.0, 5.6 and 6.4): births
//! tell its metrics and their aliases, sequence numbers tell whether anything is missing.

use std::collections::HashMap;
use std::ops::Range;

use busbar_plugin_sdk::{LogLevel, Quality, Reason};
use srad_types::payload::{DataType, Metric};

use super::payload::{Payload, PayloadFault, data_type, instant, quality_code, raw_value};
use crate::convert::quality_of_code;
use crate::desk::Desk;

/// Aliases of one edge node.
pub(crate) const MAX_ALIASES: usize = 100_000;
/// Where the edge node's own metrics are among its devices.
const ITSELF: usize = 0;

/// What a message is about (Sparkplug 3.0, 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Birth,
    Data,
    Death,
}

/// An edge node with what tags name of it.
pub(crate) struct Node {
    pub(crate) group: String,
    pub(crate) id: String,
    devices: Vec<Device>,
    device_by_name: HashMap<String, usize>,
    metrics: Vec<NamedMetric>,
    /// By alias: the device, and the metric where a tag names it.
    aliases: HashMap<u64, (usize, Option<usize>)>,
    life: Life,
}

/// A device, or the edge node itself.
#[derive(Default)]
struct Device {
    metric_by_name: HashMap<String, usize>,
    points: Vec<Range<usize>>,
    /// As its birth told; another device may have taken one since.
    aliases: Vec<u64>,
}

/// A metric that tags name.
struct NamedMetric {
    points: Range<usize>,
    /// As its birth told.
    data_type: Option<DataType>,
    is_born: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Life {
    /// No birth was seen in this connection.
    Unknown,
    Alive {
        bd_seq: Option<u64>,
        /// The number that the next message has.
        next: u8,
        /// Whether a message is missing since the birth. A birth may have been among them,
        /// so aliases mean nothing any more.
        is_gapped: bool,
    },
    Dead,
}

impl Node {
    pub(crate) fn new(group: String, id: String) -> Self {
        Self {
            group,
            id,
            devices: vec![Device::default()],
            device_by_name: HashMap::new(),
            metrics: Vec::new(),
            aliases: HashMap::new(),
            life: Life::Unknown,
        }
    }

    /// Adds a point, in order of all points.
    pub(crate) fn add(&mut self, device: Option<&str>, metric: &str, point: usize) {
        let device = device.map_or(ITSELF, |name| {
            *self.device_by_name.entry(name.to_owned()).or_insert_with(|| {
                self.devices.push(Device::default());
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
                self.metrics.push(NamedMetric { points, data_type: None, is_born: false });
            }
        }
    }

    /// A connection begins: what the node said before is not known any more.
    pub(crate) fn begin(&mut self) {
        self.life = Life::Unknown;
        self.forget_births();
    }

    /// Marks all points of the node and its devices.
    pub(crate) fn mark_all(&self, reason: Reason, desk: &mut Desk) {
        for index in 0..self.devices.len() {
            self.mark_device(index, reason, desk);
        }
    }

    /// Takes a message of the node, or of a device. Whether a birth is needed to go on.
    pub(crate) fn heed(
        &mut self,
        kind: Kind,
        device: Option<&str>,
        payload: Payload<'_>,
        desk: &mut Desk,
    ) -> Result<bool, PayloadFault> {
        // A device that no tag names still counts in the node's sequence.
        let index = match device {
            None => Some(ITSELF),
            Some(name) => self.device_by_name.get(name).copied(),
        };
        match (kind, device) {
            (Kind::Birth, None) => self.be_born(payload, desk),
            (Kind::Death, None) => self.die(payload, desk),
            (Kind::Birth, Some(_)) => {
                let is_missing = self.follow(payload, desk);
                let Some(index) = index else { return Ok(is_missing) };
                if self.life == Life::Unknown || self.life == Life::Dead {
                    return Ok(true);
                }
                self.take_birth(index, payload, desk)?;
                Ok(is_missing)
            }
            (Kind::Death, Some(_)) => {
                let is_missing = self.follow(payload, desk);
                if let Some(index) = index {
                    self.forget_device(index);
                    self.mark_device(index, Reason::Communication, desk);
                }
                Ok(is_missing)
            }
            (Kind::Data, _) => {
                let is_missing = self.follow(payload, desk);
                if self.life == Life::Dead {
                    return Ok(true);
                }
                let Some(index) = index else { return Ok(is_missing) };
                Ok(self.take_metrics(index, payload, false, desk)? || is_missing)
            }
        }
    }

    /// NBIRTH: all that was known of node and devices is void.
    fn be_born(&mut self, payload: Payload<'_>, desk: &mut Desk) -> Result<bool, PayloadFault> {
        self.forget_births();
        self.mark_all(Reason::NotConnected, desk);
        let Some(sequence) = sequence(payload) else {
            self.life = Life::Unknown;
            self.tell(desk, "its birth has no sequence number, and is not used");
            return Ok(false);
        };
        let bd_seq = payload.bd_seq()?;
        self.life = Life::Alive { bd_seq, next: sequence.wrapping_add(1), is_gapped: false };
        self.take_birth(ITSELF, payload, desk)?;
        Ok(false)
    }

    /// NDEATH; one of an earlier life is not the node's end (Sparkplug 3.0, 6.4.16).
    fn die(&mut self, payload: Payload<'_>, desk: &mut Desk) -> Result<bool, PayloadFault> {
        let of_death = payload.bd_seq()?;
        if let Life::Alive { bd_seq: Some(of_birth), .. } = self.life
            && of_death.is_some_and(|of_death| of_death != of_birth)
        {
            return Ok(false);
        }
        self.life = Life::Dead;
        self.forget_births();
        self.mark_all(Reason::Communication, desk);
        self.tell(desk, "it is gone (death certificate)");
        Ok(false)
    }

    /// Follows the sequence of the node's messages. Whether a message is missing since its
    /// birth: then all that is known of the node may be outdated.
    fn follow(&mut self, payload: Payload<'_>, desk: &mut Desk) -> bool {
        let Life::Alive { bd_seq, next, is_gapped } = self.life else { return true };
        let sequence = sequence(payload);
        if sequence == Some(next) {
            self.life = Life::Alive { bd_seq, next: next.wrapping_add(1), is_gapped };
            return is_gapped;
        }
        let next = sequence.unwrap_or(next).wrapping_add(1);
        self.life = Life::Alive { bd_seq, next, is_gapped: true };
        if !is_gapped {
            self.mark_all(Reason::Communication, desk);
            self.tell(
                desk,
                "a message is missing (sequence number), so its values are bad until they come \
                 by name, or it is born again: see sparkplug.request_rebirth",
            );
        }
        true
    }

    fn take_birth(
        &mut self,
        device: usize,
        payload: Payload<'_>,
        desk: &mut Desk,
    ) -> Result<(), PayloadFault> {
        self.forget_device(device);
        self.take_metrics(device, payload, true, desk)?;
        let named = self.devices[device].metric_by_name.values();
        let unborn: Vec<usize> = named
            .filter_map(|metric| self.metrics.get(*metric))
            .filter(|metric| !metric.is_born)
            .flat_map(|metric| metric.points.clone())
            .collect();
        if !unborn.is_empty() {
            for point in &unborn {
                desk.mark(*point..point + 1, Reason::Configuration);
            }
            let text = format!(
                "its birth does not have what {} name: correct their metrics",
                desk.list(&unborn)
            );
            self.tell(desk, &text);
        }
        Ok(())
    }

    /// Takes the metrics of a payload; whether one has an alias that no birth told.
    fn take_metrics(
        &mut self,
        device: usize,
        payload: Payload<'_>,
        is_birth: bool,
        desk: &mut Desk,
    ) -> Result<bool, PayloadFault> {
        let mut is_unknown = false;
        let mut too_many = false;
        let too_long = payload.each_metric(|metric| {
            if is_birth {
                too_many |= !self.learn(device, metric);
            }
            match self.find(device, metric, is_birth) {
                Found::Named(named) => self.take(named, metric, payload.head.timestamp, desk),
                Found::Unnamed => {}
                Found::Unknown => {
                    is_unknown = true;
                    desk.ignored.aliases += 1;
                }
            }
        })?;
        desk.ignored.too_long += too_long as u64;
        if too_many {
            self.tell(
                desk,
                &format!("it has more than {MAX_ALIASES} aliases; the rest is left out"),
            );
        }
        Ok(is_unknown)
    }

    /// Learns name, alias and type of a metric from its birth; false where there are too many.
    fn learn(&mut self, device: usize, metric: &Metric) -> bool {
        let name = metric.name.as_deref().unwrap_or_default();
        let named = self.devices[device].metric_by_name.get(name).copied();
        if let Some(known) = named.and_then(|index| self.metrics.get_mut(index)) {
            known.is_born = true;
            known.data_type = data_type(metric);
        }
        let Some(alias) = metric.alias else { return true };
        if self.aliases.len() >= MAX_ALIASES && !self.aliases.contains_key(&alias) {
            return false;
        }
        self.aliases.insert(alias, (device, named));
        self.devices[device].aliases.push(alias);
        true
    }

    fn find(&self, device: usize, metric: &Metric, is_birth: bool) -> Found {
        if let Some(name) = metric.name.as_deref().filter(|name| !name.is_empty()) {
            let named = self.devices[device].metric_by_name.get(name);
            return named.map_or(Found::Unnamed, |index| Found::Named(*index));
        }
        let is_trusted = is_birth || matches!(self.life, Life::Alive { is_gapped: false, .. });
        match metric.alias.filter(|_| is_trusted).and_then(|alias| self.aliases.get(&alias)) {
            Some((of, Some(index))) if *of == device => Found::Named(*index),
            Some((of, None)) if *of == device => Found::Unnamed,
            _ => Found::Unknown,
        }
    }

    fn take(&self, named: usize, metric: &Metric, sent: Option<u64>, desk: &mut Desk) {
        let Some(NamedMetric { points, data_type: of_birth, .. }) = self.metrics.get(named) else {
            return;
        };
        if metric.is_historical == Some(true) {
            desk.ignored.historical += 1;
            return;
        }
        let source_time = metric.timestamp.or(sent).and_then(instant);
        let quality = quality_code(metric).map_or(Quality::Good, quality_of_code);
        let is_null = metric.is_null == Some(true);
        let raw = raw_value(metric, data_type(metric).or(*of_birth));
        for point in points.clone() {
            match raw {
                _ if is_null => desk.take_null(point, source_time),
                Ok(raw) => desk.take(point, raw, quality, source_time),
                Err(what) => desk.take_misfit(point, what),
            }
        }
    }

    fn mark_device(&self, device: usize, reason: Reason, desk: &mut Desk) {
        for points in &self.devices[device].points {
            desk.mark(points.clone(), reason);
        }
    }

    fn forget_births(&mut self) {
        self.aliases.clear();
        for device in &mut self.devices {
            device.aliases.clear();
        }
        for metric in &mut self.metrics {
            metric.is_born = false;
            metric.data_type = None;
        }
    }

    fn forget_device(&mut self, device: usize) {
        let known = &mut self.devices[device];
        for alias in known.aliases.drain(..) {
            if self.aliases.get(&alias).is_some_and(|(of, _)| *of == device) {
                self.aliases.remove(&alias);
            }
        }
        for index in known.metric_by_name.values() {
            if let Some(metric) = self.metrics.get_mut(*index) {
                metric.is_born = false;
                metric.data_type = None;
            }
        }
    }

    fn tell(&self, desk: &mut Desk, what: &str) {
        let text = format!("edge node '{}/{}': {what}", self.group, self.id);
        desk.tell(LogLevel::Warning, &text);
    }
}

enum Found {
    /// A metric that tags name.
    Named(usize),
    /// A metric that none names.
    Unnamed,
    /// An alias that no birth told, or none that can be trusted.
    Unknown,
}

/// Sequence numbers are 0 to 255 (Sparkplug 3.0, 6.4.4).
fn sequence(payload: Payload<'_>) -> Option<u8> {
    payload.head.sequence.and_then(|sequence| u8::try_from(sequence).ok())
}
