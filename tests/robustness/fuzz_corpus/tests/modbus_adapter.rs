//! Fuzzing of the Modbus adapter: any addresses are refused or read by requests that the protocol
//! allows, each tag once, whatever the device answers. The simulated device serves the values of
//! its signals, and a mark on transaction numbers can be removed again.

use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::simulation::{Behavior, FaultPlan, Signal, SignalShape};
use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{Sample, SimulatedTag, Simulation, TagSpec, Value, ValueKind};
use modbus_adapter::Settings;
use modbus_adapter::probe::{Cells, Device, Request, mark, poll};
use serde_json::{Value as Json, json};

/// Greatest number of cells in one request (Modbus Application Protocol V1.1b3, 6.1 to 6.4).
const MAX_REGISTERS: u16 = 125;
const MAX_BITS: u16 = 2000;
const MAX_TAGS: usize = 64;
/// Number of bytes that encode a tag.
const TAG_BYTES: usize = 6;
/// Greatest number of answers that may be late.
const MAX_UNANSWERED: usize = 8;
const TABLES: [&str; 4] = ["coil", "discrete", "holding", "input"];
const FORMATS: [&str; 8] = ["u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"];
const KINDS: [ValueKind; 4] =
    [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint];
const SCALES: [f64; 4] = [1.0, 0.1, -2.5, 1e6];

/// Runs one input. Its first byte selects the form of the rest: a stream, an address as text and
/// the device's answers, or tags and the device's answers.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    match kind & 3 {
        0 => marks_come_off(rest, kind >> 2),
        1 => {
            let end = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            let (text, answers) = rest.split_at(end);
            let Ok(address) = serde_json::from_slice::<Json>(text) else { return false };
            let tags: Vec<_> = (0..)
                .zip(KINDS)
                .map(|(tag, kind)| tag_spec(tag, "a", kind, address.clone()))
                .collect();
            tags.iter().filter(|tag| is_read(std::slice::from_ref(*tag), answers)).count() > 0
        }
        _ => {
            let count = usize::from(kind >> 2).min(rest.len() / TAG_BYTES).min(MAX_TAGS);
            let (tags, answers) = rest.split_at(count * TAG_BYTES);
            let tags: Vec<_> = (0..).zip(tags.chunks(TAG_BYTES)).map(tag).collect();
            is_simulated(&tags, answers.len());
            is_read(&tags, answers)
        }
    }
}

fn marks_come_off(bytes: &[u8], piece: u8) -> bool {
    let Some((&[high, low], stream)) = bytes.split_first_chunk() else { return false };
    let key = u16::from_be_bytes([high, low]);
    let (mut whole, mut cut) = (stream.to_vec(), stream.to_vec());
    mark(&mut whole, key, stream.len());
    mark(&mut cut, key, piece.into());
    assert_eq!(whole, cut, "however it is cut");
    mark(&mut cut, key, piece.into());
    assert_eq!(cut, stream);
    stream.len() > TAG_BYTES
}

/// Reports whether the plugin would read these tags, from a device with arbitrary answers.
fn is_read(tags: &[TagSpec], answers: &[u8]) -> bool {
    let mut answers = answers.iter().copied().cycle();
    let mut next = || answers.next().unwrap_or_default();
    let mut unanswered = Vec::new();
    let samples = poll(settings(), tags, |request| {
        check(request);
        let other = request.unmistakable(&unanswered);
        check(&other);
        if unanswered.len() < MAX_UNANSWERED {
            unanswered.push(other);
        }
        let length = next();
        if length & 7 == 1 {
            return None;
        }
        // Some answers are too short.
        let count = if length & 7 == 2 { u16::from(length >> 3) } else { request.count() };
        Some(if request.is_bits() == (length & 7 != 3) {
            Cells::Bits((0..count).map(|_| next() & 1 == 1).collect())
        } else {
            Cells::Registers((0..count).map(|_| u16::from_be_bytes([next(), next()])).collect())
        })
    });
    let Ok(samples) = samples else { return false };
    check_samples(&samples, tags);
    true
}

fn check(request: &Request) {
    let most = if request.is_bits() { MAX_BITS } else { MAX_REGISTERS };
    assert!((1..=most).contains(&request.count()), "{request:?}");
    assert!(u32::from(request.first()) + u32::from(request.count()) <= 1 << 16, "{request:?}");
}

/// Checks that there is one sample a tag, of the tag's kind.
fn check_samples(samples: &[Sample], tags: &[TagSpec]) {
    let mut of_tags: Vec<_> = samples.iter().map(|sample| sample.tag).collect();
    of_tags.sort_unstable();
    assert!(of_tags.into_iter().eq(tags.iter().map(|tag| tag.tag)), "one sample a tag");
    for sample in samples {
        let kind = tags.iter().find(|tag| tag.tag == sample.tag).map(|tag| tag.kind);
        match &sample.value {
            None => assert!(!sample.quality.is_good()),
            Some(value) => assert_eq!(Some(value.kind()), kind),
        }
    }
}

/// Checks that a device that simulates these tags is read as its signals are.
fn is_simulated(tags: &[TagSpec], base: usize) {
    let behaviour =
        Behavior::new(SignalShape::Constant, (base % 4) as f64, 0.0, Duration::from_secs(1));
    let behaviour = behaviour.expect("in range");
    let simulated = |spec: &TagSpec| SimulatedTag {
        spec: spec.clone(),
        signal: Signal::new(1, &spec.id, spec.kind, behaviour).expect("it is constant"),
    };
    let simulation = Simulation {
        tags: tags.iter().map(simulated).collect(),
        faults: FaultPlan::none(),
        update: Duration::from_secs(1),
        seed: 1,
    };
    let Ok(device) = Device::new(settings(), &simulation) else { return };
    let time = UNIX_EPOCH + Duration::from_secs(1_795_305_600);
    let samples = poll(settings(), tags, |request| {
        let cells = device.read(request, time);
        assert!(cells.is_some(), "the device has no cells for {request:?}");
        cells
    });
    let samples = samples.expect("the device took the addresses");
    check_samples(&samples, tags);
    // Where tags share cells the first one's value is there, whatever it is to the others.
    if let ([tag], [sample]) = (&simulation.tags[..], &samples[..]) {
        let value = sample.value.as_ref().expect("the device has its cells");
        let wanted = tag.signal.at(time);
        // The least step of a whole number on the wire, by its scale.
        let step = tag.spec.address["scale"].as_f64().unwrap_or(1.0).abs() / 2.0;
        match (value, &wanted) {
            (Value::F64(value), Value::F64(wanted)) => {
                assert!((value - wanted).abs() <= step + 1e-6, "{value} for {wanted}");
            }
            _ => assert_eq!(value, &wanted),
        }
    }
}

/// Decodes a tag from [`TAG_BYTES`] bytes; its fields may still not fit each other.
fn tag((number, bytes): (u32, &[u8])) -> TagSpec {
    let [shape, high, low, format, bit, scale] = bytes.try_into().expect("so many bytes");
    let kind = KINDS[usize::from(shape & 3)];
    let table = TABLES[usize::from(shape >> 2 & 3)];
    let mut address = json!({ "table": table, "register": u16::from_be_bytes([high, low]) });
    let is_number = matches!(kind, ValueKind::F64 | ValueKind::I64);
    if shape & 0x10 != 0 || is_number {
        address["type"] = json!(FORMATS[usize::from(format & 7)]);
    }
    if format & 8 != 0 && is_number {
        address["word_order"] = json!("little");
    }
    match kind {
        ValueKind::Bool if shape & 8 != 0 => address["bit"] = json!(bit & 0x1F),
        ValueKind::DoublePoint if shape & 8 != 0 => address["bits"] = json!(bit & 0x0F),
        ValueKind::F64 if scale & 1 != 0 => {
            address["scale"] = json!(SCALES[usize::from(scale >> 1 & 3)]);
        }
        _ => {}
    }
    if shape & 0x20 != 0 {
        address["unit"] = json!(bit >> 5);
    }
    if shape & 0x40 != 0 {
        address["poll_group"] = json!("slow");
    }
    tag_spec(number, &format!("tag{number}"), kind, address)
}

fn settings() -> Settings {
    let settings =
        json!({ "host": "127.0.0.1", "poll_groups": { "slow": { "poll_seconds": 10 } } });
    serde_json::from_value(settings).expect("these settings are good")
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("modbus_adapter", fuzz_one);
}
