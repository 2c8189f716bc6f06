use serde_json::json;

use super::*;

fn parse(json: serde_json::Value) -> Result<Config, Error> {
    serde_json::from_value::<Settings>(json).expect("well-formed").parse()
}

#[test]
fn the_plain_settings_say_nothing_to_anybody() {
    let config = parse(json!({"host": "::1"})).unwrap();
    assert_eq!(config.brokers[0].to_string(), "[::1]:1883");
    assert_eq!((config.version, config.qos), (Version::V4, 1));
    assert_eq!(config.keep_alive, Duration::from_secs(10));
    assert!(!config.requests_rebirth && config.primary_host.is_none());
    assert_eq!(config.retained, Retained::Uncertain);
    let encrypted = json!({"host": "a", "tls": {"ca": "/ca.pem"}, "cluster": [{"host": "b"}]});
    let ports: Vec<_> = parse(encrypted).unwrap().brokers.iter().map(|b| b.port).collect();
    assert_eq!(ports, [8883, 8883]);
}

#[test]
fn every_fault_is_named() {
    let error = parse(json!({
        "host": " ", "port": 0, "keep_alive_seconds": 1, "timeout_seconds": 0.001, "qos": 3,
        "max_payload_bytes": 1, "subscriptions": ["a/#/b", "a+"], "client_id": "",
        "cluster": [{"host": "b"}, {"host": "b", "port": 8883}],
        "availability": [
            {"topic": "a/+", "covers": "", "pointer": "x", "online": []},
            {"topic": "b", "covers": "b/#"}, {"topic": "b", "covers": "c/#"}
        ],
        "sparkplug": {"primary_host": "a/b"},
        "tls": {"ca": "ca.pem"}
    }))
    .unwrap_err();
    for part in [
        "host: give a name",
        "port: 0 is not within",
        "keep_alive_seconds: 1 is not within 2 to 600",
        "timeout_seconds: 0.001 is not within 0.1 to 60",
        "qos: 3 is not within 0 to 2",
        "max_payload_bytes: 1 is not within 1024 to 16777216",
        "subscriptions[0]: 'a/#/b' is no topic filter",
        "subscriptions[1]: 'a+'",
        "client_id: give 1",
        "cluster: b:8883 is named twice",
        "availability[0].topic: 'a/+' has a wildcard",
        "availability[0].covers: ''",
        "availability[0].pointer: 'x' is no JSON pointer",
        "availability[0].online: name a state",
        "availability[2].topic: 'b' is named twice",
        "sparkplug.primary_host: give 1 to 200 bytes",
        "tls: 'ca.pem' is no absolute path",
    ] {
        assert!(error.message().contains(part), "{part}: {}", error.message());
    }
}

#[test]
fn a_password_is_never_written_into_settings() {
    let settings = json!({"host": "a", "login": {"username": {"env": "U"}, "password": "pa55"}});
    let fault = serde_json::from_value::<Settings>(settings).unwrap_err().to_string();
    assert!(!fault.contains("pa55") && fault.contains("\"env\""), "{fault}");
}

#[test]
fn words_of_availability_are_the_settings_or_the_usual_ones() {
    let words = |more: serde_json::Value| {
        let mut entry = json!({"topic": "s", "covers": "s/#"});
        entry.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        let config = parse(json!({"host": "a", "availability": [entry]}))?;
        let availability = config.availability[0].clone();
        Ok::<_, Error>((availability.online, availability.offline))
    };
    let (online, offline) = words(json!({})).unwrap();
    assert!(online.contains("connected") && offline.contains("down"));
    // An inverted state: what the settings say is no usual word any more.
    let (online, offline) = words(json!({"online": ["0", " Standby "]})).unwrap();
    assert!(online.contains("0") && online.contains("standby") && online.len() == 2);
    assert!(!offline.contains("0") && offline.contains("offline"));
    let (online, offline) = words(json!({"offline": ["TRUE"]})).unwrap();
    assert!(!online.contains("true") && online.contains("up") && offline.contains("true"));
    let fault = words(json!({"online": ["on", "1.0"], "offline": ["1", "off"]})).unwrap_err();
    assert!(fault.message().contains("availability[0]: '1' is in online and in offline"));
    let fault = words(json!({"offline": []})).unwrap_err();
    assert!(fault.message().contains("offline: name a state in which the source is gone"));
    let many: Vec<_> = (0..21).map(|n| n.to_string()).collect();
    assert!(words(json!({"online": many})).unwrap_err().message().contains("at most 20"));
}
