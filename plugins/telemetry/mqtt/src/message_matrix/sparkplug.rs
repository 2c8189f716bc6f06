//! Message matrix of an edge node of Sparkplug B. The bound: a message that is lost shows at
//! the node's next one, so until then values of before may be good.

use std::collections::VecDeque;

use busbar_plugin_sdk::ValueKind;
use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;
use srad_types::payload::{DataType, Message, MetaData, Metric, Payload, metric};

use super::*;

/// Metrics of the node itself, and of its devices. Of each device another one, without a
/// tag, is sent along.
const DEVICES: [Option<&str>; 3] = [None, Some("d1"), Some("d2")];
const PER_DEVICE: usize = 3;
const METRICS: usize = DEVICES.len() * PER_DEVICE;
/// Name of the metric without a tag, which is numbered last.
const UNTAGGED: &str = "untagged";
/// Range of the values of one metric, so that a value identifies its metric.
const PER_METRIC: i64 = 1_000_000_000;
/// Messages that may be lost in a row: fewer than sequence numbers that count as missing.
const MAX_LOST: u32 = 100;
/// Messages that may come again.
const MAX_SENT: usize = 60;
/// Number of message kinds in the matrix.
const KINDS: u8 = 40;

/// Numbering of aliases by the encoder of the edge node, chosen anew at each birth.
#[derive(Clone, Copy, Debug, Default)]
struct Numbering {
    /// True where each device begins anew.
    is_per_device: bool,
    turn: u64,
    /// True where 0 is left out, as encoders of proto3 do.
    leaves_out_zero: bool,
}

/// A message as it is sent.
#[derive(Clone)]
struct Outgoing {
    topic: String,
    payload: Vec<u8>,
    /// None of an NDEATH.
    sequence: Option<u8>,
    is_readable: bool,
}

impl Outgoing {
    /// Reports whether the message follows the sequence of a birth of its node.
    fn is_numbered(&self) -> bool {
        !self.topic.contains("NBIRTH") && !self.topic.contains("NDEATH")
    }
}

struct Matrix {
    client: Client,
    rng: Rng,
    millis: u64,
    bd_seq: u64,
    sequence: u8,
    count: i64,
    numbering: Numbering,
    is_alive: bool,
    /// By metric: the newest value that was sent, lost or not.
    truth: [Option<i64>; METRICS],
    /// True where messages were lost since one came that has a readable number.
    is_excused: bool,
    lost: u32,
    /// The number that whoever listens expects.
    expected: Option<u8>,
    kinds: [u64; KINDS as usize],
    /// Messages of devices since the last birth of the node.
    sent: VecDeque<Outgoing>,
}

impl Matrix {
    fn new(seed: u64, version: Version) -> Self {
        let address = |metric: usize| {
            let mut address = json!({"group": "g", "edge_node": "e", "metric": name(metric)});
            if let Some(device) = DEVICES[metric / PER_DEVICE] {
                address["device"] = json!(device);
            }
            address
        };
        let tag = |metric| {
            let kind = if is_text(metric) { ValueKind::Text } else { ValueKind::I64 };
            tag_spec(metric as u32, "t", kind, address(metric))
        };
        let tags: Vec<_> = (0..METRICS).map(tag).collect();
        let mut rng = Rng::with_seed(seed);
        let client = Client::new(json!({"host": "a"}), &tags, version, rng.fork());
        Self {
            client,
            rng,
            millis: 1_700_000_000_000,
            bd_seq: 0,
            sequence: 0,
            count: 0,
            numbering: Numbering::default(),
            is_alive: false,
            truth: [None; METRICS],
            is_excused: false,
            lost: 0,
            expected: None,
            kinds: [0; KINDS as usize],
            sent: VecDeque::new(),
        }
    }

    /// Creates a metric with a new value. The source's clock is set back at times.
    fn metric(&mut self, metric: usize, has_name: bool, has_alias: bool) -> Metric {
        self.count += 1;
        self.millis += 10;
        if self.rng.u8(..) == 0 {
            self.millis -= 5_000_000;
        }
        let value = (metric as i64 + 1) * PER_METRIC + self.count;
        self.truth[metric] = Some(value);
        let (data_type, worded) = match is_text(metric) {
            true => (DataType::String, metric::Value::StringValue(numbered_text(value))),
            false => (DataType::Int64, metric::Value::LongValue(value as u64)),
        };
        Metric {
            name: has_name.then(|| name(metric)),
            alias: self.alias(metric).filter(|_| has_alias),
            timestamp: Some(self.millis),
            datatype: has_name.then_some(data_type as u32),
            value: Some(worded),
            ..Metric::default()
        }
    }

    /// Alias of a metric, or with [`PER_DEVICE`] as its place of the one without a tag.
    fn alias_in(&self, device: usize, place: usize) -> Option<u64> {
        let Numbering { is_per_device, turn, leaves_out_zero } = self.numbering;
        let count = PER_DEVICE as u64 + 1;
        let first = if is_per_device { 0 } else { device as u64 * count };
        let alias = first + (place as u64 + turn) % count;
        (alias > 0 || !leaves_out_zero).then_some(alias)
    }

    fn alias(&self, metric: usize) -> Option<u64> {
        self.alias_in(metric / PER_DEVICE, metric % PER_DEVICE)
    }

    fn untagged(&mut self, device: usize, has_name: bool) -> Metric {
        Metric {
            name: has_name.then(|| UNTAGGED.into()),
            alias: self.alias_in(device, PER_DEVICE),
            timestamp: Some(self.millis),
            datatype: has_name.then_some(DataType::Int64 as u32),
            value: Some(metric::Value::LongValue(1)),
            ..Metric::default()
        }
    }

    /// Creates a message with the next sequence number.
    fn message(&mut self, kind: &str, device: usize, metrics: Vec<Metric>) -> Outgoing {
        let is_death = kind == "NDEATH";
        let sequence = (!is_death).then_some(self.sequence);
        if !is_death {
            self.sequence = self.sequence.wrapping_add(1);
        }
        let tail = DEVICES[device].map(|device| format!("/{device}")).unwrap_or_default();
        let payload = Payload {
            timestamp: Some(self.millis),
            metrics,
            seq: sequence.map(u64::from),
            ..Payload::default()
        };
        let (topic, payload) = (format!("spBv1.0/g/{kind}/e{tail}"), payload.encode_to_vec());
        Outgoing { topic, payload, sequence, is_readable: true }
    }

    fn birth_metrics(&mut self, device: usize) -> Vec<Metric> {
        let first = device * PER_DEVICE;
        let mut metrics: Vec<_> =
            (first..first + PER_DEVICE).map(|index| self.metric(index, true, true)).collect();
        metrics.push(self.untagged(device, true));
        if device == 0 {
            metrics.push(bd_seq(self.bd_seq));
        }
        metrics
    }

    /// NBIRTH and DBIRTHs, of which none, one or the first ones are lost or spoiled.
    fn be_born(&mut self, is_clean: bool) {
        self.sequence = 0;
        self.numbering = Numbering {
            is_per_device: self.rng.bool(),
            turn: self.rng.u64(0..4),
            leaves_out_zero: self.rng.u8(..) < 40 && !is_clean,
        };
        self.is_alive = true;
        self.sent.clear();
        for device in 0..DEVICES.len() {
            let metrics = self.birth_metrics(device);
            let kind = if device == 0 { "NBIRTH" } else { "DBIRTH" };
            let message = self.message(kind, device, metrics);
            match self.rng.u8(0..20) {
                0 if !is_clean => self.lose(),
                1 if !is_clean => self.deliver_cut(message),
                _ => self.deliver(message),
            }
        }
    }

    fn bear_anew(&mut self) {
        self.bd_seq += 1;
        self.be_born(false);
    }

    /// Data of a device: some of its metrics, each by name or alias.
    fn data_metrics(&mut self, device: usize) -> Vec<Metric> {
        let first = device * PER_DEVICE;
        let mut metrics = Vec::new();
        for metric in first..first + PER_DEVICE {
            if self.rng.bool() {
                let by_name = self.rng.u8(..) < 60;
                metrics.push(self.metric(metric, by_name, !by_name));
            }
        }
        if self.rng.bool() {
            metrics.push(self.untagged(device, false));
        }
        metrics
    }

    fn data(&mut self, device: usize, metrics: Vec<Metric>) -> Outgoing {
        self.message(if device == 0 { "NDATA" } else { "DDATA" }, device, metrics)
    }

    fn lose(&mut self) {
        self.is_excused = true;
        self.lost += 1;
    }

    fn deliver_cut(&mut self, mut message: Outgoing) {
        // A cut between two fields leaves a payload that is whole, and a number that is missing.
        let kept = self.rng.usize(..message.payload.len());
        message.payload.truncate(kept);
        let head = crate::sparkplug::payload::Payload::parse(&message.payload);
        message.is_readable = head.is_ok();
        if let Ok(payload) = head {
            message.sequence = payload.head.sequence.and_then(|number| u8::try_from(number).ok());
        }
        self.deliver(message);
    }

    /// Reports whether a loss before this message is undetectable. The numbers began anew with a
    /// lost birth, and the message by chance has the due number.
    fn hides_loss(&self, message: &Outgoing) -> bool {
        let has_due_number = self.expected.is_some() && message.sequence == self.expected;
        message.is_readable && message.is_numbered() && self.is_excused && has_due_number
    }

    /// Brings a message, and judges all that is shown. One that hides a loss is lost as well.
    fn deliver(&mut self, message: Outgoing) {
        let is_node_birth = message.topic.contains("NBIRTH");
        let is_node_death = message.topic.contains("NDEATH");
        if self.hides_loss(&message) {
            return self.lose();
        }
        if message.is_readable && message.is_numbered() {
            let behind = self.expected.zip(message.sequence);
            if behind.is_none_or(|(due, found)| found.wrapping_sub(due) < 128) {
                self.expected = message.sequence.or(self.expected).map(|n| n.wrapping_add(1));
            }
            (self.is_excused, self.lost) = (false, 0);
        } else if is_node_birth && message.is_readable && message.sequence.is_some() {
            self.expected = message.sequence.map(|number| number.wrapping_add(1));
            (self.is_excused, self.lost) = (false, 0);
        } else if is_node_birth {
            self.expected = None;
            (self.is_excused, self.lost) = (false, 0);
        } else if !is_node_death {
            self.expected = self.expected.map(|number| number.wrapping_add(1));
        }
        self.client.publish(&message.topic, &message.payload, false);
        if message.is_numbered() {
            self.sent.truncate(MAX_SENT - 1);
            self.sent.push_front(message);
        }
        self.check();
    }

    fn step(&mut self) {
        if self.lost >= MAX_LOST {
            return self.bear_anew();
        }
        let mut kind = self.rng.u8(0..KINDS);
        // A node that is silent after its death is of no more interest.
        if !self.is_alive && kind > 1 {
            kind = self.rng.u8(0..8);
        }
        self.kinds[usize::from(kind)] += 1;
        let device = self.rng.usize(..DEVICES.len());
        let first = device * PER_DEVICE;
        match kind {
            0 if self.rng.u8(0..4) == 0 => self.bear_anew(),
            // A rebirth: the same life.
            1 if self.is_alive && self.rng.bool() => self.be_born(false),
            2 => {
                let is_of_old = self.rng.bool();
                let of = self.bd_seq.wrapping_sub(u64::from(is_of_old) * self.rng.u64(1..100));
                let death = self.message("NDEATH", 0, vec![bd_seq(of)]);
                self.is_alive &= is_of_old;
                self.deliver(death);
                let is_any_good = self.client.shown.iter().any(|shown| shown.is_good());
                assert!(self.is_alive || !is_any_good, "{:?}", self.client.shown);
            }
            3 if device > 0 => {
                let is_readable = self.rng.bool();
                let mut death = self.message("DDEATH", device, Vec::new());
                if !is_readable {
                    death.payload = vec![0xFF; 3];
                }
                death.is_readable = is_readable;
                let hides_loss = self.hides_loss(&death);
                self.deliver(death);
                let shown = &self.client.shown[first..first + PER_DEVICE];
                let is_any_good = shown.iter().any(|shown| shown.is_good());
                // One that hides a loss never came.
                assert!(hides_loss || !is_any_good, "{shown:?}");
            }
            4 if device > 0 => {
                let metrics = self.birth_metrics(device);
                let birth = self.message("DBIRTH", device, metrics);
                self.deliver(birth);
            }
            5 => {
                let metrics = self.data_metrics(device);
                self.data(device, metrics);
                self.lose();
            }
            6 => {
                let metrics = self.data_metrics(device);
                let message = self.data(device, metrics);
                self.deliver_cut(message);
            }
            // Longer than a payload may be, by a byte or many; and just as long.
            7 | 8 => {
                let metrics = self.data_metrics(device);
                let message = self.data(device, metrics);
                let is_too_long = kind == 7;
                let over = if self.rng.bool() { 1 } else { self.rng.usize(1..100_000) };
                let bytes = MAX_PAYLOAD + if is_too_long { over } else { 0 };
                self.deliver(padded(message, bytes, !is_too_long));
            }
            // An alias that no birth told.
            9 => {
                let mut metrics = self.data_metrics(device);
                let mut unknown = self.metric(first, false, false);
                unknown.alias = Some(1_000_000);
                let at = self.rng.usize(..=metrics.len());
                metrics.insert(at, unknown);
                let message = self.data(device, metrics);
                self.deliver(message);
            }
            // Neither name nor alias.
            10 => {
                let metrics = vec![self.metric(first, false, false)];
                let message = self.data(device, metrics);
                self.deliver(message);
            }
            // A name that is not UTF-8, of the length of one that is.
            11 => {
                let has_alias = self.rng.bool();
                let metrics = vec![self.metric(first, true, has_alias)];
                let mut message = self.data(device, metrics);
                let name = name(first);
                let at = message.payload.windows(name.len()).position(|w| w == name.as_bytes());
                message.payload[at.unwrap()] = 0xFF;
                self.deliver(message);
            }
            // A metric beyond its limit, by name or by alias: of a tag, so that it is bad.
            12 => {
                let by_name = self.rng.bool();
                let mut metric = self.metric(first, by_name, !by_name);
                metric.metadata = Some(MetaData {
                    description: Some("x".repeat(crate::sparkplug::payload::MAX_METRIC_BYTES)),
                    ..MetaData::default()
                });
                let message = self.data(device, vec![metric]);
                self.deliver(message);
            }
            // An alias of another device, or a name and the alias of another metric.
            13 => {
                let has_name = self.rng.bool();
                let mut metric = self.metric(first, has_name, false);
                let other =
                    if metric.name.is_some() { first + 1 } else { (first + PER_DEVICE) % METRICS };
                metric.alias = self.alias(other);
                if metric.name.is_none() && self.numbering.is_per_device {
                    // Nothing tells that one from its own.
                    metric.alias = None;
                }
                let message = self.data(device, vec![metric]);
                self.deliver(message);
            }
            // One alias for two metrics of a device.
            14 if device > 0 => {
                let mut metrics = self.birth_metrics(device);
                let (one, two) = (self.rng.usize(..metrics.len()), self.rng.usize(..metrics.len()));
                metrics[one].alias = metrics[two].alias;
                let birth = self.message("DBIRTH", device, metrics);
                self.deliver(birth);
                // The source goes on with the alias that it meant; another birth mends it.
                let metrics = self.data_metrics(device);
                let message = self.data(device, metrics);
                self.deliver(message);
                self.be_born(true);
            }
            // Of another type than its birth told, or none that a tag can hold.
            15 => {
                let number = first + self.rng.usize(..PER_DEVICE);
                let mut metric = self.metric(number, true, true);
                match (self.rng.u8(0..5), &mut metric.value) {
                    // A text that is cut.
                    (0, Some(metric::Value::StringValue(text))) => text.push_str(&"x".repeat(300)),
                    (0 | 1, _) => metric.datatype = Some(DataType::Int16 as u32),
                    (2, _) => metric.datatype = Some(999),
                    (3, _) => metric.value = Some(metric::Value::BytesValue(vec![1])),
                    _ => metric.value = None,
                }
                let message = self.data(device, vec![metric]);
                self.deliver(message);
            }
            16 => {
                let mut metric = self.metric(first, false, true);
                metric.is_null = Some(true);
                let message = self.data(device, vec![metric]);
                self.deliver(message);
            }
            // A value of the past: the newest one stays what it is.
            17 => {
                let truth = self.truth[first];
                let mut metric = self.metric(first, true, false);
                metric.timestamp = Some(self.millis - 50_000_000);
                metric.is_historical = Some(true);
                self.truth[first] = truth;
                let message = self.data(device, vec![metric]);
                self.deliver(message);
            }
            // Repeated, or overtaken by the next.
            18 => {
                let index = self.rng.usize(..MAX_SENT);
                let is_near = |message: &Outgoing| {
                    let behind = self.expected.zip(message.sequence);
                    behind.is_some_and(|(due, found)| due.wrapping_sub(found) < 128)
                };
                let repeated = self.sent.get(index % self.sent.len().max(1)).cloned();
                if let Some(repeated) = repeated.filter(is_near) {
                    self.deliver(repeated);
                }
            }
            19 => {
                let metrics = [self.data_metrics(device), self.data_metrics(device)];
                let [early, late] = metrics.map(|metrics| self.data(device, metrics));
                self.is_excused = true;
                self.deliver(late);
                self.deliver(early);
            }
            // Messages of no kind.
            20 => {
                let topic =
                    *self.rng.choice(&["DDATA/e", "NDATA/e/d1", "NBIRTH/e/d1/x", "X/e"]).unwrap();
                let topic = format!("spBv1.0/g/{topic}");
                let payload = Payload::default().encode_to_vec();
                self.client.publish(&topic, &payload, false);
                assert!(self.client.shown.iter().all(|shown| !shown.is_good()), "{topic}");
            }
            // What is of others: commands, the state of a host, a store of the broker.
            21 => {
                let topic = *self.rng.choice(&["spBv1.0/g/NCMD/e", "spBv1.0/STATE/h"]).unwrap();
                let before = self.client.shown.clone();
                self.client.publish(topic, b"{\"online\":true}", false);
                self.client.publish("spBv1.0/g/NDATA/e", b"old", true);
                assert_eq!(self.client.shown, before);
            }
            _ => {
                let metrics = self.data_metrics(device);
                let message = self.data(device, metrics);
                self.deliver(message);
            }
        }
    }

    fn check(&self) {
        for (metric, shown) in self.client.shown.iter().enumerate() {
            let truth = self.truth[metric];
            let told =
                || format!("metric {metric}: {shown:?}, truth {truth:?}, {:?}", self.numbering);
            if let Some(value) = shown.value {
                assert_eq!(value / PER_METRIC, metric as i64 + 1, "another's value: {}", told());
            }
            if shown.is_good() && !self.is_excused {
                assert_eq!(shown.value, truth, "an old value: {}", told());
            }
        }
    }
}

/// Reports whether a metric is a text: one of each device is.
fn is_text(metric: usize) -> bool {
    metric % PER_DEVICE == 1
}

fn name(metric: usize) -> String {
    format!("metric/{metric}")
}

fn bd_seq(life: u64) -> Metric {
    Metric {
        name: Some("bdSeq".into()),
        datatype: Some(DataType::Int64 as u32),
        value: Some(metric::Value::LongValue(life)),
        ..Metric::default()
    }
}

/// Pads a message to a length by a meaningless body.
fn padded(mut message: Outgoing, bytes: usize, is_readable: bool) -> Outgoing {
    // Field 5, a length of two digits at least, and zeros.
    let body = bytes - message.payload.len();
    let digits = if body < 16_384 + 3 { 2 } else { 3 };
    let length = body - 1 - digits;
    message.payload.push(0x2A);
    for digit in 0..digits {
        let bits = (length >> (7 * digit) & 0x7F) as u8;
        message.payload.push(if digit + 1 < digits { bits | 0x80 } else { bits });
    }
    message.payload.resize(bytes, 0);
    message.is_readable = is_readable;
    message
}

#[test]
fn no_metric_is_good_that_is_wrong_or_old() {
    for (seed, version) in [(1, Version::V4), (2, Version::V5), (3, Version::V4)] {
        let mut matrix = Matrix::new(seed, version);
        let mut goods = 0;
        for step in 0..steps() {
            matrix.step();
            goods += matrix.client.shown.iter().filter(|shown| shown.is_good()).count() as u64;
            // A birth that comes whole brings all of it back.
            if step % 50 == 49 {
                matrix.bd_seq += 1;
                matrix.be_born(true);
                let shown = &matrix.client.shown;
                assert!(shown.iter().all(|shown| shown.is_good()), "step {step}: {shown:?}");
            }
        }
        assert!(matrix.kinds.iter().all(|count| *count > steps() / 200), "{:?}", matrix.kinds);
        assert!(goods > steps() * METRICS as u64 / 10, "{goods} good in {} steps", steps());
    }
}
