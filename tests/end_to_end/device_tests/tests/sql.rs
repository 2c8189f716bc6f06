//! Databases in a scene: their values are in the statistics, those no longer confirmed are bad, and
//! the password reaches its plugin alone.

#[allow(dead_code, clippy::unwrap_used)]
#[path = "../../../../plugins/telemetry/sql_adapter/src/tests/cluster.rs"]
mod cluster;

use std::fs;
use std::process::Command;
use std::time::Duration;

use cluster::{Cluster, PASSWORD};
use e2e::{Process, Scene, Stats, available, busbar, finish, wait_for, workspace_path};
use serde_json::{Value, json};

/// Longest wait on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(40);
/// Environment variable that settings name; another one of the viewer follows.
const NAMED: &str = "BUSBAR_TEST_PASSWORD";
const OTHER: &str = "BUSBAR_TEST_OTHER_PASSWORD";
const OTHER_PASSWORD: &str = "nobody asked for this";

const TABLE: &str = "CREATE TABLE latest (key text, value text, quality text, at timestamptz);
    INSERT INTO latest VALUES ('oil', '61.5', 'good', now()), ('breaker', 'SHUT', 'good', now()),
        ('winding', '70.5', 'uncertain', now()), ('old', '1', 'good', now() - interval '1 hour')";

fn scene(settings: Value) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("sql_adapter");
    scene.config["plugins"]["database"] = json!({"plugin": "sql_adapter", "settings": settings});
    let address = |key: &str| json!({"query": "latest", "key": key});
    let mut breaker = address("breaker");
    breaker["states"] = json!({"OPEN": "off", "SHUT": "on"});
    for (id, kind, address) in [
        ("Oil", "f64", address("oil")),
        ("Breaker", "double_point", breaker),
        ("Winding", "f64", address("winding")),
        ("Old", "f64", address("old")),
        ("Missing", "f64", address("missing")),
    ] {
        scene.config["tags"][id] = json!({
            "type": kind, "freshness_seconds": 60,
            "source": {"instance": "database", "address": address}
        });
    }
    scene
}

/// Returns settings that name the password by a variable.
fn settings(cluster: &Cluster) -> Value {
    let sql = "SELECT key, value, quality, at AS time FROM latest";
    let query = json!({"name": "latest", "sql": sql, "poll_seconds": 0.2});
    let mut settings = cluster.settings(&[query]);
    settings["postgres"]["password"] = json!({"env": NAMED});
    settings
}

fn rendering(scene: &Scene, seconds: f64) -> Command {
    let mut command = scene.rendering(seconds);
    command.env(NAMED, PASSWORD).env(OTHER, OTHER_PASSWORD);
    command
}

#[track_caller]
fn check(stats: &Stats, id: &str, value: Value, quality: &str, reason: Option<&str>) {
    let tag = stats.tag(id);
    assert_eq!((&tag.value, tag.quality.as_str()), (&value, quality), "{id}");
    assert_eq!(tag.reason.as_deref(), reason, "{id}");
}

#[test]
fn values_are_those_of_the_database() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    for isolation in ["process", "none"] {
        let mut scene = scene(settings(&cluster));
        scene.config["isolation"] = json!(isolation);
        let output = finish(&mut rendering(&scene, 3.0)).expect_code(0);
        let said = output.stdout + &output.stderr;
        assert!(!said.contains(PASSWORD), "{said}");
        assert!(said.contains("no row has its key"), "{said}");
        let stats = scene.stats();
        check(&stats, "Oil", json!(61.5), "good", None);
        check(&stats, "Breaker", json!("closed"), "good", None);
        check(&stats, "Winding", json!(70.5), "uncertain", Some("no reason given"));
        // Asked for all the time, and an hour old all the same.
        check(&stats, "Old", json!(1.0), "bad", Some("stale"));
        check(&stats, "Missing", Value::Null, "bad", Some("sensor"));
    }
}

#[test]
fn a_server_that_is_killed_or_hangs_leaves_nothing_good() {
    for signal in ["KILL", "STOP"] {
        let Some(cluster) = Cluster::start() else { return };
        cluster.sql(TABLE);
        let mut settings = settings(&cluster);
        settings["timeout_seconds"] = json!(0.5);
        settings["postgres"]["connect_seconds"] = json!(0.5);
        let scene = scene(settings);
        let running = Process::start(&mut rendering(&scene, 12.0));
        wait_for("a session of the viewer's that has asked", PATIENCE, || {
            let asked = "SELECT count(*) FROM pg_stat_activity WHERE application_name = 'busbar'
                         AND (query LIKE '%FROM latest%' OR query IN ('ROLLBACK', 'COMMIT'))";
            (cluster.sql(asked).trim() == "1").then_some(())
        });
        cluster.signal(signal);
        running.finish().expect_code(0);
        for (id, tag) in scene.stats().tags() {
            let found = (tag.quality.as_str(), tag.reason.as_deref());
            assert_eq!(found, ("bad", Some("communication")), "{id} after {signal}");
        }
        let kept = scene.stats().tag("Oil").value;
        assert_eq!(kept, json!(61.5), "the last value stays");
    }
}

#[test]
fn a_password_reaches_its_plugin_and_no_other() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let scene = scene(settings(&cluster));
    let viewer = Process::start(&mut rendering(&scene, 8.0));
    let environments = wait_for("processes of both plugins", PATIENCE, || {
        let found: Vec<_> = children(viewer.id())
            .into_iter()
            .filter_map(|pid| {
                let read = |name| fs::read(format!("/proc/{pid}/{name}")).ok();
                let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
                Some((text(read("maps")?), text(read("environ")?)))
            })
            .collect();
        let is_loaded = found
            .iter()
            .any(|(maps, seen)| maps.contains("libsql_adapter") && seen.contains(NAMED));
        let is_other_there = found.iter().any(|(maps, _)| maps.contains("libquadric_collapse"));
        (is_loaded && is_other_there).then_some(found)
    });
    for (maps, environment) in &environments {
        let names: Vec<_> =
            environment.split('\0').filter_map(|line| Some(line.split_once('=')?.0)).collect();
        assert!(!environment.contains(OTHER_PASSWORD), "{names:?}");
        assert!(!names.contains(&"XDG_CACHE_HOME"), "the viewer has it: {names:?}");
        if names.contains(&NAMED) {
            assert!(maps.contains("libsql_adapter"), "{names:?}");
        } else {
            assert!(!environment.contains(PASSWORD), "{names:?}");
        }
    }
    viewer.finish().expect_code(0);
    check(&scene.stats(), "Oil", json!(61.5), "good", None);
}

#[test]
fn a_password_in_the_settings_is_refused_and_not_shown() {
    let secret = "hunter2 in plain sight";
    for isolation in ["process", "none"] {
        let mut scene = scene(json!({
            "postgres": {
                "host": "127.0.0.1", "database": "d", "user": "u", "password": secret,
                "sslmode": "disable"
            },
            "queries": [{"name": "latest", "sql": "SELECT 1", "poll_seconds": 1}]
        }));
        scene.config["isolation"] = json!(isolation);
        let output = finish(busbar().arg("check").arg(scene.write())).expect_code(1);
        let said = output.stdout + &output.stderr;
        assert!(
            said.contains("/postgres/password") && said.contains("{\"env\": \"NAME\"}"),
            "{said}"
        );
        assert!(!said.contains(secret), "{said}");

        let settings = &mut scene.config["plugins"]["database"]["settings"];
        settings["postgres"]["password"] = json!({"env": "LD_PRELOAD"});
        let output = finish(busbar().arg("check").arg(scene.write()));
        let said = output.stdout + &output.stderr;
        assert!(isolation == "none" || said.contains("use another name"), "{said}");
    }
}

/// Written by Python's SQLite, read by ours.
#[test]
fn a_file_is_read() {
    let python = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| workspace_path("target/venv/bin/python"), Into::into);
    let script = "import sqlite3, sys
connection = sqlite3.connect(sys.argv[1])
connection.executescript('''
    CREATE TABLE latest (key, value, quality, at);
    INSERT INTO latest VALUES ('oil', 61.5, 192, datetime('now')), ('breaker', 'SHUT', 192, NULL)
''')";
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("values.db");
    let written = Command::new(python).args(["-c", script]).arg(&path).status();
    let is_written = written.is_ok_and(|status| status.success());
    if !available(is_written, "no Python with sqlite3: run `cargo xtask test`") {
        return;
    }
    let sql = "SELECT key, value, quality, at AS time FROM latest";
    let scene = scene(json!({
        "sqlite": {"path": path},
        "queries": [{"name": "latest", "sql": sql, "poll_seconds": 0.2}]
    }));
    finish(&mut rendering(&scene, 2.0)).expect_code(0);
    let stats = scene.stats();
    check(&stats, "Oil", json!(61.5), "good", None);
    check(&stats, "Breaker", json!("closed"), "uncertain", Some("no reason given"));
    check(&stats, "Missing", Value::Null, "bad", Some("sensor"));
}

fn children(parent: u32) -> Vec<u32> {
    let listed = fs::read_dir("/proc").expect("there are processes");
    let pids = listed.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    pids.filter(|pid| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        let after_name = stat.rsplit(')').next().unwrap_or_default();
        after_name.split_whitespace().nth(1) == Some(&parent.to_string())
    })
    .collect()
}
