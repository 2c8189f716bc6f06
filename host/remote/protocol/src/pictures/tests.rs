use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::*;

fn both_sides() -> (PictureWriter, PictureReader) {
    let (file, memory) = PictureMemory::create().unwrap();
    let writer = PictureWriter::new(PictureMemory::open(&file).unwrap());
    (writer, PictureReader::new(memory))
}

fn area([x, y, width, height]: [u32; 4]) -> Area {
    Area { x, y, width, height }
}

fn pixels(reader: &PictureReader) -> &[u8] {
    let (info, pixels) = reader.picture().unwrap();
    // SAFETY: the reader's own picture, which the tests' writers leave alone.
    unsafe { std::slice::from_raw_parts(pixels, picture_bytes(info.size).unwrap()) }
}

#[test]
fn a_reader_never_sees_half_a_picture() {
    let (mut writer, mut reader) = both_sides();
    let ends = Arc::new(AtomicBool::new(false));
    let ending = ends.clone();
    let writing = std::thread::spawn(move || {
        let mut number = 0_u8;
        while !ending.load(Ordering::Relaxed) {
            number = number.wrapping_add(1);
            let size = [64 + u32::from(number % 7), 64];
            writer.publish(size, Area::default(), 1, |bytes| bytes.fill(number)).unwrap();
        }
    });
    let (mut taken, mut last) = (0, 0);
    while taken < 5000 {
        if reader.take() {
            taken += 1;
            let bytes = pixels(&reader);
            assert!(bytes.iter().all(|byte| *byte == bytes[0]), "half of another");
            let sequence = reader.picture().unwrap().0.sequence;
            assert!(sequence > last, "older than the one before");
            last = sequence;
        }
    }
    ends.store(true, Ordering::Relaxed);
    writing.join().unwrap();
}

#[test]
fn damage_covers_all_since_the_picture_that_was_taken() {
    let (mut writer, mut reader) = both_sides();
    let mut publish = |changed| writer.publish([8, 8], area(changed), 1, |_| {}).unwrap();
    publish([0, 0, 0, 0]);
    assert!(reader.take());
    assert_eq!(reader.picture().unwrap().0.damage, area([0, 0, 8, 8]), "the first");
    publish([1, 1, 1, 1]);
    publish([6, 2, 1, 1]);
    assert!(reader.take());
    let damage = reader.picture().unwrap().0.damage;
    assert_eq!(damage.union(area([1, 1, 6, 2])), damage, "{damage:?} lacks some of it");
    assert!(!reader.take(), "it was taken");
    publish([3, 3, 1, 1]);
    publish([4, 4, 1, 1]);
    assert!(reader.take());
    let damage = reader.picture().unwrap().0.damage;
    assert_eq!(damage.union(area([3, 3, 2, 2])), damage);
    publish([5, 5, 1, 1]);
    assert!(reader.take());
    assert_ne!(reader.picture().unwrap().0.damage, area([0, 0, 8, 8]), "not all for ever");
}

#[test]
fn numbers_that_name_no_picture_are_not_followed() {
    let (file, memory) = PictureMemory::create().unwrap();
    let mut reader = PictureReader::new(PictureMemory::open(&file).unwrap());
    for (numbers, is_picture) in [
        ([1, 8, 8, 0, 0, 8, 8, 1], true),
        ([1, u64::MAX, 8, 0, 0, 8, 8, 1], false),
        ([1, 8192, 8192, 0, 0, 0, 0, 1], false),
        ([1, 0, 8, 0, 0, 0, 0, 1], false),
        ([1, 8, 8, 7, 9, u64::MAX, 5, u64::MAX], true),
    ] {
        for picture in 0..PICTURES {
            let words = memory.info_words(picture);
            words.iter().zip(numbers).for_each(|(word, n)| word.store(n, Ordering::Relaxed));
        }
        memory.word(BETWEEN).store(!3 | 2, Ordering::Release);
        assert_eq!(reader.take(), is_picture, "{numbers:?}");
        if let Some((PictureInfo { size, damage, .. }, _)) = reader.picture() {
            assert!(damage.x + damage.width <= size[0] && damage.y + damage.height <= size[1]);
        }
    }
    memory.word(BETWEEN).store(IS_NEW | 3, Ordering::Release);
    assert!(!reader.take(), "there is no fourth picture");
}

/// A picture is as old as what it shows: neither when it came nor what was confirmed of another
/// one makes it younger.
#[test]
fn a_picture_carries_the_instant_of_its_values() {
    let (mut writer, mut reader) = both_sides();
    assert_eq!(reader.true_at(), None);
    let publish = |writer: &mut PictureWriter, at| {
        writer.publish([8, 8], area([0, 0, 8, 8]), at, |_| {}).unwrap();
    };
    publish(&mut writer, 10);
    assert!(reader.take());
    assert_eq!(reader.true_at(), Some(10));
    writer.memory().confirm(20);
    assert_eq!(reader.true_at(), Some(20), "it is the same still");
    publish(&mut writer, 30);
    writer.memory().confirm(40);
    assert_eq!(reader.true_at(), Some(10), "that is of the next picture");
    assert!(reader.take());
    assert_eq!(reader.true_at(), Some(40));
    assert!(!reader.take());
    // A frame that took long shows what was so at its beginning.
    publish(&mut writer, 35);
    assert!(reader.take());
    assert_eq!(reader.picture().unwrap().0.true_at, 35);
}

#[test]
fn turns_of_the_frame_loop_are_told_apart_from_the_heartbeat() {
    let (_, memory) = PictureMemory::create().unwrap();
    assert_eq!((memory.last_beat(), memory.last_turn()), (0, 0));
    memory.beat();
    assert!(memory.last_beat() > 0);
    assert_eq!(memory.last_turn(), 0);
    memory.note_turn(Duration::from_millis(70));
    assert!(memory.last_turn() >= memory.last_beat());
    assert_eq!(memory.turn_time(), Duration::from_millis(70));
}

#[test]
fn differences_are_found_to_the_pixel() {
    let mut after = [0; 6 * 4 * PIXEL_BYTES];
    let before = after;
    assert!(Area::from_difference(&before, &after, 6).is_empty());
    after[(6 + 4) * PIXEL_BYTES + 3] = 1;
    after[(3 * 6 + 2) * PIXEL_BYTES] = 1;
    assert_eq!(Area::from_difference(&before, &after, 6), area([2, 1, 3, 3]));
}

#[test]
fn memory_keeps_its_size() {
    let (file, _) = PictureMemory::create().unwrap();
    assert!(file.set_len(1).is_err());
    assert!(PictureMemory::open(&memory::zeroed("other", 4096).unwrap()).is_err());
}
