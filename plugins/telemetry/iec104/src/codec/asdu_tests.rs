use proptest::prelude::*;

use super::*;

/// Every monitoring type: element bytes and time bytes by the standard's figures.
const TYPES: [(u8, usize, usize); 32] = [
    (1, 1, 0),
    (2, 1, 3),
    (3, 1, 0),
    (4, 1, 3),
    (5, 2, 0),
    (6, 2, 3),
    (7, 5, 0),
    (8, 5, 3),
    (9, 3, 0),
    (10, 3, 3),
    (11, 3, 0),
    (12, 3, 3),
    (13, 5, 0),
    (14, 5, 3),
    (15, 5, 0),
    (16, 5, 3),
    (17, 3, 3),
    (18, 4, 3),
    (19, 4, 3),
    (20, 5, 0),
    (21, 2, 0),
    (30, 1, 7),
    (31, 1, 7),
    (32, 2, 7),
    (33, 5, 7),
    (34, 3, 7),
    (35, 3, 7),
    (36, 5, 7),
    (37, 5, 7),
    (38, 3, 7),
    (39, 4, 7),
    (40, 4, 7),
];

fn objects(bytes: &[u8]) -> Result<Vec<Object>, AsduError> {
    match Asdu::parse(bytes)?.body {
        Body::Objects(objects) => Ok(objects.collect()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_header_is_read() {
    let bytes = [1, 0x81, 0xC3, 7, 0x34, 0x12, 1, 0, 0, 1];
    let header = Asdu::parse(&bytes).unwrap().header;
    let expected = Header {
        type_id: 1,
        is_sequence: true,
        count: 1,
        cause: cause::SPONTANEOUS,
        is_negative: true,
        is_test: true,
        originator: 7,
        common_address: 0x1234,
    };
    assert_eq!(header, expected);
}

#[test]
fn objects_have_addresses_of_their_own_or_in_sequence() {
    let single = [1, 2, 20, 0, 1, 0, 0x10, 0x27, 0, 1, 0x01, 0x02, 0x03, 0x80];
    let read: Vec<_> = objects(&single).unwrap();
    assert_eq!(read.iter().map(|o| o.address).collect::<Vec<_>>(), [10_000, 0x03_0201]);
    assert_eq!((read[0].value, read[1].value), (Value::Single(true), Value::Single(false)));
    assert!(!read[0].flags.is_invalid() && read[1].flags.is_invalid());

    let sequence = [11, 0x83, 20, 0, 1, 0, 0xFD, 0xFF, 0xFF, 1, 0, 0, 2, 0, 0, 3, 0, 0];
    let read = objects(&sequence).unwrap();
    let pairs: Vec<_> = read.iter().map(|o| (o.address, o.value)).collect();
    let scaled = |v| Value::Scaled(v);
    assert_eq!(pairs, [(0xFF_FFFD, scaled(1)), (0xFF_FFFE, scaled(2)), (0xFF_FFFF, scaled(3))]);
    let beyond = [11, 0x83, 20, 0, 1, 0, 0xFE, 0xFF, 0xFF, 1, 0, 0, 2, 0, 0, 3, 0, 0];
    assert_eq!(objects(&beyond), Err(AsduError::Address(0xFF_FFFE)));
}

#[test]
fn time_tags_end_an_object() {
    // 12:34:56.789 on 29 February 2024, summer time and invalid.
    let long = [30, 1, 3, 0, 1, 0, 5, 0, 0, 1, 0xD5, 0xDD, 34 | 0x80, 12 | 0x80, 29, 2, 24];
    let Some(TimeTag::Cp56(time)) = objects(&long).unwrap()[0].time else { panic!() };
    assert!(time.within_hour.is_invalid && time.is_summer);
    assert_eq!((time.day, time.month, time.year, time.hour), (29, 2, 24, 12));
    assert_eq!((time.within_hour.minute, time.within_hour.millis), (34, 56_789));
    let short = [2, 1, 3, 0, 1, 0, 5, 0, 0, 1, 0xD5, 0xDD, 34];
    let expected = Cp24 { millis: 56_789, minute: 34, is_invalid: false };
    assert_eq!(objects(&short).unwrap()[0].time, Some(TimeTag::Cp24(expected)));
}

#[test]
fn wrong_lengths_are_named() {
    assert_eq!(Asdu::parse(&[1, 1, 3, 0, 1]).unwrap_err(), AsduError::Header(5));
    assert_eq!(objects(&[1, 0, 3, 0, 1, 0]), Err(AsduError::Empty(1)));
    let short = AsduError::Length { type_id: 1, count: 2, wanted: 8, found: 4 };
    assert_eq!(objects(&[1, 2, 3, 0, 1, 0, 5, 0, 0, 1]), Err(short));
    let long = AsduError::Length { type_id: 1, count: 1, wanted: 4, found: 5 };
    assert_eq!(objects(&[1, 1, 3, 0, 1, 0, 5, 0, 0, 1, 1]), Err(long));
    let no_address = AsduError::Length { type_id: 1, count: 1, wanted: 4, found: 2 };
    assert_eq!(objects(&[1, 0x81, 3, 0, 1, 0, 5, 0]), Err(no_address));
}

#[test]
fn answers_and_strangers_are_told_apart() {
    let body = |type_id| match Asdu::parse(&[type_id, 1, 7, 0, 1, 0, 0, 0, 0, 20]).unwrap().body {
        Body::Objects(_) => "values",
        Body::InitialisationEnded => "initialised",
        Body::Interrogation => "interrogation",
        Body::CounterInterrogation => "counters",
        Body::ClockSync => "clock",
        Body::Other => "other",
    };
    let found = [70, 100, 101, 103].map(body);
    assert_eq!(found, ["initialised", "interrogation", "counters", "clock"]);
    for stranger in [0, 22, 29, 41, 45, 58, 64, 102, 110, 127, 255] {
        assert_eq!(body(stranger), "other", "{stranger}");
    }
}

proptest! {
    #[test]
    fn every_type_has_as_many_objects_as_it_says(
        which in 0..TYPES.len(),
        count in 1_u8..=127,
        is_sequence: bool,
        first in 0_u32..0x00FF_0000,
        seed: u64,
    ) {
        let (type_id, element, time) = TYPES[which];
        let mut random = fastrand::Rng::with_seed(seed);
        let mut bytes = vec![type_id, count | u8::from(is_sequence) << 7, 3, 0, 1, 0];
        let mut elements = Vec::new();
        for index in 0..u32::from(count) {
            if !is_sequence || index == 0 {
                bytes.extend(&(first + index).to_le_bytes()[..3]);
            }
            let start = bytes.len();
            bytes.extend((0..element + time).map(|_| random.u8(..)));
            elements.push(bytes[start..].to_vec());
        }
        let read = objects(&bytes).unwrap();
        prop_assert_eq!(read.len(), usize::from(count));
        for (index, (object, bytes)) in (0..).zip(read.iter().zip(&elements)) {
            prop_assert_eq!(object.address, first + index);
            // Debug, so that not-a-number equals itself.
            let alone = Shape::from_type_id(type_id).unwrap().element.read(bytes).unwrap();
            prop_assert_eq!(
                format!("{:?}", (object.value, object.flags)),
                format!("{alone:?}")
            );
            let tag = match time {
                0 => None,
                3 => Some(TimeTag::Cp24(Cp24::from_bytes(*bytes.last_chunk().unwrap()))),
                _ => Some(TimeTag::Cp56(Cp56::from_bytes(*bytes.last_chunk().unwrap()))),
            };
            prop_assert_eq!(object.time, tag);
        }
        bytes.pop();
        prop_assert!(objects(&bytes).is_err());
    }

    #[test]
    fn any_bytes_are_a_data_unit_or_named(bytes in prop::collection::vec(any::<u8>(), 0..260)) {
        if let Ok(Asdu { header, body: Body::Objects(objects) }) = Asdu::parse(&bytes) {
            prop_assert_eq!(objects.count(), usize::from(header.count));
        }
    }
}
