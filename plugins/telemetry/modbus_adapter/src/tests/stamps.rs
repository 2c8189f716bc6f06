//! Values that say which tag they are of, and when they were made: a server with
//! stamps gives every four registers the unit asked, their number, and the number of
//! the request.

use super::*;

/// Tags, by the number of their four registers: requests of their own, all alike.
pub(super) const TAGS: [u32; 4] = [0, 25, 50, 75];

pub(super) fn tags() -> Vec<TagSpec> {
    let tag = |number: u32| {
        let address = json!({"table": "holding", "register": 4 * number, "type": "i64"});
        tag_spec(number, &format!("tag{number}"), ValueKind::I64, address)
    };
    TAGS.map(tag).into()
}

/// Checks that every value is of its tag, and none older than one before; how many
/// there were of each tag.
#[track_caller]
pub(super) fn check(recording: &Recording) -> [usize; TAGS.len()] {
    let counts = TAGS.map(|tag| {
        let of_tag = recording.samples.iter().filter(|sample| sample.tag == tag);
        let values = of_tag.filter_map(|sample| sample.value.as_ref());
        let mut newest = 0;
        let mut count = 0;
        for value in values {
            let &Value::I64(value) = value else { panic!("{value:?}") };
            let (unit, number, sequence) = (value >> 48, value >> 32 & 0xFFFF, value & 0xFFFF_FFFF);
            assert_eq!((unit, number), (1, i64::from(tag)), "a value of another tag");
            assert!(sequence > newest, "tag {tag}: {sequence} after {newest}");
            newest = sequence;
            count += 1;
        }
        count
    });
    assert!(recording.samples.len() < busbar_plugin_sdk::testing::MAX_RECORDED);
    counts
}
