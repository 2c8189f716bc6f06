//! Fuzzing of the simulated IEC 60870-5-104 station by arbitrary client bytes. The station answers
//! with whole frames in order, within its window and with values of its own objects alone, or
//! closes the connection.

use std::sync::OnceLock;
use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::simulation::{Behavior, FaultPlan, Signal, SignalShape};
use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{SimulatedTag, Simulation, ValueKind};
use iec104::codec::{Asdu, Body, Frame, Function, Sequence, split_frame};
use iec104::probe::StationProbe;
use serde_json::{Value, json};

const K: u16 = 12;
/// Common addresses and objects of the station.
const STATIONS: [u16; 2] = [1, 0x0203];
const LAST_OBJECT: u32 = 80;
/// Start of the simulation, seconds since 1970: 2026-11-22.
const STARTS_SECONDS: u64 = 1_795_305_600;

/// Client side of the connection: sequence numbers sent and received.
#[derive(Default)]
struct Client {
    sent: u16,
    received: u16,
    units: usize,
}

/// Runs one input: a list of steps, each an operation, the number of bytes after it, and these.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let mut station = station().connect(UNIX_EPOCH + Duration::from_secs(STARTS_SECONDS));
    let mut client = Client::default();
    let mut rest = bytes;
    while let [operation, length, after @ ..] = rest {
        let (part, left) = after.split_at(after.len().min(usize::from(*length)));
        rest = left;
        let outcome = match operation % 6 {
            0 => station.receive(part),
            1 => station.receive(&client.request(part)),
            2 => station.receive(&client.acknowledgement()),
            3 => station.receive(&frame(Frame::Unnumbered(Function::StartAct))),
            4 => station.receive(&frame(Frame::Unnumbered(Function::StopAct))),
            _ => station.pass(Duration::from_millis(u64::from(*length) * 200)),
        };
        let (bytes, count) = station.take_output();
        client.take(&bytes, count);
        if outcome.is_err() {
            return false;
        }
    }
    client.units > 0
}

impl Client {
    /// Encodes an information frame with the sequence numbers that are due.
    fn request(&mut self, asdu: &[u8]) -> Vec<u8> {
        let (send, receive) = (Sequence::new(self.sent), Sequence::new(self.received));
        self.sent += 1;
        frame(Frame::Information { send, receive, asdu })
    }

    fn acknowledgement(&self) -> Vec<u8> {
        frame(Frame::Supervisory(Sequence::new(self.received)))
    }

    /// Checks the frames that the station sent.
    fn take(&mut self, mut bytes: &[u8], count: u64) {
        let mut units = 0;
        while !bytes.is_empty() {
            let split = split_frame(bytes).expect("it sends frames");
            let (frame, taken) = split.expect("it sends whole frames");
            bytes = &bytes[taken..];
            if let Frame::Information { send, asdu, .. } = frame {
                assert_eq!(send.number(), self.received, "frames in order");
                self.received += 1;
                units += 1;
                read(asdu);
            }
        }
        assert_eq!(units, count, "data units counted");
        self.units += units as usize;
        assert!(units <= u64::from(K), "{units} units at once");
    }
}

fn read(asdu: &[u8]) {
    let asdu = Asdu::parse(asdu).expect("it sends data units");
    let Body::Objects(objects) = asdu.body else { return };
    if asdu.header.is_negative {
        return;
    }
    assert!(STATIONS.contains(&asdu.header.common_address), "{:?}", asdu.header);
    for object in objects {
        assert!((1..=LAST_OBJECT).contains(&object.address), "object {}", object.address);
        assert!(!object.flags.is_invalid());
    }
}

fn frame(frame: Frame<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    frame.write(&mut bytes);
    bytes
}

fn station() -> &'static StationProbe {
    static STATION: OnceLock<StationProbe> = OnceLock::new();
    STATION.get_or_init(|| {
        let settings = json!({ "host": "127.0.0.1", "k": K, "w": 8 });
        let settings = serde_json::from_value(settings).expect("these settings are good");
        StationProbe::new(settings, &simulation()).expect("they fit each other")
    })
}

/// Returns objects of all kinds in both stations, some of which change.
fn simulation() -> Simulation {
    let kinds = [
        (ValueKind::F64, json!({})),
        (ValueKind::Bool, json!({})),
        (ValueKind::DoublePoint, json!({})),
        (ValueKind::F64, json!({ "type": "step" })),
        (ValueKind::I64, json!({ "type": "counter" })),
        (ValueKind::I64, json!({ "type": "bitstring" })),
        (ValueKind::I64, json!({ "type": "measured" })),
        (ValueKind::Bool, json!({ "type": "bitstring", "bit": 3 })),
    ];
    let tags = STATIONS.into_iter().flat_map(|station| {
        let kinds = kinds.clone();
        (1..=LAST_OBJECT).map(move |object| {
            let (kind, address) = &kinds[object as usize % kinds.len()];
            let tag = u32::from(station) * 1000 + object;
            simulated(tag, *kind, address.clone(), station, object)
        })
    });
    Simulation {
        tags: tags.collect(),
        faults: FaultPlan::none(),
        update: Duration::from_secs(1),
        seed: 1,
    }
}

fn simulated(
    tag: u32,
    kind: ValueKind,
    mut address: Value,
    station: u16,
    object: u32,
) -> SimulatedTag {
    address["ioa"] = json!(object);
    address["common_address"] = json!(station);
    let shape = if object.is_multiple_of(3) { SignalShape::Steps } else { SignalShape::Constant };
    let behaviour = Behavior::new(shape, 7.0, 5.0, Duration::from_secs(1)).expect("in range");
    let id = format!("tag{tag}");
    let signal = Signal::new(1, &id, kind, behaviour).expect("it can move so");
    SimulatedTag { spec: tag_spec(tag, &id, kind, address), signal }
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("iec104_station", fuzz_one);
}
