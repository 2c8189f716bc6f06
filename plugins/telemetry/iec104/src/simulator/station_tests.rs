use busbar_plugin_sdk::ValueKind;
use busbar_plugin_sdk::simulation::{Behavior, SignalShape};
use serde_json::json;

use super::super::map::tests::{constant, map, moving};
use super::*;
use crate::codec::{Frame, Function, Sequence, split_frame};

const PARAMETERS: Parameters = Parameters {
    k: 4,
    w: 2,
    t1: Duration::from_secs(15),
    t2: Duration::from_secs(10),
    t3: Duration::from_secs(20),
};

/// A client that acknowledges all that comes, at once.
struct Client {
    station: Station,
    times: Times,
    sent: u16,
    received: Sequence,
}

impl Client {
    fn with_tags(
        tags: &[(busbar_plugin_sdk::TagSpec, busbar_plugin_sdk::simulation::Signal)],
    ) -> Self {
        let shared = Arc::new(Shared {
            map: map(tags).unwrap().0,
            zone: Zone::Utc,
            parameters: PARAMETERS,
            has_sent_start: AtomicBool::new(false),
        });
        let time = UNIX_EPOCH + Duration::from_millis(1_700_000_000_123);
        let times = Times { now: Instant::now(), true_time: time, station_time: time };
        let mut client = Self {
            station: Station::new(shared, times.now),
            times,
            sent: 0,
            received: Sequence::default(),
        };
        client.write(Frame::Unnumbered(Function::StartAct));
        client
    }

    fn write(&mut self, frame: Frame<'_>) {
        let mut bytes = Vec::new();
        frame.write(&mut bytes);
        self.station.receive(&bytes, self.times).unwrap();
    }

    fn request(&mut self, asdu: &[u8]) -> Vec<Vec<u8>> {
        let (send, receive) = (Sequence::new(self.sent), self.received);
        self.write(Frame::Information { send, receive, asdu });
        self.sent += 1;
        self.units()
    }

    /// All data units until the station has no more.
    fn units(&mut self) -> Vec<Vec<u8>> {
        let mut units = Vec::new();
        loop {
            let (bytes, count) = self.station.take_output();
            let mut rest = &bytes[..];
            let before = units.len();
            while let Some((frame, taken)) = split_frame(rest).unwrap() {
                if let Frame::Information { send, asdu, .. } = frame {
                    assert_eq!(send, self.received);
                    self.received = send.next();
                    units.push(asdu.to_vec());
                }
                rest = &rest[taken..];
            }
            assert_eq!(units.len() - before, usize::try_from(count).unwrap());
            assert!(units.len() - before <= usize::from(PARAMETERS.k), "more than the window");
            if units.len() == before {
                return units;
            }
            self.write(Frame::Supervisory(self.received));
        }
    }
}

fn objects(unit: &[u8]) -> (u8, Vec<Object>) {
    let asdu = Asdu::parse(unit).unwrap();
    let Body::Objects(objects) = asdu.body else { panic!("{unit:?}") };
    (asdu.header.cause, objects.collect())
}

/// Type and cause, with the bits that say test and negative.
fn heads(units: &[Vec<u8>]) -> Vec<[u8; 2]> {
    units.iter().map(|unit| [unit[0], unit[2]]).collect()
}

fn interrogation(common_address: u8, qoi: u8) -> [u8; 10] {
    [100, 1, 6, 0, common_address, 0, 0, 0, 0, qoi]
}

fn tags() -> Vec<(busbar_plugin_sdk::TagSpec, busbar_plugin_sdk::simulation::Signal)> {
    let mut tags: Vec<_> = (1..=200)
        .map(|ioa| constant(ioa, ValueKind::F64, json!({ "ioa": ioa }), ioa.into()))
        .collect();
    tags.push(constant(300, ValueKind::Bool, json!({"ioa": 300}), 1.0));
    tags.push(constant(301, ValueKind::I64, json!({"ioa": 301, "type": "counter"}), 70.0));
    tags
}

#[test]
fn an_interrogation_gives_everything_once_and_ends() {
    let mut client = Client::with_tags(&tags());
    assert_eq!(client.units(), [initialisation_ended(1)]);
    let units = client.request(&interrogation(1, 20));
    assert_eq!(heads(&units)[0], [100, 7]);
    assert_eq!(heads(&units).last(), Some(&[100, 10]));
    let mut seen = Vec::new();
    for unit in &units[1..units.len() - 1] {
        let (cause, objects) = objects(unit);
        assert_eq!(cause, cause::INTERROGATED);
        seen.extend(objects.into_iter().map(|object| (object.address, object.value)));
    }
    seen.sort_by_key(|(address, _)| *address);
    let mut expected: Vec<_> =
        (1..=200_u16).map(|ioa| (u32::from(ioa), codec::Value::Float(f32::from(ioa)))).collect();
    expected.push((300, codec::Value::Single(true)));
    assert_eq!(seen, expected);
    // Sixteen groups are as much, each with a cause of its own.
    let mut count = 0;
    for group in 21..=36 {
        let units = client.request(&interrogation(1, group));
        for unit in &units[1..units.len() - 1] {
            let (cause, objects) = objects(unit);
            assert_eq!(cause, group);
            count += objects.len();
        }
    }
    assert_eq!(count, 201);
}

#[test]
fn requests_are_answered_as_the_standard_has_it() {
    let mut client = Client::with_tags(&tags());
    client.units();
    let negative = |cause: u8| 0x40 | cause;
    let cases: [(&[u8], &[[u8; 2]]); 13] = [
        // Counters: all, the third group of four, and a request to freeze.
        (&[101, 1, 6, 0, 1, 0, 0, 0, 0, 5], &[[101, 7], [15, 37], [101, 10]]),
        (&[101, 1, 6, 0, 1, 0, 0, 0, 0, 1], &[[101, 7], [101, 10]]),
        (&[101, 1, 6, 0, 1, 0, 0, 0, 0, 0x45], &[[101, negative(7)]]),
        // Read: there, not there.
        (&[102, 1, 5, 0, 1, 0, 7, 0, 0], &[[13, 5]]),
        (&[102, 1, 5, 0, 1, 0, 7, 7, 0], &[[102, negative(47)]]),
        // The clock, tests, and the same as a test.
        (&[103, 1, 6, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 24], &[[103, 7]]),
        (&[104, 1, 6, 0, 1, 0, 0, 0, 0, 0xAA, 0x55], &[[104, 7]]),
        (&[104, 1, 0x86, 0, 1, 0, 0, 0, 0, 0xAA, 0x55], &[[104, 0x87]]),
        // Unknown: type (a command), cause, common address, qualifier.
        (&[45, 1, 6, 0, 1, 0, 1, 0, 0, 1], &[[45, negative(44)]]),
        (&[100, 1, 3, 0, 1, 0, 0, 0, 0, 20], &[[100, negative(45)]]),
        (&[100, 1, 6, 0, 9, 0, 0, 0, 0, 20], &[[100, negative(46)]]),
        (&[100, 1, 6, 0, 1, 0, 0, 0, 0, 99], &[[100, negative(7)]]),
        // Cut short: no answer.
        (&[100, 1, 6], &[]),
    ];
    for (request, expected) in cases {
        assert_eq!(heads(&client.request(request)), expected, "{request:?}");
    }
    // All stations at once: each answers by its own address.
    let units = client.request(&[103, 1, 6, 0, 0xFF, 0xFF, 0, 0, 0, 0, 0, 0, 0, 1, 1, 24]);
    assert_eq!(units[0][4..6], [1, 0]);
}

#[test]
fn changes_come_with_their_value_at_their_time() {
    let behaviour = Behavior::new(SignalShape::Sine, 50.0, 10.0, Duration::from_secs(10)).unwrap();
    let mut tags: Vec<_> =
        (1..=100).map(|ioa| moving(ioa, ValueKind::F64, json!({"ioa": ioa}), behaviour)).collect();
    tags.push(constant(101, ValueKind::F64, json!({"ioa": 101}), 1.0));
    let mut client = Client::with_tags(&tags);
    client.units();
    client.station.look_for_changes(client.times);
    assert_eq!(client.units(), Vec::<Vec<u8>>::new(), "nothing has changed yet");
    for round in 1..=3 {
        let time = client.times.true_time + Duration::from_millis(700);
        // Its clock is an hour ahead: the value is still that of the true time.
        let station_time = time + Duration::from_secs(3600);
        client.times = Times { true_time: time, station_time, ..client.times };
        client.station.look_for_changes(client.times);
        let units = client.units();
        let mut seen = 0;
        for unit in &units {
            assert_eq!(unit[0], 36, "M_ME_TF_1");
            let (cause, objects) = objects(unit);
            assert_eq!(cause, cause::SPONTANEOUS);
            for object in objects {
                let (_, signal) = &tags[object.address as usize - 1];
                let busbar_plugin_sdk::Value::F64(expected) = signal.at(time) else { panic!() };
                assert_eq!(object.value, codec::Value::Float(expected as f32));
                let tag = object.time.unwrap().resolve(UNIX_EPOCH, Zone::Utc);
                assert_eq!(tag, Some(station_time));
                seen += 1;
            }
        }
        assert_eq!(seen, 100, "round {round}");
    }
}

#[test]
fn nothing_is_sent_after_stop_and_all_is_known_anew_after_start() {
    let behaviour = Behavior::new(SignalShape::Counter, 0.0, 1e6, Duration::from_secs(1)).unwrap();
    let mut client = Client::with_tags(&[moving(
        1,
        ValueKind::I64,
        json!({"ioa": 1, "type": "counter"}),
        behaviour,
    )]);
    client.units();
    client.write(Frame::Unnumbered(Function::StopAct));
    client.times.true_time += Duration::from_secs(5);
    client.station.look_for_changes(client.times);
    assert_eq!(client.units(), Vec::<Vec<u8>>::new());
    client.write(Frame::Unnumbered(Function::StartAct));
    client.station.look_for_changes(client.times);
    assert_eq!(client.units(), Vec::<Vec<u8>>::new(), "only changes since, and no second start");
    client.times.true_time += Duration::from_secs(1);
    client.station.look_for_changes(client.times);
    assert_eq!(heads(&client.units()), [[37, 3]]);
}

#[test]
fn a_flood_of_requests_ends_the_connection() {
    let mut client = Client::with_tags(&tags());
    let mut bytes = Vec::new();
    for number in 0..2000 {
        let (send, receive) = (Sequence::new(number), Sequence::default());
        Frame::Information { send, receive, asdu: &interrogation(1, 20) }.write(&mut bytes);
    }
    assert_eq!(client.station.receive(&bytes, client.times), Err(CloseReason::Overrun));
}
