//! Modbus RTU, to pymodbus and libmodbus over a line without wires.

use super::line::Line;
use super::peer::{Libmodbus, Peer, Place};
use super::*;

fn of_unit(tag: u32, unit: u8, register: u16) -> TagSpec {
    let address = json!({"table": "holding", "register": register, "type": "u16", "unit": unit});
    tag_spec(tag, &format!("tag{tag}"), ValueKind::F64, address)
}

/// Units with these numbers, each with its number in register 0.
fn units(numbers: &[u8], factor: u32) -> serde_json::Value {
    let unit =
        |number: &u8| (number.to_string(), json!({"holding": {"0": u32::from(*number) * factor}}));
    json!({"units": numbers.iter().map(unit).collect::<serde_json::Map<_, _>>()})
}

#[test]
fn every_type_is_read_as_the_server_has_it() {
    let Some(line) = Line::lay() else { return };
    let place = Place::Serial(line.theirs());
    let Some(_peer) = Peer::start_at(&place, &types::values()) else { return };
    types::check(line.settings());
}

#[test]
fn a_silent_unit_does_not_take_the_others_along() {
    let Some(line) = Line::lay() else { return };
    let place = Place::Serial(line.theirs());
    let Some(peer) = Peer::start_at(&place, &units(&[1, 3], 10)) else { return };
    let tags: Vec<_> = [1, 2, 3].map(|unit| of_unit(unit.into(), unit, 0)).into();
    let running = line.start(json!({}), tags);
    running.wait_for(1, Value::F64(10.0));
    running.wait_for(3, Value::F64(30.0));
    running.wait_for_bad(2, Reason::Communication);
    running.wait_for_link(LinkState::Up, "no answer from unit 2");
    // It stays like that.
    running.recorder.clear();
    running.wait_for(1, Value::F64(10.0));
    running.wait_for(3, Value::F64(30.0));
    running.wait_for_bad(2, Reason::Communication);
    assert!(running.recorder.recording().links.iter().all(|(state, _)| *state == LinkState::Up));
    // And when it comes, it is served.
    drop(peer);
    let _peer = Peer::start_at(&place, &units(&[1, 2, 3], 100)).unwrap();
    for unit in [1, 2, 3] {
        running.wait_for(unit, Value::F64(f64::from(unit) * 100.0));
    }
    running.wait_for_link(LinkState::Up, "connected");
}

#[test]
fn a_killed_server_makes_tags_bad_and_a_restarted_one_good() {
    let Some(line) = Line::lay() else { return };
    let place = Place::Serial(line.theirs());
    let Some(peer) = Peer::start_at(&place, &units(&[1], 5)) else { return };
    let running = line.start(json!({}), vec![of_unit(1, 1, 0)]);
    running.wait_for(1, Value::F64(5.0));
    drop(peer);
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "no answer within 400 ms");
    let _peer = Peer::start_at(&place, &units(&[1], 50)).unwrap();
    running.wait_for(1, Value::F64(50.0));
}

#[test]
#[cfg(target_os = "linux")]
fn a_frozen_server_makes_all_tags_of_its_unit_bad_within_the_deadline() {
    let (Some(libmodbus), Some(line)) = (Libmodbus::compile(), Line::lay()) else { return };
    let mut peer = libmodbus.start(&Place::Serial(line.theirs()));
    peer.command("set holding 0 5 6");
    let slow = json!({"table": "holding", "register": 1, "type": "u16", "poll_group": "slow"});
    let slow = tag_spec(2, "slow", ValueKind::F64, slow);
    let settings = json!({"poll_groups": {"slow": {"poll_seconds": 60}}});
    let running = line.start(settings, vec![of_unit(1, 1, 0), slow]);
    running.wait_for(1, Value::F64(5.0));
    running.wait_for(2, Value::F64(6.0));
    peer.signal("STOP");
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    running.wait_for_link(LinkState::Down, "no answer within 400 ms");
    // Its answers to what it was asked meanwhile come now, all at once.
    peer.signal("CONT");
    running.wait_for(1, Value::F64(5.0));
    running.wait_for(2, Value::F64(6.0));
}

#[test]
fn a_cut_line_makes_tags_bad_and_a_mended_one_good() {
    let (Some(libmodbus), Some(mut line)) = (Libmodbus::compile(), Line::lay()) else { return };
    let mut peer = libmodbus.start(&Place::Serial(line.theirs()));
    peer.command("set holding 0 5");
    let running = line.start(json!({}), vec![of_unit(1, 1, 0)]);
    running.wait_for(1, Value::F64(5.0));
    line.cut();
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "the port is gone");
    running.wait_for_link(LinkState::Down, "the port cannot be opened");
    drop(peer);
    line.mend();
    let mut peer = libmodbus.start(&Place::Serial(line.theirs()));
    peer.command("set holding 0 50");
    running.wait_for(1, Value::F64(50.0));
}

#[test]
fn a_port_has_one_master() {
    let Some(line) = Line::lay() else { return };
    let place = Place::Serial(line.theirs());
    let Some(_peer) = Peer::start_at(&place, &units(&[1], 5)) else { return };
    let first = line.start(json!({}), vec![of_unit(1, 1, 0)]);
    first.wait_for(1, Value::F64(5.0));
    let second = line.start(json!({}), vec![of_unit(1, 1, 0)]);
    second.wait_for_link(LinkState::Down, "is no other program using it?");
    assert!(!second.has_good_samples());
}
