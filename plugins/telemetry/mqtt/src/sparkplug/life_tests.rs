//! An edge node that lives, dies, gives its aliases to other metrics and loses messages at
//! will: no value is ever on a wrong tag, none is good after a loss that shows, and a birth
//! brings all of them back.

use std::time::Instant;

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Value, ValueKind};
use proptest::prelude::*;
use serde_json::json;
use srad_types::payload::{DataType, Message, Metric, Payload, metric};

use crate::points;
use crate::session::Event;
use crate::settings::Settings;
use crate::subscriber::{Plan, Subscriber};

/// Metrics: the first is the node's, the others its device's. A value has its metric in its
/// hundreds of thousands, so that one on a wrong tag shows.
const METRICS: usize = 3;
const PER_METRIC: i64 = 100_000;

#[derive(Clone, Debug)]
enum Act {
    /// NBIRTH and DBIRTH; aliases are turned by so much. Only the first can be lost: were
    /// both, and the next number the same by chance, no receiver could tell.
    Birth {
        turn: usize,
    },
    Data {
        metric: usize,
        by_name: bool,
    },
    Death {
        is_old: bool,
    },
    DeviceDeath,
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        2 => (0..METRICS).prop_map(|turn| Act::Birth { turn }),
        8 => (0..METRICS, any::<bool>())
            .prop_map(|(metric, by_name)| Act::Data { metric, by_name }),
        1 => any::<bool>().prop_map(|is_old| Act::Death { is_old }),
        1 => Just(Act::DeviceDeath),
    ]
}

/// Simulated edge node, and the plugin's view of it.
struct World {
    subscriber: Subscriber,
    recorder: Recorder,
    now: Instant,
    life: u64,
    sequence: u64,
    turn: usize,
    count: i64,
    is_lost: bool,
}

fn device_of(metric: usize) -> Option<&'static str> {
    (metric > 0).then_some("d")
}

impl World {
    fn new() -> Self {
        let address = |index: usize| {
            let metric = format!("m{index}");
            match device_of(index) {
                Some(device) => {
                    json!({"group": "g", "edge_node": "e", "device": device, "metric": metric})
                }
                None => json!({"group": "g", "edge_node": "e", "metric": metric}),
            }
        };
        let tags: Vec<_> =
            (0..METRICS).map(|m| tag_spec(m as u32, "t", ValueKind::I64, address(m))).collect();
        let settings: Settings = serde_json::from_value(json!({"host": "a"})).unwrap();
        let config = settings.parse().unwrap();
        let plan = Plan::new(points::parse(tags.iter()).unwrap(), &config).unwrap();
        let (recorder, now) = (Recorder::new(), Instant::now());
        let mut subscriber = Subscriber::new(plan, &config, recorder.sink(), host());
        subscriber.note(Event::Connected, now);
        let (life, sequence, turn, count, is_lost) = (1, 0, 0, 0, false);
        Self { subscriber, recorder, now, life, sequence, turn, count, is_lost }
    }

    fn send(&mut self, kind: &str, device: Option<&str>, metrics: Vec<Metric>) {
        let seq = (kind != "NDEATH").then_some(self.sequence);
        self.sequence = (self.sequence + u64::from(seq.is_some())) % 256;
        if self.is_lost {
            return;
        }
        let timestamp = Some(1_700_000_000_000);
        let payload = Payload { timestamp, metrics, seq, ..Payload::default() }.encode_to_vec();
        let tail = device.map(|device| format!("/{device}")).unwrap_or_default();
        let topic = format!("spBv1.0/g/{kind}/e{tail}");
        let (topic, payload) = (topic.as_bytes(), &payload[..]);
        self.subscriber.note(Event::Message { topic, payload, is_retained: false }, self.now);
        self.subscriber.flush();
    }

    fn metric(&mut self, index: usize, has_name: bool, has_alias: bool) -> Metric {
        self.count += 1;
        let value = index as i64 * PER_METRIC + self.count;
        Metric {
            name: has_name.then(|| format!("m{index}")),
            alias: has_alias.then_some(((index + self.turn) % METRICS) as u64),
            datatype: has_name.then_some(DataType::Int64 as u32),
            value: Some(metric::Value::LongValue(value as u64)),
            ..Metric::default()
        }
    }

    fn act(&mut self, act: &Act) {
        match act {
            Act::Birth { turn } => {
                (self.life, self.sequence, self.turn) = (self.life + 1, 0, *turn);
                let of_node = vec![self.metric(0, true, true), bd_seq(self.life)];
                self.send("NBIRTH", None, of_node);
                self.is_lost = false;
                let of_device = (1..METRICS).map(|index| self.metric(index, true, true)).collect();
                self.send("DBIRTH", Some("d"), of_device);
            }
            Act::Data { metric, by_name } => {
                let device = device_of(*metric);
                let kind = if device.is_some() { "DDATA" } else { "NDATA" };
                let message = vec![self.metric(*metric, *by_name, !by_name)];
                self.send(kind, device, message);
            }
            Act::Death { is_old } => {
                self.send("NDEATH", None, vec![bd_seq(self.life - u64::from(*is_old))]);
            }
            Act::DeviceDeath => self.send("DDEATH", Some("d"), Vec::new()),
        }
    }

    fn values(&self) -> [Option<(i64, bool)>; METRICS] {
        std::array::from_fn(|metric| {
            let sample = self.recorder.latest(metric as u32)?;
            match sample.value? {
                Value::I64(value) => Some((value, sample.quality.is_good())),
                _ => None,
            }
        })
    }

    fn goods(&self) -> usize {
        self.values().into_iter().flatten().filter(|(_, is_good)| *is_good).count()
    }
}

fn bd_seq(life: u64) -> Metric {
    Metric {
        name: Some("bdSeq".into()),
        datatype: Some(DataType::Int64 as u32),
        value: Some(metric::Value::LongValue(life)),
        ..Metric::default()
    }
}

proptest! {
    #[test]
    fn no_value_is_on_a_wrong_tag_and_a_birth_brings_all(
        acts in prop::collection::vec((act(), prop::bool::weighted(0.15)), 0..60),
        turn in 0..METRICS,
    ) {
        let mut world = World::new();
        for (act, is_lost) in &acts {
            world.is_lost = *is_lost;
            world.act(act);
            for (metric, value) in world.values().into_iter().enumerate() {
                let of = value.map(|(value, _)| value / PER_METRIC);
                prop_assert!(of.is_none_or(|of| of == metric as i64), "{metric}: {value:?}");
            }
        }
        world.is_lost = false;
        world.act(&Act::Birth { turn });
        prop_assert_eq!(world.goods(), METRICS);
        for metric in 0..METRICS {
            world.act(&Act::Data { metric, by_name: false });
            let newest = metric as i64 * PER_METRIC + world.count;
            prop_assert_eq!(world.values()[metric], Some((newest, true)));
        }
        // One lost message: the next shows it, whichever it is.
        world.is_lost = true;
        world.act(&Act::Data { metric: 1, by_name: false });
        world.is_lost = false;
        world.act(&Act::Data { metric: 2, by_name: false });
        prop_assert_eq!(world.goods(), 0);
        world.act(&Act::Data { metric: 2, by_name: true });
        prop_assert_eq!(world.goods(), 1);
        world.act(&Act::Death { is_old: false });
        prop_assert_eq!(world.goods(), 0);
    }
}
