//! Against libmodbus, another independent implementation.

use super::line::Line;
use super::peer::{Libmodbus, Peer, Place, free_port};
use super::*;

/// Gives a server the values of [`types::values`].
fn fill(peer: &mut Peer) {
    for (table, cells) in types::values().as_object().unwrap() {
        for (address, values) in cells.as_object().unwrap() {
            let values = values.as_array().unwrap().iter();
            let values: Vec<_> = values.map(ToString::to_string).collect();
            peer.command(&format!("set {table} {address} {}", values.join(" ")));
        }
    }
}

#[test]
fn every_type_is_read_as_the_server_has_it() {
    let Some(libmodbus) = Libmodbus::compile() else { return };
    let mut peer = libmodbus.start(&Place::Tcp(free_port()));
    fill(&mut peer);
    types::check(json!({"host": "127.0.0.1", "port": peer.port}));
}

#[test]
fn every_type_is_read_over_a_serial_line() {
    let (Some(libmodbus), Some(line)) = (Libmodbus::compile(), Line::lay()) else { return };
    let mut peer = libmodbus.start(&Place::Serial(line.theirs()));
    fill(&mut peer);
    types::check(line.settings());
}

#[test]
fn a_killed_server_makes_tags_bad_and_a_restarted_one_good() {
    let Some(libmodbus) = Libmodbus::compile() else { return };
    let place = Place::Tcp(free_port());
    let mut peer = libmodbus.start(&place);
    peer.command("set holding 0 5");
    let running = start(peer.port, json!({}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(5.0));
    drop(peer);
    running.wait_for_bad(1, Reason::Communication);
    let mut peer = libmodbus.start(&place);
    peer.command("set holding 0 50");
    running.wait_for(1, Value::F64(50.0));
}

#[test]
#[cfg(target_os = "linux")]
fn a_stopped_server_makes_tags_bad_within_the_deadline() {
    let Some(libmodbus) = Libmodbus::compile() else { return };
    let mut peer = libmodbus.start(&Place::Tcp(free_port()));
    peer.command("set holding 0 5");
    let running = start(peer.port, json!({"timeout_seconds": 0.2}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(5.0));
    peer.signal("STOP");
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "no answer within 200 ms");
    peer.signal("CONT");
    running.wait_for(1, Value::F64(5.0));
}
