//! Faults of what a server publishes, over a connection: no old value stays good.

use async_opcua::types::{
    ExtensionObject, MonitoredItemNotification, SignedSoftwareCertificate,
    StatusChangeNotification, StatusCode,
};
use busbar_plugin_sdk::SampleFlags;

use super::scripted_server::{ScriptedServer, changes_of, message, value};
use super::*;

const A: &str = "ns=2;s=A";
const B: &str = "ns=2;s=B";
const DOUBT: Quality = Quality::Uncertain(Reason::Communication);

/// A server whose two nodes are 1, as was told by the first notification.
fn begin(settings: &Json) -> (ScriptedServer, Running) {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    let tags = vec![tag(1, ValueKind::I64, "A"), tag(2, ValueKind::I64, "B")];
    let running = start(server.port, settings, tags);
    server.wait_monitored(&[A, B]);
    server.data(1, &[(A, value(1_i64)), (B, value(1_i64))]);
    running.wait_for(1, Value::I64(1));
    running.wait_for(2, Value::I64(1));
    (server, running)
}

/// Values and qualities of a tag, without repetitions.
fn story(running: &Running, tag: u32) -> Vec<(Option<Value>, Quality)> {
    let samples = running.recorder.recording().samples;
    let samples = samples.iter().filter(|sample| sample.tag == tag);
    let mut story: Vec<_> = samples.map(|sample| (sample.value.clone(), sample.quality)).collect();
    story.dedup();
    story
}

#[test]
fn a_notification_that_is_lost_for_good_has_the_values_read_anew() {
    let (server, running) = begin(&json!({}));
    running.recorder.clear();
    server.set(A, value(3_i64));
    server.set(B, value(2_i64));
    // The second one told that B is 2, and is lost.
    server.keep_alive(2);
    server.data(3, &[(A, value(3_i64))]);
    for _ in 0..3 {
        server.keep_alive(4);
    }
    running.wait_for(2, Value::I64(2));
    running.wait_for(1, Value::I64(3));
    let of = |value| Some(Value::I64(value));
    let told: Vec<_> =
        story(&running, 2).into_iter().filter(|told| *told != (of(1), Quality::Good)).collect();
    assert_eq!(told, [(of(1), DOUBT), (of(2), Quality::Good)]);
    assert_eq!((server.count("Republish"), server.count("CreateSession")), (1, 1));
}

#[test]
fn nothing_is_good_or_confirmed_while_a_notification_is_missing() {
    let (server, running) = begin(&json!({"silence_seconds": 5}));
    server.script().holds_republish = true;
    server.keep_alive(2);
    server.data(3, &[(A, value(3_i64))]);
    running.wait_for_quality(1, DOUBT);
    running.wait_for_quality(2, DOUBT);
    running.recorder.clear();
    for _ in 0..30 {
        server.keep_alive(4);
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(!running.has_good_samples(), "{:?}", story(&running, 1));
    // The server never answers: the connection is given up.
    running.wait_for_link(LinkState::Down, "silent");
    running.wait_for_bad(1, Reason::Communication);
}

#[test]
fn a_notification_that_is_published_again_comes_before_what_waited() {
    let (server, running) = begin(&json!({}));
    running.recorder.clear();
    let missing = server.notification(2, &[(A, value(2_i64))]);
    server.script().kept.insert(2, missing);
    server.data(3, &[(A, value(3_i64))]);
    running.wait_for(1, Value::I64(3));
    running.wait_for(2, Value::I64(1));
    let of = |value| Some(Value::I64(value));
    let good = Quality::Good;
    let told = story(&running, 1);
    assert!(told.ends_with(&[(of(1), DOUBT), (of(2), good), (of(3), good)]), "{told:?}");
    assert!(story(&running, 2).ends_with(&[(of(1), DOUBT), (of(1), good)]));
    assert_eq!(server.count("Republish"), 1);
}

#[test]
fn a_notification_that_came_again_is_not_good_while_the_one_after_it_is_missing() {
    let (server, running) = begin(&json!({}));
    running.recorder.clear();
    let second = server.notification(2, &[(A, value(2_i64))]);
    server.script().kept.insert(2, second);
    // The third one is lost for good; it told that A is 3.
    server.set(A, value(3_i64));
    server.set(B, value(1_i64));
    server.keep_alive(4);
    running.wait_for(1, Value::I64(3));
    let of = |value| Some(Value::I64(value));
    assert!(!story(&running, 1).contains(&(of(2), Quality::Good)), "{:?}", story(&running, 1));
}

#[test]
fn the_first_notification_may_be_lost_too() {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    let tags = vec![tag(1, ValueKind::I64, "A"), tag(2, ValueKind::I64, "B")];
    let running = start(server.port, &json!({}), tags);
    server.wait_monitored(&[A, B]);
    server.set(B, value(7_i64));
    server.set(A, value(2_i64));
    server.data(2, &[(A, value(2_i64))]);
    running.wait_for(1, Value::I64(2));
    running.wait_for(2, Value::I64(7));
    assert_eq!(server.count("Republish"), 1);
}

#[test]
fn a_server_whose_keep_alives_use_numbers_stays_connected() {
    let (server, running) = begin(&json!({}));
    server.set(A, value(1_i64));
    server.set(B, value(1_i64));
    for number in 2..40 {
        if number % 6 == 0 {
            server.set(A, value(i64::from(number)));
            server.data(number, &[(A, value(i64::from(number)))]);
            running.wait_for(1, Value::I64(number.into()));
        } else {
            server.keep_alive(number);
        }
        server.wait_published();
        std::thread::sleep(Duration::from_millis(20));
    }
    running.wait_for(2, Value::I64(1));
    assert_eq!(server.count("CreateSession"), 1);
    assert!(server.count("Republish") <= 4, "{}", server.count("Republish"));
}

#[test]
fn what_cannot_be_understood_has_the_values_read_anew() {
    let unknown = || ExtensionObject::from_message(SignedSoftwareCertificate::default());
    let nobody =
        || changes_of(vec![MonitoredItemNotification { client_handle: 77, value: value(9_i64) }]);
    for data in [ExtensionObject::null(), unknown(), nobody()] {
        let (server, running) = begin(&json!({}));
        running.recorder.clear();
        server.set(A, value(5_i64));
        server.set(B, value(1_i64));
        let what = format!("{data:?}");
        server.publish(message(2, Some(vec![data])));
        running.wait_for(1, Value::I64(5));
        running.wait_for(2, Value::I64(1));
        let of = |value| Some(Value::I64(value));
        let told = story(&running, 1);
        assert!(told.ends_with(&[(of(1), DOUBT), (of(5), Quality::Good)]), "{what}: {told:?}");
        assert!(story(&running, 2).ends_with(&[(of(1), DOUBT), (of(1), Quality::Good)]), "{what}");
    }
}

#[test]
fn a_subscription_that_ended_leaves_nothing_good() {
    let (server, running) = begin(&json!({}));
    let ended = StatusChangeNotification {
        status: StatusCode::BadTimeout,
        ..StatusChangeNotification::default()
    };
    // Its number is of no interest.
    server.publish(message(9, Some(vec![ExtensionObject::from_message(ended)])));
    running.wait_for_link(LinkState::Down, "the subscription ended: BadTimeout");
    running.wait_for_bad(1, Reason::Communication);
}

#[test]
fn a_server_that_takes_few_publish_requests_serves_on() {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    server.script().max_publishes = 1;
    let running = start(server.port, &json!({}), vec![tag(1, ValueKind::I64, "A")]);
    server.wait_monitored(&[A]);
    for number in 1..10 {
        server.data(number, &[(A, value(i64::from(number)))]);
        running.wait_for(1, Value::I64(number.into()));
    }
    assert_eq!(server.count("CreateSession"), 1);
}

#[test]
fn a_slow_keep_alive_is_no_silence_and_a_silent_subscription_is() {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    // A sign of life every 2 s, where 0.5 s of silence are borne.
    server.script().keep_alive_count = 40;
    let settings = json!({"silence_seconds": 0.5});
    let running = start(server.port, &settings, vec![tag(1, ValueKind::I64, "A")]);
    server.wait_monitored(&[A]);
    server.data(1, &[(A, value(1_i64))]);
    running.wait_for(1, Value::I64(1));
    for _ in 0..3 {
        std::thread::sleep(Duration::from_millis(2000));
        server.keep_alive(2);
        server.wait_published();
    }
    assert_eq!(server.count("CreateSession"), 1, "it is slow, not silent");
    running.wait_for_link(LinkState::Down, "a subscription gave no sign of life for 25");
    running.wait_for_bad(1, Reason::Communication);
}

#[test]
fn an_index_that_means_another_namespace_after_a_restart_is_bad_and_told() {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    let mut by_uri = tag(2, ValueKind::I64, "A");
    by_uri.address = json!({"node": "nsu=urn:plant;s=A"});
    let tags = vec![tag(1, ValueKind::I64, "A"), by_uri];
    let running = start(server.port, &json!({}), tags);
    server.wait_monitored(&[A]);
    server.data(1, &[(A, value(1_i64))]);
    running.wait_for(1, Value::I64(1));
    running.wait_for(2, Value::I64(1));
    server.set_namespaces(&["urn:server", "urn:other", "urn:plant"]);
    server.restart();
    server.wait_monitored(&["ns=3;s=A"]);
    server.data(1, &[("ns=3;s=A", value(2_i64))]);
    running.wait_for(2, Value::I64(2));
    running.wait_for_bad(1, Reason::Configuration);
    let said = "connected; namespace 2 was 'urn:plant' and is now 'urn:other': write nsu=URI";
    running.wait_for_link(LinkState::Up, said);
    // It is as it was before.
    server.set_namespaces(&["urn:server", "urn:plant"]);
    server.restart();
    server.wait_monitored(&[A]);
    server.data(1, &[(A, value(3_i64))]);
    running.wait_for(1, Value::I64(3));
    running.wait_for(2, Value::I64(3));
}

#[test]
fn a_server_in_test_mode_marks_its_values_from_the_first_on() {
    let server = ScriptedServer::start(&["urn:server", "urn:plant"]);
    server.script().state = 5;
    let running = start(server.port, &json!({}), vec![tag(1, ValueKind::I64, "A")]);
    server.wait_monitored(&[A]);
    server.data(1, &[(A, value(1_i64))]);
    running.wait_for(1, Value::I64(1));
    assert!(running.samples(1).iter().all(|sample| sample.flags == SampleFlags::TEST));
}
