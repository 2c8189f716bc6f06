//! Bytes of messages that have words of the shared vocabulary: they stay what they are, whatever
//! the types are called.

use busbar_protocol::framing::{decode, encode};
use busbar_protocol::message::{
    AlarmRequest, AlarmSnapshot, Command, HostMessage, MAX_MESSAGE_BYTES, TagSnapshot, TagUpdate,
    ViewerMessage,
};
use busbar_types::{AlarmState, DoublePoint, Origin, QualityLevel, Value};

/// Bytes of a message without its length.
fn body(message: &impl serde::Serialize) -> Vec<u8> {
    encode(message, MAX_MESSAGE_BYTES).expect("it is short").split_off(4)
}

fn update(value: Option<Value>, quality: QualityLevel) -> TagUpdate {
    TagUpdate { tag: "t".into(), value, quality, source_time: None, sent_at: 5 }
}

#[test]
fn values_and_qualities_of_tags() {
    let tags = vec![
        update(Some(Value::F64(1.0)), QualityLevel::Good),
        update(Some(Value::I64(-1)), QualityLevel::Uncertain),
        update(Some(Value::Bool(true)), QualityLevel::Bad),
        update(Some(Value::DoublePoint(DoublePoint::Intermediate)), QualityLevel::Good),
        update(Some(Value::DoublePoint(DoublePoint::BadState)), QualityLevel::Good),
        update(None, QualityLevel::Bad),
    ];
    let message = HostMessage::Command(Command::SetTags(tags));
    let expected: Vec<u8> = [
        &[1, 7, 6][..],
        &[1, b't', 1, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0, 5],
        &[1, b't', 1, 1, 1, 1, 0, 5],
        &[1, b't', 1, 2, 1, 2, 0, 5],
        &[1, b't', 1, 3, 0, 0, 0, 5],
        &[1, b't', 1, 3, 3, 0, 0, 5],
        &[1, b't', 0, 2, 0, 5],
    ]
    .concat();
    assert_eq!(body(&message), expected);
    assert_eq!(decode::<HostMessage>(&expected), Ok(message));
}

#[test]
fn what_no_switch_and_no_alarm_has_is_no_message() {
    let position = [1, 7, 1, 1, b't', 1, 3, 4, 0, 0, 5];
    assert!(decode::<HostMessage>(&position).is_err(), "a position after bad state");
    let state = |state| [1, 9, 1, b'a', state];
    let message = |state| Command::MirrorAlarm { alarm: "a".into(), state };
    for (place, known) in (0..).zip(AlarmState::ALL) {
        let expected = HostMessage::Command(message(known));
        assert_eq!(decode::<HostMessage>(&state(place)), Ok(expected));
    }
    assert!(decode::<HostMessage>(&state(9)).is_err(), "a state after I");
    let origin = [8, 1, b't', 0, 1, 5, 0];
    assert!(decode::<ViewerMessage>(&origin).is_err(), "an origin after historical");
}

#[test]
fn states_qualities_and_requests_that_a_viewer_reports() {
    let alarm = AlarmSnapshot {
        alarm: "a".into(),
        state: AlarmState::Shelved,
        since: -1,
        standing: "{}".into(),
        origin: Origin::SIMULATED,
        reason: "r".into(),
    };
    assert_eq!(
        body(&ViewerMessage::Alarm(alarm)),
        [6, 1, b'a', 6, 1, 2, b'{', b'}', 1, 2, 1, b'r']
    );
    let request = |action| ViewerMessage::AlarmRequested { alarm: "a".into(), action };
    assert_eq!(body(&request(AlarmRequest::Acknowledge)), [7, 1, b'a', 0]);
    assert_eq!(body(&request(AlarmRequest::Shelve(60))), [7, 1, b'a', 1, 60]);
    assert_eq!(body(&request(AlarmRequest::Unshelve)), [7, 1, b'a', 2]);
    assert_eq!(body(&request(AlarmRequest::Reset)), [7, 1, b'a', 3]);
    let quality = |origin| {
        ViewerMessage::Quality(TagSnapshot {
            tag: "t".into(),
            quality: QualityLevel::Uncertain,
            origin,
            reason: "r".into(),
        })
    };
    let live = quality(Origin::LIVE);
    assert_eq!(body(&live), [8, 1, b't', 1, 0, 1, b'r']);
    let marked = quality(Origin::SUBSTITUTED | Origin::SIMULATED | Origin::HISTORICAL);
    let expected = [8, 1, b't', 1, 3, 0, 2, 4, 1, b'r'];
    assert_eq!(body(&marked), expected);
    assert_eq!(decode::<ViewerMessage>(&expected), Ok(marked));
}
