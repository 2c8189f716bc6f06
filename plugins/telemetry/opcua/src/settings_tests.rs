use serde_json::json;

use super::*;

fn parse(more: serde_json::Value) -> Result<Config, String> {
    let mut all = json!({"url": "opc.tcp://plc"});
    all.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).map_err(|error| error.to_string())?;
    settings.parse().map_err(|error| error.message().to_owned())
}

#[test]
fn a_url_is_enough() {
    let config = parse(json!({})).unwrap();
    assert_eq!(config.servers[0].to_string(), "opc.tcp://plc:4840");
    assert_eq!((config.sampling, config.publishing), (config.publishing, config.sampling));
    assert!(matches!(config.user, User::Anonymous));
    assert!(config.security.is_none() && config.confirm_unchanged);
}

#[test]
fn all_faults_are_told_at_once() {
    let fault = parse(json!({
        "url": "tcp://x", "publishing_seconds": 0.001, "silence_seconds": 0.001, "application_uri": "",
        "redundancy": ["opc.tcp://a", "opc.tcp://a:4840"],
        "user": {"name": "viewer"},
        "security": {"policy": "Basic256Sha256", "certificate": "a.der", "key": "/k.pem", "trusted": "/t"}
    }))
    .unwrap_err();
    for part in [
        "url: 'tcp://x' is no URL",
        "publishing_seconds: 0.001 is not within 0.05 to 60",
        "silence_seconds: 0.001 is not within 0.5 to 600",
        "application_uri: give 1 to 256 bytes",
        "redundancy[1]: 'opc.tcp://a:4840' is named twice",
        "user: give name and password, or certificate and key",
        "security: 'a.der' is no absolute path",
    ] {
        assert!(fault.contains(part), "{part}: {fault}");
    }
}

#[test]
fn deprecated_policies_and_written_passwords_are_refused() {
    let files = json!({"certificate": "/a.der", "key": "/k.pem", "trusted": "/t"});
    let mut security = files.clone();
    security["policy"] = json!("Basic128Rsa15");
    let fault = parse(json!({"security": security})).unwrap_err();
    assert!(fault.contains("Basic256Sha256"), "{fault}");
    let fault = parse(json!({"user": {"name": "a", "password": "pa55word"}})).unwrap_err();
    assert!(!fault.contains("pa55word") && fault.contains("env"), "{fault}");
}
