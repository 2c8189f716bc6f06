//! Servers that die, hang, come back, or do not let us in.

use std::net::TcpListener;
use std::time::Instant;

use super::cluster::{Cluster, PASSWORD, is_free};
use super::*;

const LATEST: &str =
    "CREATE TABLE latest (key text, value int); INSERT INTO latest VALUES ('a', 1)";

fn running(cluster: &Cluster) -> Running {
    let settings = cluster.settings(&[query("latest", "SELECT key, value FROM latest")]);
    start(settings, vec![key(1, "latest", "a", ValueKind::I64)])
}

#[test]
fn a_server_that_is_killed_and_comes_back_is_found_again() {
    let Some(mut cluster) = Cluster::start() else { return };
    cluster.sql(LATEST);
    let running = running(&cluster);
    running.wait_for(1, Value::I64(1));
    cluster.kill();
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "next try in");
    cluster.restart();
    cluster.sql("UPDATE latest SET value = 2");
    running.wait_for(1, Value::I64(2));

    // An orderly end says so.
    running.recorder.clear();
    cluster.shut_down();
    running.wait_for_link(LinkState::Down, "terminating connection");
    cluster.restart();
    running.wait_for(1, Value::I64(2));
}

#[test]
fn a_session_that_is_ended_is_begun_anew() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(LATEST);
    let running = running(&cluster);
    running.wait_for(1, Value::I64(1));
    running.recorder.clear();
    let ended = cluster.sql(
        "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'busbar'",
    );
    assert_eq!(ended.trim(), "1", "one connection, under its name");
    running.wait_for_link(LinkState::Down, "terminating connection");
    running.wait_for(1, Value::I64(1));
}

#[test]
fn a_server_that_hangs_leaves_nothing_good_within_the_limit() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(LATEST);
    // One that polls, and one that waits for notifications and asks for a sign of life.
    let polling = running(&cluster);
    let mut quiet = cluster.settings(&[json!({"name": "latest", "sql": "TABLE latest"})]);
    quiet["listen"] = json!([{"channel": "values", "query": "latest"}]);
    let listening = start(quiet, vec![key(1, "latest", "a", ValueKind::I64)]);
    for running in [&polling, &listening] {
        running.wait_for(1, Value::I64(1));
    }
    let stopped = Instant::now();
    cluster.signal("STOP");
    polling.wait_for_bad(1, Reason::Communication);
    listening.wait_for_bad(1, Reason::Communication);
    // The limit is keep_alive_seconds + timeout_seconds + a second, 3.5 s; a loaded machine
    // may take longer.
    let took = stopped.elapsed();
    assert!(took < PATIENCE, "{took:?}");
    polling.wait_for_link(LinkState::Down, "query 'latest' was not answered within 3000 ms");
    listening.wait_for_link(LinkState::Down, "a keepalive was not answered");
    cluster.signal("CONT");
    for running in [&polling, &listening] {
        running.wait_for(1, Value::I64(1));
    }
    println!("bad {took:?} after the server was stopped");
}

#[test]
fn nobody_is_told_a_password() {
    let Some(cluster) = Cluster::start() else { return };
    let wrong = "wr0ng password";
    let mut settings = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    settings["postgres"]["password"] = json!({"file": cluster.secret("wrong", wrong)});
    let tag = || vec![column(1, "q", "v", ValueKind::I64)];
    let running = start(settings.clone(), tag());
    running.wait_for_link(LinkState::Down, "password authentication failed for user \"viewer\"");
    running.wait_for_link(LinkState::Down, "postgres.password in the settings");
    running.wait_for_bad(1, Reason::Communication);
    let said = format!("{:?}", running.recorder.recording().links);
    assert!(!said.contains(wrong) && !running.has_good_samples(), "{said}");
    // The file is read each time: put right, it lets us in.
    cluster.secret("wrong", PASSWORD);
    running.wait_for(1, Value::I64(1));

    // What cannot be read is told at the start.
    settings["postgres"]["password"] = json!({"env": "BUSBAR_NO_SUCH_VARIABLE"});
    let fault = create(settings).start(tag(), Recorder::new().sink()).unwrap_err();
    let words = "postgres.password: environment variable BUSBAR_NO_SUCH_VARIABLE: it is not set";
    assert!(fault.message().starts_with(words), "{fault}");
}

#[test]
fn what_is_not_there_is_named() {
    let Some(cluster) = Cluster::start() else { return };
    let tag = || vec![column(1, "q", "v", ValueKind::I64)];
    let mut no_database = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    no_database["postgres"]["database"] = json!("no_such_database");
    let mut no_user = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    no_user["postgres"]["user"] = json!("nobody_at_all");
    let mut no_server = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    assert!(is_free(port));
    no_server["postgres"]["port"] = json!(port);
    let mut no_socket = no_server.clone();
    no_socket["postgres"]["host"] = json!("/no/such/folder");
    for (settings, words) in [
        (no_database, "see postgres.database"),
        (no_user, "nobody_at_all"),
        (no_server, "connection refused"),
        (no_socket, "entity not found"),
    ] {
        let running = start(settings, tag());
        running.wait_for_link(LinkState::Down, words);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
}

/// Tries do not come more often than once a second, whatever the server does.
#[test]
fn tries_are_at_least_a_second_apart() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let settings = json!({
        "postgres": {"host": "127.0.0.1", "port": port, "database": "d", "user": "u",
            "sslmode": "disable"},
        "queries": [query("q", "SELECT 1 AS v")],
    });
    let running = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    let times: Vec<_> = (0..4)
        .map(|_| {
            // Hung up on at once.
            drop(listener.accept().unwrap());
            Instant::now()
        })
        .collect();
    for pair in times.windows(2) {
        let gap = pair[1] - pair[0];
        assert!(gap > Duration::from_millis(950), "{gap:?}");
    }
    running.wait_for_bad(1, Reason::Communication);
}

#[test]
fn stopping_does_not_wait_for_a_server() {
    let Some(cluster) = Cluster::start() else { return };
    let settings = cluster.settings(&[query("q", "SELECT 1 AS v FROM pg_sleep(60)")]);
    let mut running = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    running.wait_for_link(LinkState::Up, "connected");
    running.plugin.stop();
    let threads = std::fs::read_dir("/proc/self/task").unwrap().flatten();
    let names = threads.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    let left: Vec<_> = names.filter(|name| name.trim() == "postgres").collect();
    assert!(left.is_empty(), "{left:?}");
}
