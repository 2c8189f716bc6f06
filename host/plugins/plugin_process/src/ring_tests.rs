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

fn sample(value: u64) -> PublishedSample {
    PublishedSample {
        tag: value as u32 ^ 0xa5a5,
        kind: 1,
        quality: 2,
        reason: 3,
        flags: 0,
        bits: value,
        source_time_unix_nanos: -(value as i64),
        text: None,
    }
}

fn samples(values: std::ops::Range<u64>) -> Vec<PublishedSample> {
    values.map(sample).collect()
}

fn read(reader: &mut RingReader) -> Vec<RawSample> {
    let mut samples = Vec::new();
    reader.read(|raw, _| samples.push(raw));
    samples
}

fn values(read: &[RawSample]) -> Vec<u64> {
    read.iter().map(|raw| raw.sample.bits).collect()
}

#[test]
fn samples_arrive_whole_and_in_order() {
    let (_memory, mut writer, mut reader) = ring();
    assert_eq!(read(&mut reader), []);
    assert!(!writer.write(samples(0..3), Moment(77)));
    writer.write(samples(3..4), Moment(78));
    let samples = read(&mut reader);
    assert_eq!(values(&samples), [0, 1, 2, 3]);
    assert_eq!(samples[3], RawSample { sample: sample(3), published: Moment(78) });
    assert_eq!(read(&mut reader), []);
    assert_eq!(reader.dropped(), 0);
}

/// A text of so many bytes, none of them like its neighbour.
fn text_sample(tag: u32, len: usize) -> PublishedSample {
    let bytes: Vec<u8> = (0..len).map(|at| b'a' + ((at * 7 + len) % 26) as u8).collect();
    let text = Some(Text::from_utf8_lossy(&bytes));
    PublishedSample { tag, kind: BUSBAR_VALUE_KIND_TEXT, bits: 0, text, ..sample(len as u64) }
}

#[test]
fn texts_of_every_length_arrive_whole_between_numbers() {
    let (_memory, mut writer, mut reader) = ring();
    let texts = || (0..=MAX_TEXT_BYTES).map(|len| text_sample(9, len));
    let batch: Vec<_> = texts().flat_map(|text| [sample(text.tag.into()), text]).collect();
    // More than a ring holds, so that texts pass its end.
    for round in 0..200 {
        assert!(!writer.write(batch.clone(), Moment(5)));
        let found: Vec<_> = read(&mut reader).into_iter().map(|raw| raw.sample).collect();
        assert!(found == batch, "round {round}");
    }
}

#[test]
fn texts_wait_for_all_their_slots_and_keep_their_place() {
    let (_memory, mut writer, mut reader) = ring();
    writer.write(samples(0..RING_SLOTS as u64 - 3), Moment(0));
    let late = [text_sample(1, 200), text_sample(1, 3), sample(5)];
    assert!(writer.write(late.clone(), Moment(1)), "eight slots find no room, nor what follows");
    assert_eq!(read(&mut reader).len(), RING_SLOTS - 3);
    assert!(!writer.flush());
    let found: Vec<_> = read(&mut reader).into_iter().map(|raw| raw.sample).collect();
    assert_eq!(found, late);
}

#[test]
fn a_text_that_its_writer_broke_is_none() {
    let (memory, mut writer, mut reader) = ring();
    let slot = |number: usize| ((HEADER_WORDS + number * WORDS) * 8) as u64;
    for len in [MAX_TEXT_BYTES as u64 + 1, 100, u64::MAX] {
        let before = writer.written as usize;
        writer.write([text_sample(1, 40)], Moment(0));
        memory.write_all_at(&len.to_ne_bytes(), slot(before) + 8).unwrap();
        let found = read(&mut reader);
        assert_eq!(found[0].sample.text, None, "{len}");
        writer.write([text_sample(2, 40)], Moment(0));
        assert_eq!(read(&mut reader)[0].sample, text_sample(2, 40), "what follows is read");
    }
}

#[test]
fn what_finds_no_room_comes_later_and_in_order() {
    let (_memory, mut writer, mut reader) = ring();
    let size = RING_SLOTS as u64;
    assert!(!writer.write(samples(0..size), Moment(0)));
    assert!(writer.write(samples(size..size + 5), Moment(0)));
    assert!(writer.flush(), "there is no room yet");
    assert!(values(&read(&mut reader)).into_iter().eq(0..size));
    assert!(!writer.write(samples(size + 5..size + 6), Moment(0)));
    assert!(values(&read(&mut reader)).into_iter().eq(size..size + 6));
    assert!(writer.write(samples(0..size + 9), Moment(0)), "a batch longer than a ring");
    assert_eq!(values(&read(&mut reader)).len() as u64, size);
    assert!(!writer.flush());
    assert!(values(&read(&mut reader)).into_iter().eq(size..size + 9));
    assert_eq!(reader.dropped(), 0);
}

/// Nobody reads for a long time: memory stays bounded, and each tag's last value comes
/// through at last, even that of one that spoke once.
#[test]
fn no_tag_is_forgotten_when_nobody_reads() {
    let (_memory, mut writer, mut reader) = ring();
    let of_tag = |tag, value| PublishedSample { tag, ..sample(value) };
    let size = RING_SLOTS as u64;
    writer.write(samples(0..size), Moment(0));
    writer.write([of_tag(7, 700)], Moment(1));
    for value in 0..3 * size {
        writer.write([of_tag(8, value)], Moment(2));
    }
    assert!(writer.backlog.len() <= busbar_tags::MAX_QUEUED_SAMPLES);
    let mut last = std::collections::BTreeMap::new();
    loop {
        let is_waiting = writer.flush();
        let read = read(&mut reader);
        last.extend(read.iter().map(|raw| (raw.sample.tag, raw.sample.bits)));
        if !is_waiting {
            break;
        }
    }
    assert_eq!((last[&7], last[&8]), (700, 3 * size - 1));
    assert!(reader.dropped() > 0, "what was overtaken is counted");
}

#[test]
fn memory_of_another_size_is_refused() {
    let memory = memory::zeroed("ring", RING_BYTES - 8).unwrap();
    assert!(RingReader::new(&memory).is_err());
    assert!(RingWriter::new(&memory).is_err());
}

/// A writer that is faster than the reader all the time: what is read is whole and
/// ascends, and with what was dropped it is all that was written.
#[test]
fn nothing_torn_is_read_under_a_flood() {
    let (_memory, mut writer, mut reader) = ring();
    let over = AtomicBool::new(false);
    let of_one_tag = |value| PublishedSample { tag: 1, ..sample(value) };
    std::thread::scope(|scope| {
        let writing = scope.spawn(|| {
            let mut next = 0;
            while !over.load(Ordering::Relaxed) {
                writer.write((next..next + 4099).map(of_one_tag), Moment(0));
                next += 4099;
            }
            (next, writer)
        });
        let (mut last, mut count) = (None, 0);
        let mut look = |reader: &mut RingReader| {
            for raw in read(reader) {
                assert_eq!(raw.sample, of_one_tag(raw.sample.bits));
                assert!(last < Some(raw.sample.bits), "{last:?}, then {raw:?}");
                last = Some(raw.sample.bits);
                count += 1;
            }
            count
        };
        // Until some were overtaken, and then some; the rest comes through all the same.
        let size = RING_SLOTS as u64;
        while look(&mut reader) < 4 * size || reader.dropped() < size {}
        over.store(true, Ordering::Relaxed);
        let (total, mut writer) = writing.join().unwrap();
        while writer.flush() {
            look(&mut reader);
        }
        assert_eq!(look(&mut reader) + reader.dropped(), total);
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
        writer.write(samples(0..10), Moment(0));
        for [taken, written, rejected] in headers {
            for (word, value) in [(READ, taken), (WRITTEN, written), (REJECTED, rejected)] {
                memory.write_all_at(&value.to_ne_bytes(), word as u64 * 8).unwrap();
            }
            memory.write_all_at(&garbage, HEADER_WORDS as u64 * 8).unwrap();
            memory.write_all_at(&garbage, RING_BYTES - 64).unwrap();
            prop_assert!(read(&mut reader).len() <= RING_SLOTS);
            writer.write(samples(0..10), Moment(0));
            writer.flush();
            prop_assert_eq!(reader.rejected(), rejected);
            let _ = reader.dropped();
        }
    }
}

fn hostile_word() -> impl Strategy<Value = u64> {
    let size = RING_SLOTS as u64;
    prop_oneof![
        any::<u64>(),
        0..2 * size,
        Just(u64::MAX),
        Just(u64::MAX - size),
        Just(1 << 63),
        (0..64_u32).prop_map(|shift| 1 << shift),
    ]
}
