use proptest::prelude::*;

use super::*;

fn at(unix_millis: u64) -> SystemTime {
    UNIX_EPOCH + Duration::from_millis(unix_millis)
}

/// Instant 2024-02-29 12:34:56.789 UTC, in milliseconds.
const LEAP_DAY_MILLIS: u64 = 1_709_210_096_789;
const LEAP_DAY: [u8; 7] = [0xD5, 0xDD, 34, 12, 29, 2, 24];

fn resolve(bytes: [u8; 7], zone: Zone) -> Option<SystemTime> {
    TimeTag::Cp56(Cp56::from_bytes(bytes)).resolve(UNIX_EPOCH, zone)
}

#[test]
fn long_tags_are_instants() {
    let vienna = Zone::Local { offset_minutes: 60 };
    let bengaluru = Zone::Local { offset_minutes: 330 };
    let [b0, b1, b2, hour, day, month, year] = LEAP_DAY;
    let summer = [b0, b1, b2, hour | 0x80, day, month, year];
    // Thursday, which does not count.
    let weekday = [b0, b1, b2, hour, day | 4 << 5, month, year];
    let hour_millis = 3_600_000;
    let cases = [
        (LEAP_DAY, Zone::Utc, LEAP_DAY_MILLIS),
        (weekday, Zone::Utc, LEAP_DAY_MILLIS),
        (summer, Zone::Utc, LEAP_DAY_MILLIS),
        (LEAP_DAY, vienna, LEAP_DAY_MILLIS - hour_millis),
        (summer, vienna, LEAP_DAY_MILLIS - 2 * hour_millis),
        (LEAP_DAY, bengaluru, LEAP_DAY_MILLIS - 11 * hour_millis / 2),
        ([0, 0, 0, 0, 1, 1, 0], Zone::Utc, 946_684_800_000),
        ([0x5F, 0xEA, 59, 23, 31, 12, 99], Zone::Utc, 4_102_444_799_999),
    ];
    for (bytes, zone, millis) in cases {
        assert_eq!(resolve(bytes, zone), Some(at(millis)), "{bytes:?} {zone:?}");
    }
}

#[test]
fn what_names_no_instant_is_none() {
    let [b0, b1, b2, hour, day, month, year] = LEAP_DAY;
    for bytes in [
        [b0, b1, b2 | 0x80, hour, day, month, year],
        [0x60, 0xEA, b2, hour, day, month, year],
        [b0, b1, 60, hour, day, month, year],
        [b0, b1, b2, 24, day, month, year],
        [b0, b1, b2, hour, 0, month, year],
        [b0, b1, b2, hour, day, 0, year],
        [b0, b1, b2, hour, day, 13, year],
        [b0, b1, b2, hour, 29, 2, 23],
        [b0, b1, b2, hour, 31, 4, year],
        [b0, b1, b2, hour, day, month, 100],
    ] {
        assert_eq!(resolve(bytes, Zone::Utc), None, "{bytes:?}");
    }
}

#[test]
fn short_tags_are_the_nearest_instant() {
    let hour = 1_709_208_000_000; // 2024-02-29 12:00 UTC
    let minutes = |m: u64| m * 60_000;
    let cases = [
        // Sent just before, across the full hour, and by a clock ahead of ours.
        (hour + minutes(10), 9, Zone::Utc, hour + minutes(9)),
        (hour + minutes(1), 59, Zone::Utc, hour - minutes(1)),
        (hour + minutes(59), 1, Zone::Utc, hour + minutes(61)),
        (hour + minutes(40), 10, Zone::Local { offset_minutes: 330 }, hour + minutes(40)),
    ];
    for (received, minute, zone, wanted) in cases {
        let tag = TimeTag::Cp24(Cp24 { millis: 0, minute, is_invalid: false });
        assert_eq!(tag.resolve(at(received), zone), Some(at(wanted)), "{received} {minute}");
    }
    for (millis, minute, is_invalid) in [(60_000, 1, false), (0, 60, false), (0, 1, true)] {
        let tag = TimeTag::Cp24(Cp24 { millis, minute, is_invalid });
        assert_eq!(tag.resolve(at(hour), Zone::Utc), None);
    }
}

#[test]
fn years_beyond_the_tag_cannot_be_written() {
    for millis in [0, 946_684_799_999, 4_102_444_800_000] {
        assert_eq!(Cp56::from_system_time(at(millis), Zone::Utc), None, "{millis}");
    }
}

proptest! {
    #[test]
    fn instants_survive_both_ways(
        millis in 946_700_000_000_u64..4_102_400_000_000,
        offset_minutes in -720_i16..=840,
    ) {
        let zone = Zone::Local { offset_minutes };
        // Whatever the offset, within the years that a tag can name.
        let millis = millis.clamp(946_800_000_000, 4_102_300_000_000);
        let tag = Cp56::from_system_time(at(millis), zone).unwrap();
        prop_assert_eq!(Cp56::from_bytes(tag.to_bytes()), tag);
        prop_assert_eq!(tag.resolve(zone), Some(at(millis)));
        let short = TimeTag::Cp24(tag.within_hour);
        let near = at(millis + 29 * 60_000);
        prop_assert_eq!(short.resolve(near, zone), Some(at(millis)));
    }

    #[test]
    fn any_bytes_are_a_time_or_none(bytes: [u8; 7], received in 0_u64..u64::MAX / 2_000_000) {
        let zone = Zone::Local { offset_minutes: i16::MAX };
        let tag = Cp56::from_bytes(bytes);
        let _ = tag.resolve(zone);
        let _ = TimeTag::Cp24(tag.within_hour).resolve(at(received), zone);
    }
}
