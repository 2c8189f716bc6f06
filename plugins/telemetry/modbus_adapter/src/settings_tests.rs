use serde_json::json;

use super::*;
use crate::transport::Parity;

fn parse(json: serde_json::Value) -> Result<Config, Error> {
    serde_json::from_value::<Settings>(json).expect("well-formed").parse()
}

fn check_fault(json: serde_json::Value, parts: &[&str]) {
    let error = parse(json).unwrap_err();
    for part in parts {
        assert!(error.message().contains(part), "{part} in {error}");
    }
}

#[test]
fn defaults_are_as_documented() {
    let config = parse(json!({"host": "::1"})).unwrap();
    assert_eq!(config.transport.to_string(), "[::1]:502");
    assert_eq!(config.unit, 1);
    assert_eq!(config.timeout, Duration::from_secs(1));
    assert_eq!(config.reconnect.min, Duration::from_secs(1));
    assert_eq!(config.reconnect.max, Duration::from_secs(30));
    assert_eq!(config.group_periods, [Duration::from_secs(1)]);
}

#[test]
fn an_encrypted_connection_has_a_port_of_its_own() {
    let config = parse(json!({"host": "a", "tls": {"ca": "/ca.pem"}})).unwrap();
    assert_eq!(config.transport.to_string(), "a:802");
    let config = parse(json!({"host": "a", "port": 1, "tls": {"ca": "/ca.pem"}})).unwrap();
    assert_eq!(config.transport.to_string(), "a:1");
}

#[test]
fn a_serial_line_begins_as_the_standard_says() {
    let line = |json| match parse(json!({ "serial": json })).unwrap().transport {
        Transport::Serial(line) => line,
        other => panic!("{other:?}"),
    };
    let usual = line(json!({"device": "/dev/ttyUSB0"}));
    assert_eq!((usual.baud_rate, usual.parity), (19_200, Parity::Even));
    assert!(!usual.has_two_stop_bits);
    assert!(line(json!({"device": "/dev/ttyS1", "parity": "none"})).has_two_stop_bits);
    let short = json!({"device": "/dev/ttyS1", "parity": "none", "stop_bits": 1});
    assert!(!line(short).has_two_stop_bits);
    // 3.5 characters of 11 bits; never less than 1.75 ms.
    assert_eq!(usual.silence().as_micros(), 2005);
    let fast = line(json!({"device": "/dev/ttyS1", "baud_rate": 115_200}));
    assert_eq!(fast.silence().as_micros(), 1750);
    assert_eq!(usual.transmission(256).as_millis(), 146);
}

#[test]
fn every_fault_is_named() {
    check_fault(
        json!({
            "host": " ", "port": 0, "poll_seconds": 0.049, "timeout_seconds": 0,
            "reconnect": {"min_seconds": 3, "max_seconds": 2},
            "poll_groups": {"fast": {"poll_seconds": 0.001}, "": {"poll_seconds": 0.05}},
            "tls": {"ca": "ca.pem", "key": "/key.pem"}
        }),
        &[
            "host: give a name",
            "port: 0",
            "poll_seconds: 0.049",
            "timeout_seconds: 0",
            "min_seconds is larger",
            "poll_groups.fast.poll_seconds: 0.001 is not within 0.05 to 86400",
            "a group needs a name",
            "tls: certificate and key go together",
            "tls: 'ca.pem' is no absolute path",
        ],
    );
}

#[test]
fn there_is_one_transport() {
    check_fault(json!({}), &["host: give the device's name", "or give serial"]);
    check_fault(json!({"host": "a", "serial": {"device": "/dev/ttyS0"}}), &["host, serial: "]);
    check_fault(
        json!({"serial": {"device": "/dev/ttyS0"}, "port": 502, "tls": {"ca": "/ca.pem"}}),
        &["port: belongs to host", "tls: belongs to host"],
    );
}

#[test]
fn a_serial_line_that_cannot_be_is_told() {
    check_fault(
        json!({"unit": 248, "serial": {
            "device": "ttyS0", "baud_rate": 200, "data_bits": 7, "stop_bits": 3
        }}),
        &[
            "unit: 248 is not within 1 to 247",
            "serial.device: 'ttyS0' is no absolute path",
            "serial.baud_rate: 200 is not within 300 to 4000000",
            "serial.data_bits: Modbus RTU needs 8, not 7",
            "serial.stop_bits: 3 is not within 1 to 2",
        ],
    );
}

#[test]
fn the_schema_describes_each_setting() {
    let schema = serde_json::to_value(schemars::schema_for!(Settings)).unwrap();
    for (name, property) in schema["properties"].as_object().unwrap() {
        assert!(property["description"].is_string(), "{name} has no description");
    }
    assert_eq!(schema["properties"]["poll_seconds"]["minimum"], 0.05);
    assert_eq!(schema["additionalProperties"], false);
}
