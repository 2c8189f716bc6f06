//! Recordings in a scene: their values are in the statistics, and no value is good after their end.

use std::fs;
use std::path::PathBuf;

use e2e::stats::Tag;
use e2e::{Scene, Stats, busbar, finish};
use serde_json::{Value, json};

/// Samples a second of the COMTRADE recording.
const HERTZ: u64 = 100;

/// Returns a scene with these tags from one recording.
fn scene(file: &str, text: &str, settings: Value, tags: &[(&str, &str, Value)]) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("replay");
    let path = scene.path(file);
    fs::write(&path, text).expect("it can be written");
    let mut all = json!({ "file": path });
    let fields = settings.as_object().expect("settings are an object").clone();
    all.as_object_mut().expect("it is one too").extend(fields);
    scene.config["plugins"]["recording"] = json!({ "plugin": "replay", "settings": all });
    for (id, kind, address) in tags {
        scene.config["tags"][*id] = json!({
            "type": kind, "freshness_seconds": 60,
            "source": { "instance": "recording", "address": address }
        });
    }
    scene
}

/// Shows a scene for some seconds; returns the output and the statistics.
fn render(scene: &Scene, seconds: f64) -> (String, Stats) {
    let stats: PathBuf = scene.path("stats.json");
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "320x180"]);
    command.arg("--out").arg(scene.path("picture.png")).arg("--stats").arg(&stats);
    let output = finish(command.args(["--seconds", &seconds.to_string()])).expect_code(0);
    (output.stdout + &output.stderr, Stats::read(&stats))
}

/// Returns a COMTRADE file of 2013 for `seconds` of 100 Hz: configuration, and data of a current,
/// its number, a breaker of two contacts.
fn comtrade(seconds: u64) -> (String, String) {
    let samples = seconds * HERTZ;
    let cfg = format!(
        "Nord,REC,2013\r\n4,2A,2D\r\n1,IA,A,,A,0.25,10,0,-32767,32767,600,5,S\r\n\
         2,N,,,,1,0,0,-32767,32767,1,1,P\r\n1,CB_OFF,,,0\r\n2,CB_ON,,,0\r\n50\r\n1\r\n\
         {HERTZ},{samples}\r\n29/02/2024,13:14:15.000000\r\n29/02/2024,13:14:16.000000\r\n\
         ASCII\r\n1\r\n0,0\r\n0,0\r\n"
    );
    let row = |n: u64| format!("{n},{},880,{n},0,1\r\n", (n - 1) * 1_000_000 / HERTZ);
    (cfg, (1..=samples).map(row).collect())
}

fn is_good(tag: &Tag, value: Value) {
    assert_eq!((&tag.value, tag.quality.as_str(), &tag.reason), (&value, "good", &None));
}

#[test]
fn values_are_those_of_the_recording() {
    let (cfg, data) = comtrade(60);
    let tags = [
        ("I", "f64", json!({ "channel": "IA" })),
        ("IPrimary", "f64", json!({ "channel": 1, "values": "primary" })),
        ("N", "i64", json!({ "channel": "N" })),
        ("Off", "bool", json!({ "channel": "CB_OFF" })),
        ("Q1", "double_point", json!({ "off": "CB_OFF", "on": "CB_ON" })),
    ];
    for isolation in ["process", "none"] {
        let mut scene = scene("fault.cfg", &cfg, json!({ "start": 10 }), &tags);
        fs::write(scene.path("fault.dat"), &data).expect("it can be written");
        scene.config["isolation"] = json!(isolation);
        scene.config["plugins"]["recording"]["network"] = json!(false);
        let (_, stats) = render(&scene, 2.0);
        is_good(&stats.tag("I"), json!(230.0));
        is_good(&stats.tag("IPrimary"), json!(27_600.0));
        is_good(&stats.tag("Off"), json!(false));
        is_good(&stats.tag("Q1"), json!("closed"));
        // It began at 10 s; it is less than 60 s ahead, or it would have ended.
        let number = stats.tag("N").value.as_u64().expect("a number");
        assert!((10 * HERTZ + 1..60 * HERTZ).contains(&number), "{number}");
        assert!(stats.tag("N").age.is_some_and(|age| age < 10.0));
    }
}

const TABLE: &str = "time;Oil;Fan\n0;55,5;on\n0,1;55,5;on\n0,2;55,5;on\n";

fn table(settings: Value) -> Scene {
    let mut all = json!({ "csv": { "time_format": "seconds", "delimiter": ";", "decimal": "," } });
    let fields = settings.as_object().expect("settings are an object").clone();
    all.as_object_mut().expect("it is one too").extend(fields);
    let tags =
        [("Oil", "f64", json!({ "column": "Oil" })), ("Fan", "bool", json!({ "column": 3 }))];
    scene("log.csv", TABLE, all, &tags)
}

#[test]
fn a_recording_that_ends_leaves_nothing_good() {
    let (said, stats) = render(&table(json!({})), 2.0);
    assert!(said.contains("REPLAY, not live"), "{said}");
    assert!(said.contains("the recording has ended"), "{said}");
    for (id, tag) in stats.tags() {
        let found = (tag.quality.as_str(), tag.reason.as_deref());
        assert_eq!(found, ("bad", Some("communication")), "{id}");
    }
    assert_eq!(stats.tag("Oil").value, json!(55.5), "the last value stays");
}

#[test]
fn a_row_that_cannot_be_read_leaves_no_value_good() {
    let text = "time,Oil,Fan\n0,55.5,on\nsoon,98,on\n600,60,on\n";
    let settings = json!({ "csv": { "time_format": "seconds" } });
    let tags =
        [("Oil", "f64", json!({ "column": "Oil" })), ("Fan", "bool", json!({ "column": "Fan" }))];
    let (said, stats) = render(&scene("log.csv", text, settings, &tags), 2.0);
    assert!(said.contains("line 3: 'soon' is not a number of seconds"), "{said}");
    for (id, value) in [("Oil", json!(55.5)), ("Fan", json!(true))] {
        let tag = stats.tag(id);
        assert_eq!((tag.quality.as_str(), tag.reason.as_deref()), ("bad", Some("sensor")), "{id}");
        assert_eq!(tag.value, value, "the last value stays");
    }
}

#[test]
fn a_loop_goes_on() {
    let (_, stats) = render(&table(json!({ "loop": true })), 2.0);
    is_good(&stats.tag("Oil"), json!(55.5));
    is_good(&stats.tag("Fan"), json!(true));
}

#[test]
fn a_recording_of_long_ago_is_stale_by_its_own_times() {
    let (cfg, data) = comtrade(60);
    let tags = [("I", "f64", json!({ "channel": "IA" }))];
    let scene = scene("fault.cfg", &cfg, json!({ "times": "original" }), &tags);
    fs::write(scene.path("fault.dat"), &data).expect("it can be written");
    let (_, stats) = render(&scene, 1.0);
    let tag = stats.tag("I");
    assert_eq!((tag.quality.as_str(), tag.reason.as_deref()), ("bad", Some("stale")));
    assert_eq!(tag.value, json!(230.0));
    assert!(tag.age.is_some_and(|age| age > 86_400.0));
}

#[test]
fn what_is_wrong_is_said_where_it_is() {
    let (cfg, data) = comtrade(1);
    let tags = [("I", "f64", json!({ "channel": "IB" }))];
    let scene = scene("fault.cfg", &cfg, json!({}), &tags);
    fs::write(scene.path("fault.dat"), &data).expect("it can be written");
    let output = finish(busbar().arg("check").arg(scene.write())).expect_code(1);
    let said = output.stdout + &output.stderr;
    assert!(said.contains("/tags/I/source/address"), "{said}");
    assert!(said.contains("there is no analogue channel 'IB'; there are 'IA', 'N'"), "{said}");

    // What a file lacks is an error of `check`, and no more than a link that is down to a view.
    let mut column = table(json!({}));
    column.config["tags"]["Oil"]["source"]["address"] = json!({ "column": "Öl" });
    let output = finish(busbar().arg("check").arg(column.write())).expect_code(1);
    let said = output.stdout + &output.stderr;
    assert!(said.contains("/plugins/recording") && said.contains("'Öl'"), "{said}");
    assert_eq!(said.matches("'Öl'").count(), 1, "once for all tags: {said}");
    let (said, stats) = render(&column, 0.5);
    assert!(said.contains("'Öl'"), "{said}");
    assert_eq!(stats.tag("Oil").quality, "bad");

    let absent = table(json!({ "file": "/nowhere/log.csv" }));
    let output = finish(busbar().arg("check").arg(absent.write())).expect_code(1);
    let said = output.stdout + &output.stderr;
    assert!(said.contains("'/nowhere/log.csv': there is no such file"), "{said}");
    let (said, stats) = render(&absent, 0.5);
    assert!(said.contains("'/nowhere/log.csv': there is no such file"), "{said}");
    assert_eq!(stats.tag("Oil").quality, "bad");
}
