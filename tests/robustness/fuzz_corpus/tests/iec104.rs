//! Fuzzing of IEC 60870-5-104: any bytes of a station are ASDUs or a named fault, without a panic
//! or memory beyond one frame. Objects are as many as the header says, values are for the tags of
//! those objects alone, and what can be written reads the same again.

use std::time::{Duration, Instant, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{Quality, Reason, Sample, ValueKind};
use iec104::apci_session::{Event, Parameters, Session};
use iec104::codec::{
    Asdu, AsduWriter, Body, Frame, Function, Header, MAX_ASDU_BYTES, Object, TimeTag, Zone, type_of,
};
use iec104::probe::ControllingProbe;
use serde_json::json;

const PARAMETERS: Parameters = Parameters {
    k: 12,
    w: 8,
    t1: Duration::from_secs(15),
    t2: Duration::from_secs(10),
    t3: Duration::from_secs(20),
};
const ZONE: Zone = Zone::Local { offset_minutes: 330 };
/// Objects with a tag each, of kinds in turn.
const TAGS: std::ops::Range<u32> = 1..17;
const KINDS: [ValueKind; 4] =
    [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint];
const COMMON_ADDRESS: u16 = 1;
/// Greatest number of requests for one input.
const MAX_REQUESTS: usize = 100;
/// Time of reception, seconds since 1970: 2024-02-29, for short time tags.
const RECEIVED_SECONDS: u64 = 1_709_210_096;

/// Runs one input. Its first byte selects the pieces in which the rest arrives. The rest is also
/// read as one data unit, which spares the fuzzer the frames around it.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&piece, rest)) = bytes.split_first() else { return false };
    let mut end = ControllingReader::new();
    let is_unit = end.read(rest);
    let now = Instant::now();
    let mut session = Session::new(PARAMETERS, now);
    session.start(now);
    let mut confirmed = Vec::new();
    Frame::Unnumbered(Function::StartCon).write(&mut confirmed);
    assert_eq!(session.receive(&confirmed, now, |_| {}), Ok(()));
    for piece in rest.chunks(usize::from(piece).max(1)) {
        let handle = |event: Event<'_>| {
            if let Event::Asdu(asdu) = event {
                assert!((1..=MAX_ASDU_BYTES).contains(&asdu.len()));
                end.read(asdu);
            }
        };
        if session.receive(piece, now, handle).is_err() {
            return is_unit;
        }
    }
    true
}

/// Receiver of data units: the adapter's protocol state and its recorded samples.
struct ControllingReader {
    recorder: Recorder,
    probe: ControllingProbe,
}

impl ControllingReader {
    fn new() -> Self {
        let settings = json!({ "host": "127.0.0.1", "common_address": COMMON_ADDRESS });
        let settings = serde_json::from_value(settings).expect("these settings are good");
        let kind = |tag: u32| KINDS[tag as usize % KINDS.len()];
        let tags: Vec<_> =
            TAGS.map(|tag| tag_spec(tag, "t", kind(tag), json!({ "ioa": tag }))).collect();
        let recorder = Recorder::new();
        let probe = ControllingProbe::new(settings, &tags, recorder.sink());
        Self { probe: probe.expect("the addresses are good"), recorder }
    }

    /// Reads a data unit; reports whether it holds values.
    fn read(&mut self, asdu: &[u8]) -> bool {
        self.recorder.clear();
        let received = UNIX_EPOCH + Duration::from_secs(RECEIVED_SECONDS);
        self.probe.handle_answer(asdu, received);
        let samples: Vec<_> = self.recorder.recording().samples.into();
        let requests = std::iter::from_fn(|| self.probe.next_request());
        for request in requests.take(MAX_REQUESTS) {
            assert!(request.starts_with(&[100]) || request.starts_with(&[101]), "{request:?}");
        }
        let Ok(Asdu { header, body: Body::Objects(objects) }) = Asdu::parse(asdu) else {
            // An answer may say that no tag of the station has a value.
            assert!(samples.iter().all(|sample| sample.value.is_none()));
            return false;
        };
        assert_eq!(objects.count(), usize::from(header.count));
        let is_ours = header.common_address == COMMON_ADDRESS && is_understood(&header);
        let of_tags = objects.filter(|object| is_ours && TAGS.contains(&object.address));
        let of_tags: Vec<u32> = of_tags.map(|object| object.address).collect();
        let (values, rest) = samples.split_at(of_tags.len().min(samples.len()));
        assert!(values.iter().map(|sample| sample.tag).eq(of_tags));
        // What cannot be understood makes what was known before bad.
        let doubtful = Quality::Bad(Reason::Communication);
        assert!(rest.iter().all(|sample| sample.value.is_none() && sample.quality == doubtful));
        samples.iter().for_each(check_sample);
        for object in objects {
            assert!(object.address < 1 << 24);
            let resolve = |tag: TimeTag| tag.resolve(received, ZONE);
            let _ = object.time.and_then(resolve);
            if header.type_id == type_of(object.value, object.time.is_some()) {
                write_again(&object);
            }
        }
        true
    }
}

/// Reports whether a data unit with objects is one of the process.
fn is_understood(header: &Header) -> bool {
    !header.is_negative && matches!(header.cause, 1..=5 | 11 | 12 | 20..=41)
}

/// Checks that a value is of its tag's kind.
fn check_sample(sample: &Sample) {
    let Some(value) = &sample.value else { return assert!(!sample.quality.is_good()) };
    assert_eq!(value.kind(), KINDS[sample.tag as usize % KINDS.len()]);
}

fn write_again(object: &Object) {
    let mut writer = AsduWriter::new(3, 1);
    assert!(writer.push(object));
    let bytes = writer.finish().expect("it has an object");
    let Ok(Asdu { body: Body::Objects(mut again), .. }) = Asdu::parse(&bytes) else {
        panic!("what was written is no data unit: {bytes:?}");
    };
    // As text: a number that is none equals no other.
    assert_eq!(format!("{:?}", again.next()), format!("{:?}", Some(object)));
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("iec104", fuzz_one);
}
