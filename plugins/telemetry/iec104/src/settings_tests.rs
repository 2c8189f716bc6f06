use serde_json::json;

use super::*;

fn parse(json: serde_json::Value) -> Result<Config, Error> {
    serde_json::from_value::<Settings>(json).expect("well-formed").parse()
}

#[test]
fn defaults_are_those_of_the_standard() {
    let config = parse(json!({"host": "::1"})).unwrap();
    assert_eq!(config.endpoints[0].to_string(), "[::1]:2404");
    let seconds = Duration::from_secs;
    let expected = Parameters { k: 12, w: 8, t1: seconds(15), t2: seconds(10), t3: seconds(20) };
    assert_eq!(config.parameters, expected);
    assert_eq!(config.connect_timeout, seconds(30));
    assert_eq!((config.common_address, config.originator), (1, 0));
    assert_eq!(config.zone, Zone::Utc);
    assert!(config.interrogate_on_start && config.clock_sync_period.is_none());
    assert!(config.interrogation_period.is_none() && config.counter_period.is_none());
    assert_eq!(config.reconnect.min, seconds(1));
    assert!(config.tls.is_none());
}

#[test]
fn every_fault_is_named() {
    let error = parse(json!({
        "host": " ", "port": 0, "common_address": 65535, "k": 0, "w": 40000,
        "t0_seconds": 0.001, "t1_seconds": 1, "t2_seconds": 1, "t3_seconds": 0.099,
        "interrogation_period_seconds": 0.999, "counter_period_seconds": 0,
        "clock_sync_period_seconds": 90_000, "utc_offset_minutes": 900,
        "ignored_types": [200, 36],
        "reconnect": {"min_seconds": 1.7, "max_seconds": 1.65},
        "redundancy": [{"host": "b"}, {"host": "b", "port": 2404}, {"host": ""}],
        "tls": {"ca": "ca.pem", "certificate": "/c.pem"}
    }))
    .unwrap_err();
    for part in [
        "; host: give a name",
        "; port: 0 is not within 1 to 65535",
        "common_address: 65535 is not within 1 to 65534",
        "k: 0 is not within 1 to 32767",
        "w: 40000 is not within 1 to 32767",
        "t0_seconds: 0.001 is not within 0.1 to 255",
        "t2_seconds: must be less than t1_seconds",
        "t3_seconds: 0.099 is not within 0.1 to 172800",
        "interrogation_period_seconds: 0.999 is not within 1 to 86400",
        "counter_period_seconds: 0",
        "clock_sync_period_seconds: 90000",
        "utc_offset_minutes: 900 is not within -840 to 840",
        "ignored_types: 36 is a type of values",
        "reconnect: min_seconds is larger",
        "redundancy: b:2404 is named twice",
        "redundancy[2].host: give a name",
        "tls: certificate and key go together",
        "tls: 'ca.pem' is no absolute path",
    ] {
        assert!(error.message().contains(part), "{part}: {}", error.message());
    }
}

#[test]
fn too_many_connections_are_refused() {
    let redundancy: Vec<_> = (0..8).map(|i| json!({"host": format!("h{i}")})).collect();
    let error = parse(json!({"host": "a", "redundancy": redundancy})).unwrap_err();
    assert!(error.message().contains("9 connections; at most 8"), "{}", error.message());
}
