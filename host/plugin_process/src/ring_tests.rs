use std::os::unix::fs::FileExt;
use std::sync::atomic::AtomicBool;

use proptest::prelude::*;

use super::*;
use crate::memory;

fn ring() -> (File, RingWriter, RingReader) {
    let memory = memory::zeroed("ring", RING_BYTES).unwrap();
    let (writer, reader) = (RingWriter::new(&memory).unwrap(), RingReader::new(&memory).unwrap());
    (memory, writer, reader)
}

fn sample(value: u64) -> BusbarSample {
    BusbarSample {
        tag: value as u32 ^ 0xa5a5,
        kind: 1,
        quality: 2,
        reason: 3,
        reserved: 0,
        value,
        source_time_unix_nanos: -(value as i64),
    }
}

fn samples(values: std::ops::Range<u64>) -> Vec<BusbarSample> {
    values.map(sample).collect()
}

fn values(read: &[RawSample]) -> Vec<u64> {
    read.iter().map(|raw| raw.sample.value).collect()
}

#[test]
fn samples_arrive_whole_and_in_order() {
    let (_memory, mut writer, mut reader) = ring();
    assert_eq!(reader.read(), []);
    assert_eq!(writer.write(&samples(0..3), 77), 3);
    writer.write(&samples(3..4), 78);
    let read = reader.read();
    assert_eq!(values(&read), [0, 1, 2, 3]);
    assert_eq!(read[3], RawSample { sample: sample(3), monotonic_nanos: 78 });
    assert_eq!(reader.read(), []);
    assert_eq!(reader.dropped(), 0);
}

#[test]
fn a_full_ring_drops_its_oldest_and_counts() {
    let (_memory, mut writer, mut reader) = ring();
    let size = RING_SAMPLES as u64;
    writer.write(&samples(0..size), 0);
    writer.write(&samples(size..size + 5), 0);
    let read = reader.read();
    assert_eq!((read.len(), read[0].sample.value), (RING_SAMPLES, 5));
    assert_eq!(reader.dropped(), 5);
    assert_eq!(writer.write(&samples(0..size + 9), 0), RING_SAMPLES, "a batch longer than a ring");
    assert_eq!(values(&reader.read())[0], 9);
    assert_eq!(reader.dropped(), 14);
}

#[test]
fn memory_of_another_size_is_refused() {
    let memory = memory::zeroed("ring", RING_BYTES - 8).unwrap();
    assert!(RingReader::new(&memory).is_err());
    assert!(RingWriter::new(&memory).is_err());
}

/// A writer that overtakes the reader all the time: what is read is whole and
/// ascends, and with what was dropped it is all that was written.
#[test]
fn nothing_torn_is_read_under_a_flood() {
    let (_memory, mut writer, mut reader) = ring();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let writing = scope.spawn(|| {
            let mut next = 0;
            while !over.load(Ordering::Relaxed) {
                writer.write(&samples(next..next + 4099), 0);
                next += 4099;
            }
            next
        });
        let (mut last, mut count) = (None, 0);
        // Until it was overtaken, and then some; what it leaves comes through all the same.
        let size = RING_SAMPLES as u64;
        while reader.dropped() < 4 * size || count < size {
            for raw in reader.read() {
                assert_eq!(raw.sample, sample(raw.sample.value));
                assert!(last < Some(raw.sample.value), "{last:?}, then {raw:?}");
                last = Some(raw.sample.value);
                count += 1;
            }
        }
        over.store(true, Ordering::Relaxed);
        let total = writing.join().unwrap();
        count += reader.read().len() as u64;
        assert_eq!(count + reader.dropped(), total);
        assert!(count > 0);
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Whatever stands in the shared memory, reading stays within it, gives at
    /// most a ring and ends.
    #[test]
    fn a_hostile_header_does_no_harm(
        headers in prop::collection::vec(prop::array::uniform3(hostile_word()), 1..6),
        garbage in any::<[u8; 64]>(),
    ) {
        let (memory, mut writer, mut reader) = ring();
        writer.write(&samples(0..10), 0);
        for [reserved, written, rejected] in headers {
            for (word, value) in [(RESERVED, reserved), (WRITTEN, written), (REJECTED, rejected)] {
                memory.write_all_at(&value.to_ne_bytes(), word as u64 * 8).unwrap();
            }
            memory.write_all_at(&garbage, HEADER_WORDS as u64 * 8).unwrap();
            memory.write_all_at(&garbage, RING_BYTES - 64).unwrap();
            prop_assert!(reader.read().len() <= RING_SAMPLES);
            prop_assert_eq!(reader.rejected(), rejected);
            let _ = reader.dropped();
        }
    }
}

fn hostile_word() -> impl Strategy<Value = u64> {
    let size = RING_SAMPLES as u64;
    prop_oneof![
        any::<u64>(),
        0..2 * size,
        Just(u64::MAX),
        Just(u64::MAX - size),
        Just(1 << 63),
        (0..64_u32).prop_map(|shift| 1 << shift),
    ]
}
