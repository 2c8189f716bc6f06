//! Any bytes of a station are data units or a named fault: no panic, as many
//! objects as a header says, and no memory beyond one frame.
//!
//! Run on stable: `RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir tests/fuzz iec104`.

#![no_main]

use std::time::{Duration, Instant, UNIX_EPOCH};

use iec104::codec::{Asdu, Body, Frame, Function, MAX_ASDU_BYTES, TimeTag, Zone};
use iec104::session::{Event, Parameters, Session};
use libfuzzer_sys::fuzz_target;

const PARAMETERS: Parameters = Parameters {
    k: 12,
    w: 8,
    t1: Duration::from_secs(15),
    t2: Duration::from_secs(10),
    t3: Duration::from_secs(20),
};
const ZONE: Zone = Zone::Local { offset_minutes: 330 };
/// 2024-02-29, for short time tags.
const RECEIVED_SECONDS: u64 = 1_709_210_096;

// The first byte says in what pieces the rest arrives. The rest is also read as
// one data unit, which spares the fuzzer the frames around it.
fuzz_target!(|bytes: &[u8]| {
    let Some((&piece, rest)) = bytes.split_first() else {
        return;
    };
    read(rest);
    let now = Instant::now();
    let mut session = Session::new(PARAMETERS, now);
    session.start(now);
    let mut confirmed = Vec::new();
    Frame::Unnumbered(Function::StartCon).write(&mut confirmed);
    assert_eq!(session.receive(&confirmed, now, |_| {}), Ok(()));
    for piece in rest.chunks(usize::from(piece).max(1)) {
        let heed = |event: Event<'_>| {
            if let Event::Asdu(asdu) = event {
                assert!((1..=MAX_ASDU_BYTES).contains(&asdu.len()));
                read(asdu);
            }
        };
        if session.receive(piece, now, heed).is_err() {
            return;
        }
    }
});

fn read(asdu: &[u8]) {
    let Ok(Asdu { header, body: Body::Objects(objects) }) = Asdu::parse(asdu) else {
        return;
    };
    assert_eq!(objects.count(), usize::from(header.count));
    let received = UNIX_EPOCH + Duration::from_secs(RECEIVED_SECONDS);
    for object in objects {
        assert!(object.address < 1 << 24);
        let resolve = |tag: TimeTag| tag.resolve(received, ZONE);
        let _ = object.time.and_then(resolve);
    }
}
