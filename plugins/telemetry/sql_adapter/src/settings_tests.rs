use serde_json::{Value, json};

use super::*;

fn server() -> Value {
    json!({
        "host": "db.example", "database": "scada", "user": "viewer",
        "password": {"env": "PG_PASSWORD"}, "tls": {"ca": "/etc/ca.pem"}
    })
}

fn settings() -> Value {
    json!({
        "postgres": server(),
        "queries": [{"name": "q", "sql": "SELECT 1", "poll_seconds": 1}]
    })
}

fn parse(settings: &Value) -> Result<Config, String> {
    let settings: Settings =
        serde_json::from_str(&settings.to_string()).map_err(|error| error.to_string())?;
    settings.parse().map_err(|error| error.message().to_owned())
}

/// Settings with one place set otherwise; null takes it away.
fn with(pointer: &str, value: Value) -> Value {
    let mut settings = settings();
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let parent = settings.pointer_mut(parent).unwrap().as_object_mut().unwrap();
    match value {
        Value::Null => parent.remove(name),
        value => parent.insert(name.to_owned(), value),
    };
    settings
}

fn postgres(settings: &Value) -> Postgres {
    match parse(settings).unwrap().database {
        Database::Postgres(postgres) => *postgres,
        Database::Sqlite(path) => panic!("{path:?}"),
    }
}

#[test]
fn encryption_is_the_default_and_what_is_asked_for() {
    let encrypted = postgres(&settings());
    assert_eq!(encrypted.tls.unwrap().server_name, "db.example");
    assert!(postgres(&with("/postgres/sslmode", json!("verify-full"))).tls.is_some());
    let mut plain = with("/postgres/tls", Value::Null);
    let fault = parse(&plain).unwrap_err();
    assert!(fault.contains("needs tls.ca") && fault.contains("\"disable\""), "{fault}");
    plain["postgres"]["sslmode"] = json!("disable");
    assert!(postgres(&plain).tls.is_none());
    // What would be a weaker kind elsewhere is not known.
    for mode in ["prefer", "require", "allow", "verify-ca"] {
        plain["postgres"]["sslmode"] = json!(mode);
        assert!(parse(&plain).unwrap_err().contains("expected `disable` or `verify-full`"));
    }
    let fault = parse(&with("/postgres/sslmode", json!("disable"))).unwrap_err();
    assert!(fault.contains("tls has no effect"), "{fault}");
}

#[test]
fn a_socket_is_not_encrypted() {
    let mut socket = with("/postgres/host", json!("/run/postgresql"));
    assert!(parse(&socket).unwrap_err().contains("Unix socket"));
    socket["postgres"].as_object_mut().unwrap().remove("tls");
    assert!(postgres(&socket).tls.is_none());
    socket["postgres"]["sslmode"] = json!("verify-full");
    assert!(parse(&socket).unwrap_err().contains("Unix socket"));
}

#[test]
fn a_password_is_not_written_here() {
    let fault = parse(&with("/postgres/password", json!("pa55word"))).unwrap_err();
    assert!(fault.contains("{\"env\": \"NAME\"}") && !fault.contains("pa55word"), "{fault}");
}

#[test]
fn faults_name_place_and_remedy() {
    let both = with("/sqlite", json!({"path": "/a.db"}));
    let query = |query: Value| with("/queries", json!([query]));
    let listen =
        |channel: &str, name: &str| with("/listen", json!([{"channel": channel, "query": name}]));
    let mut sqlite = with("/postgres", Value::Null);
    sqlite["sqlite"] = json!({"path": "a.db"});
    sqlite["listen"] = json!([{"channel": "c", "query": "q"}]);
    let twice = json!({"name": "q", "sql": "SELECT 1", "poll_seconds": 1});
    let cases = [
        (both, "one of them"),
        (with("/postgres", Value::Null), "one of them"),
        (with("/queries", json!([])), "give 1 to 256"),
        (with("/queries", json!([twice, twice])), "two of the name 'q'"),
        (query(json!({"name": "q", "sql": " ", "poll_seconds": 1})), "1 to 65536 bytes"),
        (query(json!({"name": "q", "sql": "SELECT 1", "poll_seconds": 0.099})), "0.1 to 86400"),
        (query(json!({"name": "q", "sql": "SELECT 1"})), "has no poll_seconds"),
        (query(json!({"name": "", "sql": "SELECT 1", "poll_seconds": 1})), "1 to 253 bytes"),
        (listen("c", "none"), "there is no query 'none'"),
        (listen(&"c".repeat(64), "q"), "1 to 63 bytes"),
        (with("/timeout_seconds", json!(0)), "0.1 to 600"),
        (with("/reconnect", json!({"min_seconds": 0.5})), "1 to 600"),
        (with("/reconnect", json!({"min_seconds": 5, "max_seconds": 2})), "larger"),
        (with("/postgres/tls", json!({"ca": "ca.pem"})), "'ca.pem' is no absolute path"),
        (with("/postgres/tls", json!({"ca": "/ca", "key": "/key"})), "go together"),
        (with("/postgres/port", json!(0)), "1 to 65535"),
        (with("/postgres/pasword", json!(0)), "unknown field `pasword`"),
        (sqlite.clone(), "'a.db' is no absolute path"),
        (sqlite, "SQLite tells of nothing"),
    ];
    for (settings, expected) in cases {
        let fault = parse(&settings).unwrap_err();
        assert!(fault.contains(expected), "{expected}: {fault}");
    }
}

#[test]
fn a_query_without_a_period_needs_a_channel() {
    let mut settings = with("/queries", json!([{"name": "q", "sql": "SELECT 1"}]));
    settings["listen"] = json!([{"channel": "Values", "query": "q"}]);
    let config = parse(&settings).unwrap();
    assert_eq!(config.channels, [Channel { name: "Values".into(), query: 0 }]);
    assert_eq!(config.queries[0].period, None);
}

/// Alternatives in a schema would blur where a fault is, and hide its remedy.
#[test]
fn the_schema_has_no_alternatives_where_people_go_wrong() {
    let schema = schemars::schema_for!(Settings).to_value();
    for pointer in
        ["/properties/postgres", "/properties/sqlite", "/$defs/RawPostgres/properties/password"]
    {
        let place = schema.pointer(pointer).unwrap();
        assert!(place.get("anyOf").is_none() && place.get("default").is_none(), "{place}");
        assert!(place.get("$ref").is_some(), "{place}");
    }
}
