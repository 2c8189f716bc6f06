//! Message matrix of plain topics: the oracle knows after each message whether its value is
//! to be good.

use std::time::UNIX_EPOCH;

use busbar_plugin_sdk::ValueKind;
use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;

/// Tags: a number as text, three values of one document without a time, the second of them a
/// text, one of a document with a time, and a text.
const TOPICS: [&str; 6] = ["s/text", "s/json", "s/json", "s/json", "s/timed", "s/mode"];
const TEXTS: [usize; 2] = [2, 5];
const TIMED: usize = 4;
const KINDS: u8 = 16;

struct Matrix {
    client: Client,
    rng: Rng,
    count: i64,
    millis: u64,
    is_online: bool,
    /// By tag: the value that is to be good, where one is.
    good: [Option<i64>; TOPICS.len()],
    /// By tag: the newest value that its source sent.
    truth: [Option<i64>; TOPICS.len()],
    /// By kind of message: how often it came.
    kinds: [u64; KINDS as usize],
}

impl Matrix {
    fn new(seed: u64, version: Version) -> Self {
        let addresses = [
            json!({"topic": "s/text"}),
            json!({"topic": "s/json", "pointer": "/a/v"}),
            json!({"topic": "s/json", "pointer": "/m/v"}),
            json!({"topic": "s/json", "pointer": "/b/v", "quality": "/b/q"}),
            json!({"topic": "s/timed", "pointer": "/v", "time": "/ts"}),
            json!({"topic": "s/mode"}),
        ];
        let tag = |(tag, address): (u32, &Json)| {
            let is_text = TEXTS.contains(&(tag as usize));
            let kind = if is_text { ValueKind::Text } else { ValueKind::I64 };
            tag_spec(tag, "t", kind, address.clone())
        };
        let tags: Vec<_> = (0..).zip(&addresses).map(tag).collect();
        let settings =
            json!({"host": "a", "availability": [{"topic": "s/status", "covers": "s/#"}]});
        let mut rng = Rng::with_seed(seed);
        let client = Client::new(settings, &tags, version, rng.fork());
        Self {
            client,
            rng,
            count: 5_000_000_000,
            millis: 1_700_000_000_000,
            is_online: true,
            good: [None; TOPICS.len()],
            truth: [None; TOPICS.len()],
            kinds: [0; KINDS as usize],
        }
    }

    /// A value that no other message has.
    fn value(&mut self) -> i64 {
        self.count += 1;
        self.count
    }

    /// A payload with these values, as the topic has it.
    fn payload(&mut self, topic: &str, values: [i64; 3]) -> String {
        self.millis += 10;
        match topic {
            "s/text" => values[0].to_string(),
            "s/json" => {
                let mode = numbered_text(values[1]);
                json!({"a": {"v": values[0]}, "b": {"v": values[2], "q": "good"}, "m": {"v": mode}})
                    .to_string()
            }
            "s/mode" => numbered_text(values[0]),
            _ => json!({"v": values[0], "ts": self.millis}).to_string(),
        }
    }

    fn step(&mut self) {
        let kind = self.rng.u8(0..KINDS);
        self.kinds[usize::from(kind)] += 1;
        if kind == 0 {
            return self.tell_availability();
        }
        let topic = TOPICS[self.rng.usize(..TOPICS.len())];
        let tags: Vec<usize> = (0..TOPICS.len()).filter(|tag| TOPICS[*tag] == topic).collect();
        let values = [self.value(), self.value(), self.value()];
        let whole = self.payload(topic, values);
        let is_json = matches!(topic, "s/json" | "s/timed");
        let mut is_retained = false;
        // Of the tags, the first of them, or none is good after it.
        let (payload, usable): (Vec<u8>, &[usize]) = match kind {
            // Cut short, or bytes of something else.
            1 if is_json => (whole.as_bytes()[..self.rng.usize(..whole.len())].to_vec(), &[]),
            2 => (vec![b'"', 0xFF, 0xFE, self.rng.u8(..)], &[]),
            3 => (Vec::new(), &[]),
            // A byte more than is taken, and as many as are.
            4 => (pad(&whole, MAX_PAYLOAD + 1), &[]),
            5 => (pad(&whole, MAX_PAYLOAD), &tags),
            6 => (pad(&whole, MAX_PAYLOAD + self.rng.usize(1..400_000)), &[]),
            // A text that is cut, by a byte or many.
            7 if topic == "s/mode" => {
                let bytes = busbar_plugin_sdk::MAX_TEXT_BYTES + self.rng.usize(1..2000);
                (format!("{whole:x<bytes$}").into_bytes(), &[])
            }
            // Of another type, or no number.
            7 => {
                let other =
                    *self.rng.choice(&["NaN", "[1]", "1.5", "\"x\"", "true", "1e999"]).unwrap();
                let text = match topic {
                    "s/text" => other.to_owned(),
                    "s/json" => {
                        let whole = format!("{{\"a\":{{\"v\":{other}}},\"b\":{{\"v\":{other}}}}}");
                        whole.replace("NaN", "\"NaN\"")
                    }
                    _ => format!("{{\"v\":{other},\"ts\":{}}}", self.millis),
                };
                (text.into_bytes(), &[])
            }
            // Nothing at the pointer, of one of three tags at least.
            8 if is_json => (whole.replacen("\"v\"", "\"w\"", 1).into_bytes(), &tags[1..]),
            9 if is_json => (b"{}".to_vec(), &[]),
            10 if is_json => {
                (whole.replace(&values[0].to_string(), "null").into_bytes(), &tags[1..])
            }
            // A quality that nobody explained.
            11 if topic == "s/json" => (whole.replace("good", "fair").into_bytes(), &tags[..2]),
            // Times that are none.
            12 if topic == "s/timed" => {
                let bad = [
                    json!({"v": values[0]}),
                    json!({"v": values[0], "ts": null}),
                    json!({"v": values[0], "ts": "yesterday"}),
                    json!({"v": values[0], "ts": "2023-11-14T22:13:20"}),
                    json!({"v": values[0], "ts": 1e300}),
                    json!({"v": values[0], "ts": -5}),
                    json!({"v": values[0], "ts": self.millis * 1000}),
                    json!({"v": values[0], "ts": self.millis / 1000}),
                    json!({"v": values[0], "ts": self.millis.to_string()}),
                ];
                (self.rng.choice(&bad).unwrap().to_string().into_bytes(), &[])
            }
            // The clock of the source is set back: the newer value counts all the same.
            13 if topic == "s/timed" => {
                self.millis -= self.rng.u64(0..100_000);
                (whole.into_bytes(), &tags)
            }
            14 => {
                is_retained = true;
                // Only a time tells how old a stored value is.
                (whole.into_bytes(), if topic == "s/timed" { &tags } else { &[] })
            }
            _ => (whole.into_bytes(), &tags),
        };
        for (tag, value) in tags.iter().zip(values) {
            self.truth[*tag] = Some(value);
            self.good[*tag] = (usable.contains(tag) && self.is_online).then_some(value);
        }
        let millis = self.millis;
        let timed = self.client.shown[TIMED];
        self.client.publish(topic, &payload, is_retained);
        if is_retained && topic == "s/timed" {
            // A stored value that is older than the one shown does not replace it.
            let stored = Some(UNIX_EPOCH + Duration::from_millis(millis));
            if timed.source_time > stored && timed.source_time.is_some() {
                self.good[TIMED] = None;
                self.truth[TIMED] = timed.value;
            }
        }
        self.check();
    }

    fn tell_availability(&mut self) {
        let states: [&[u8]; 7] =
            [b"online", b"ONLINE", b"Connected", b"OFFLINE", b"rebooting", b"", b"\xFF"];
        let index = self.rng.usize(..states.len() + 1);
        let long = vec![b'x'; MAX_PAYLOAD + 1];
        let state = states.get(index).copied().unwrap_or(&long);
        self.is_online = index < 3;
        if !self.is_online {
            self.good = [None; TOPICS.len()];
        }
        self.client.publish("s/status", state, false);
        self.check();
    }

    fn check(&self) {
        for tag in 0..TOPICS.len() {
            let shown = self.client.shown[tag];
            let told = format!("tag {tag}: {shown:?}, truth {:?}", self.truth[tag]);
            if shown.is_good() {
                assert_eq!(shown.value, self.truth[tag], "{told}");
            }
            if let Some(good) = self.good[tag] {
                assert_eq!((shown.value, shown.quality), (Some(good), Quality::Good), "{told}");
            }
            assert!(self.good[tag].is_some() || !shown.is_good() || tag == TIMED, "{told}");
        }
    }
}

/// A document or text with blanks behind it.
fn pad(text: &str, bytes: usize) -> Vec<u8> {
    let mut padded = text.as_bytes().to_vec();
    padded.resize(bytes, b' ');
    padded
}

#[test]
fn no_plain_value_is_good_that_is_wrong_or_old() {
    for (seed, version) in [(1, Version::V4), (2, Version::V5)] {
        let mut matrix = Matrix::new(seed, version);
        let mut goods = 0;
        for _ in 0..steps() {
            matrix.step();
            goods += matrix.client.shown.iter().filter(|shown| shown.is_good()).count() as u64;
        }
        assert!(matrix.kinds.iter().all(|count| *count > steps() / 32), "{:?}", matrix.kinds);
        assert!(goods > steps() / 4, "{goods} good in {} steps", steps());
    }
}
