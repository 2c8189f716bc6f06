//! Rows and servers that mean harm.

use std::io::{Read, Write};
use std::net::TcpListener;

use super::cluster::Cluster;
use super::*;

#[test]
fn a_row_that_is_too_long_takes_only_its_query_out() {
    let Some(cluster) = Cluster::start() else { return };
    let settings = cluster.settings(&[
        query("good", "SELECT 1 AS v"),
        query("huge", "SELECT repeat('x', 30000000) AS v"),
    ]);
    let tags = vec![column(1, "good", "v", ValueKind::I64), column(2, "huge", "v", ValueKind::F64)];
    let running = start(settings, tags);
    running.wait_for_link(LinkState::Down, "a row of 300000");
    running.wait_for_link(LinkState::Up, "query 'huge': its answer was too long");
    running.recorder.clear();
    running.wait_for(1, Value::I64(1));
    running.wait_for(1, Value::I64(1));
    let recording = running.recorder.recording();
    assert!(recording.latest(2).is_none_or(|sample| !sample.quality.is_good()));
    assert!(recording.links.iter().all(|(state, _)| *state == LinkState::Up), "{recording:?}");
}

#[test]
fn a_million_rows_are_not_kept() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(
        "CREATE TABLE many AS SELECT 'K' || g AS key, g::float8 AS value, repeat('x', 200) AS more
         FROM generate_series(1, 1000000) g",
    );
    let settings = cluster.settings(&[
        query("all", "SELECT * FROM many"),
        query("limit", "SELECT * FROM many ORDER BY value LIMIT 100000"),
        query("good", "SELECT 'a' AS key, 1 AS value"),
    ]);
    let mut settings = settings;
    settings["timeout_seconds"] = json!(30);
    let before = peak_bytes();
    let running = start(
        settings,
        vec![
            key(1, "all", "K1", ValueKind::F64),
            key(2, "limit", "K100000", ValueKind::F64),
            key(3, "good", "a", ValueKind::F64),
        ],
    );
    running.wait_for_bad(1, Reason::Configuration);
    running.wait_for_link(LinkState::Up, "query 'all': it gave more than 100000 rows");
    running.wait_for(2, Value::F64(100_000.0));
    running.wait_for(3, Value::F64(1.0));
    let grown = peak_bytes() - before;
    println!("{} KiB more for a million rows of 200 bytes", grown >> 10);
    assert!(grown < 32 << 20, "{grown} bytes more at the most");
}

/// The most memory that this process had in RAM.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

/// A server that asks for the password in clear text does not get it.
#[test]
fn a_password_is_never_sent_in_clear_text() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("password");
    std::fs::write(&path, "pa55word").unwrap();
    std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
    let settings = json!({
        "postgres": {"host": "127.0.0.1", "port": port, "database": "d", "user": "u",
            "password": {"file": path}, "sslmode": "disable"},
        "queries": [query("q", "SELECT 1 AS v")],
    });
    let running = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    let (mut stream, _) = listener.accept().unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut received = vec![0; 4];
    stream.read_exact(&mut received).unwrap();
    // AuthenticationCleartextPassword.
    stream.write_all(b"R\0\0\0\x08\0\0\0\x03").unwrap();
    let _ = stream.read_to_end(&mut received);
    let received = String::from_utf8_lossy(&received);
    assert!(received.contains("user") && !received.contains("pa55word"), "{received}");
    running.wait_for_link(LinkState::Down, "in clear text");
}

/// A server that says anything at all.
#[test]
fn noise_is_survived() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let settings = json!({
        "postgres": {"host": "127.0.0.1", "port": port, "database": "d", "user": "u",
            "sslmode": "disable"},
        "queries": [query("q", "SELECT 1 AS v")],
    });
    let running = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    let answers: [&[u8]; 4] = [
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"R\xff\xff\xff\xff",
        b"R\0\0\0\x08\0\0\0\0Z\0\0\0\x05ID\0\0\0\x02",
        b"E\0\0\0\x05\0",
    ];
    for answer in answers {
        running.recorder.clear();
        let (mut stream, _) = listener.accept().unwrap();
        stream.write_all(answer).unwrap();
        drop(stream);
        running.wait_for_link(LinkState::Down, "next try in");
    }
    assert!(!running.has_good_samples());
}
