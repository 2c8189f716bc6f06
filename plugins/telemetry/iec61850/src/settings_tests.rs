use serde_json::json;

use super::*;

fn parse(json: serde_json::Value) -> Result<Config, Error> {
    serde_json::from_value::<Settings>(json).expect("well-formed").parse()
}

#[test]
fn defaults_are_those_of_the_page() {
    let config = parse(json!({"host": "::1"})).unwrap();
    assert_eq!(config.endpoints[0].to_string(), "[::1]:102");
    let seconds = Duration::from_secs;
    assert_eq!((config.poll, config.timeout), (seconds(1), seconds(5)));
    assert_eq!((config.connect_timeout, config.test), (seconds(10), seconds(10)));
    assert_eq!(config.selectors.remote.t_sel, [0, 1]);
    assert_eq!(config.selectors.remote.s_sel, [0, 1]);
    assert_eq!(config.selectors.remote.p_sel, [0, 0, 0, 1]);
    assert_eq!(config.selectors.remote, config.selectors.local);
    assert!(config.reports.is_empty() && config.password.is_none());
    assert_eq!(config.reconnect.min, seconds(1));
    let with_tls = parse(json!({"host": "a", "tls": {"ca": "/ca.pem"}})).unwrap();
    assert_eq!(with_tls.endpoints[0].port, 3782);
}

#[test]
fn every_fault_is_named() {
    let error = parse(json!({
        "host": " ", "port": 0, "poll_seconds": 0.099, "connect_seconds": 0.001,
        "timeout_seconds": 200, "test_seconds": 0.001,
        "osi": {
            "remote": {"t_selector": "00010", "s_selector": "xy", "ap_title": "1.40.1"},
            "local": {"p_selector": "000000000000000001", "ap_title": "one"}
        },
        "redundancy": [{"host": "b"}, {"host": "b", "port": 3782}, {"host": ""}],
        "reports": [
            {"rcb": "L/LLN0.BR.b01", "integrity_seconds": 0.001},
            {"rcb": "L/LLN0$BR$b01", "buffer_seconds": 4000},
            {"rcb": "L/LLN0.u01"},
            {"rcb": "L/LLN0.RP.u01", "data_set": "ds"}
        ],
        "tls": {"ca": "ca.pem"}
    }))
    .unwrap_err();
    for part in [
        "settings: host: give a name",
        "port: 0 is not within 1 to 65535",
        "poll_seconds: 0.099 is not within 0.1 to 3600",
        "connect_seconds: 0.001 is not within 0.1 to 120",
        "timeout_seconds: 200",
        "test_seconds: 0.001 is not within",
        "osi.remote.t_selector: '00010' is not hexadecimal of at most 4 bytes",
        "osi.remote.s_selector: 'xy'",
        "osi.local.p_selector: '000000000000000001'",
        "osi.remote.ap_title: '1.40.1' is no object identifier",
        "osi.local.ap_title: 'one'",
        "redundancy: b:3782 is named twice",
        "redundancy[2].host: give a name",
        "reports[0].integrity_seconds: 0.001 is not within 0.1 to 3600",
        "reports[1].rcb: L/LLN0$BR$b01 is named twice",
        "reports[1].buffer_seconds: 4000 is not within 0 to 3600",
        "reports[2].rcb: 'L/LLN0.u01' says not whether it is buffered",
        "reports[3].data_set: 'ds' is no data set",
        "tls: 'ca.pem' is no absolute path",
    ] {
        assert!(error.message().contains(part), "{part}: {}", error.message());
    }
}

#[test]
fn a_written_password_is_refused() {
    let settings = json!({"host": "a", "password": "hunter2"});
    let fault = serde_json::from_value::<Settings>(settings).err().unwrap().to_string();
    assert!(!fault.contains("hunter2") && fault.contains("\"env\""), "{fault}");
}
