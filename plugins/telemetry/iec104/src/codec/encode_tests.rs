use proptest::prelude::*;

use super::*;
use crate::codec::{Asdu, Body, Cp24, Flags};

fn object(address: u32, value: Value) -> Object {
    Object { address, value, flags: Flags::default(), time: None }
}

fn read(bytes: &[u8]) -> (crate::codec::Header, Vec<Object>) {
    let asdu = Asdu::parse(bytes).unwrap();
    let Body::Objects(objects) = asdu.body else { panic!("{:?}", asdu.body) };
    (asdu.header, objects.collect())
}

#[test]
fn data_units_are_those_of_the_standard() {
    let mut writer = AsduWriter::new(cause::INTERROGATED, 0x1234);
    assert!(writer.push(&object(1, Value::Float(230.5))));
    assert!(writer.push(&object(0x01_0203, Value::Float(-1.0))));
    assert!(!writer.push(&object(3, Value::Single(true))), "another type");
    let bytes = writer.finish().unwrap();
    // 230.5 is 43668000h and -1 is BF800000h by IEEE 754.
    let head = [13, 2, 20, 0, 0x34, 0x12];
    let objects = [1, 0, 0, 0, 0x80, 0x66, 0x43, 0, 3, 2, 1, 0, 0, 0x80, 0xBF, 0];
    assert_eq!(bytes, [&head[..], &objects].concat());
    assert_eq!(AsduWriter::new(3, 1).finish(), None);
    assert_eq!(initialisation_ended(0x0102), [70, 1, 4, 0, 2, 1, 0, 0, 0, 0]);
    let request = [100, 1, 0x86, 9, 1, 0, 0, 0, 0, 20];
    assert_eq!(answer_to(&request, 7, true)[..4], [100, 1, 0x80 | 0x40 | 7, 9]);
    assert_eq!(answer_to(&request, 10, false)[..4], [100, 1, 0x80 | 10, 9]);
}

#[test]
fn a_data_unit_takes_no_more_than_a_frame() {
    let mut writer = AsduWriter::new(3, 1);
    let time = Cp56::from_bytes([0, 0, 0, 0, 1, 1, 24]);
    let timed = Object { time: Some(TimeTag::Cp56(time)), ..object(7, Value::Float(1.0)) };
    let count = (0..200).take_while(|_| writer.push(&timed)).count();
    assert_eq!(count, (MAX_ASDU_BYTES - HEADER_BYTES) / 15);
    assert!(writer.finish().unwrap().len() <= MAX_ASDU_BYTES);
    let mut writer = AsduWriter::new(3, 1);
    assert_eq!((0..200).take_while(|_| writer.push(&object(7, Value::Single(true)))).count(), 60);
}

fn value() -> impl Strategy<Value = Value> {
    prop_oneof![
        any::<bool>().prop_map(Value::Single),
        (0_u8..4).prop_map(Value::Double),
        (-64_i8..64, any::<bool>())
            .prop_map(|(position, is_transient)| Value::Step { position, is_transient }),
        any::<u32>().prop_map(Value::Bits),
        any::<i16>().prop_map(Value::Normalized),
        any::<i16>().prop_map(Value::Scaled),
        (-1e30_f32..1e30).prop_map(Value::Float),
        (any::<i32>(), 0_u8..32, any::<bool>(), any::<bool>()).prop_map(
            |(count, sequence, is_carried, is_adjusted)| Value::Counter {
                count,
                sequence,
                is_carried,
                is_adjusted,
            }
        ),
    ]
}

proptest! {
    #[test]
    fn objects_are_read_as_they_were_written(
        value in value(),
        address in 0_u32..1 << 24,
        cause in 0_u8..64,
        common_address: u16,
        seconds in prop::option::of(946_684_800_u64..4_000_000_000),
    ) {
        let time = seconds.map(|seconds| {
            let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(seconds);
            TimeTag::Cp56(Cp56::from_system_time(time, crate::codec::Zone::Utc).unwrap())
        });
        let written = Object { time, ..object(address, value) };
        let mut writer = AsduWriter::new(cause, common_address);
        prop_assert!(writer.push(&written));
        let bytes = writer.finish().unwrap();
        let (header, objects) = read(&bytes);
        prop_assert_eq!((header.cause, header.common_address), (cause, common_address));
        prop_assert_eq!(objects, vec![written]);
    }

    /// Flags come from the wire alone: what was read is written again byte by byte.
    #[test]
    fn units_survive_reading_and_writing(
        type_index in 0_usize..8,
        count in 1_u8..12,
        bytes in prop::collection::vec(any::<u8>(), 12 * 8),
    ) {
        let (type_id, size) =
            [(1_u8, 4_usize), (3, 4), (5, 5), (7, 8), (9, 6), (11, 6), (13, 8), (15, 8)][type_index];
        let unit: Vec<u8> = [type_id, count, 3, 0, 1, 0]
            .into_iter()
            .chain(bytes[..usize::from(count) * size].iter().copied())
            .collect();
        let (_, objects) = read(&unit);
        let mut writer = AsduWriter::new(3, 1);
        prop_assert!(objects.iter().all(|object| writer.push(object)));
        let again = writer.finish().unwrap();
        prop_assert_eq!(again.len(), unit.len());
        // A NaN is no equal of itself, and unused bits are not kept: compare by bytes read.
        let (_, reread) = read(&again);
        let form = |objects: &[Object]| format!("{objects:?}");
        prop_assert_eq!(form(&reread), form(&objects));
    }
}

#[test]
fn short_times_are_left_out() {
    let time = TimeTag::Cp24(Cp24 { millis: 1, minute: 2, is_invalid: false });
    let mut writer = AsduWriter::new(3, 1);
    assert!(writer.push(&Object { time: Some(time), ..object(1, Value::Scaled(5)) }));
    assert_eq!(read(&writer.finish().unwrap()).1, [object(1, Value::Scaled(5))]);
}
