//! Order of values, clock differences and pauses in the statistics and in `doctor`, of a source
//! whose samples, times and flags a script defines.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use e2e::{Process, Scene, Stats, busbar, finish};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Time from the writing of the script to its first batch, milliseconds; all processes run by then.
const LEAD_MILLIS: u64 = 6_000;
/// Freshness of all tags, seconds: nothing grows stale by itself.
const FRESHNESS_SECONDS: u64 = 600;

/// Returns a scene without equipment whose tags follow a script: batches as milliseconds after the
/// lead, and samples.
fn scene(plugin: Value, batches: &[(u64, Value)]) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("sample_generator");
    let start = SystemTime::now().duration_since(UNIX_EPOCH).expect("it is after 1970");
    let batches: Vec<Value> = batches
        .iter()
        .map(|(at, samples)| json!({ "at_millis": LEAD_MILLIS + at, "samples": samples }))
        .collect();
    let script = json!({
        "start_unix_millis": start.as_millis() as u64,
        "sent": "sent",
        "first": "first",
        "batches": batches,
    });
    std::fs::write(scene.path("script.json"), script.to_string()).expect("it can be written");
    let mut source = json!({
        "plugin": "sample_generator",
        "settings": { "script": scene.path("script.json") },
    });
    source
        .as_object_mut()
        .expect("an object")
        .extend(plugin.as_object().cloned().unwrap_or_default());
    scene.config["plugins"]["source"] = source;
    let tag = json!({
        "type": "f64",
        "freshness_seconds": FRESHNESS_SECONDS,
        "source": { "instance": "source", "address": {} },
    });
    scene.config["tags"] = json!({ "a": tag, "b": tag, "c": tag, "d": tag });
    scene
}

fn sample(tag: &str, value: f64, quality: &str, age_millis: Option<i64>, flags: &[&str]) -> Value {
    json!({ "tag": tag, "value": value, "quality": quality, "age_millis": age_millis, "flags": flags })
}

/// Returns the statistics after so many milliseconds of the script.
fn stats_after(scene: &Scene, millis: u64) -> Stats {
    let seconds = (LEAD_MILLIS + millis) as f64 / 1e3;
    finish(&mut scene.rendering(seconds)).expect_code(0);
    scene.stats()
}

fn link(stats: &Stats) -> Value {
    let plugins = stats.0["plugins"].as_array().expect("plugins").clone();
    plugins.into_iter().find(|plugin| plugin["name"] == "source").expect("the source")["link"]
        .clone()
}

#[test]
fn values_count_in_order_of_arrival_and_a_step_of_the_clock_is_counted_once() {
    let batches = [
        (
            0,
            json!([
                sample("a", 1.0, "good", Some(0), &[]),
                sample("b", 1.0, "good", Some(0), &[]),
                sample("c", 1.0, "good", Some(0), &[]),
            ]),
        ),
        // The source's clock was set back by two seconds.
        (
            300,
            json!([
                sample("a", 2.0, "good", Some(2000), &[]),
                sample("b", 2.0, "bad", Some(2000), &[]),
                sample("c", 2.0, "good", Some(2000), &["buffered"]),
            ]),
        ),
    ];
    let stats = stats_after(&scene(json!({}), &batches), 2000);
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|id| stats.tag(id));
    assert_eq!((a.value, a.quality.as_str()), (json!(2.0), "good"));
    assert_eq!((b.value, b.quality.as_str()), (json!(2.0), "bad"));
    assert_eq!((c.value, c.quality.as_str()), (json!(1.0), "good"), "older, out of a buffer");
    assert_eq!(d.reason.as_deref(), Some("not connected"));
    let link = link(&stats);
    assert_eq!((&link["clock_steps"], &link["state"]), (&json!(1), &json!("up")));
    assert_eq!(link["origin"], json!(["simulated"]));
    assert!(!link["message"].as_str().expect("a message").is_empty());
}

#[test]
fn a_clock_that_is_an_hour_ahead_makes_no_value_fresh_and_is_told_with_the_remedy() {
    let hour = 3_600_000;
    let ahead = |value| {
        json!([
            sample("a", value, "good", Some(-hour), &[]),
            sample("b", value, "good", None, &["time_unusable"]),
            sample("c", value, "good", None, &[]),
        ])
    };
    let batches: Vec<(u64, Value)> = (0..50).map(|i| (i * 100, ahead(i as f64))).collect();
    let wrong = scene(json!({}), &batches);
    let stats = stats_after(&wrong, 5500);
    for id in ["a", "b"] {
        let tag = stats.tag(id);
        assert_eq!(
            (tag.quality.as_str(), tag.reason.as_deref()),
            ("uncertain", Some("source time"))
        );
    }
    assert_eq!(stats.tag("c").quality, "good", "none is promised");
    let told = link(&stats);
    let skew = told["clock_skew_seconds"].as_f64().expect("a skew");
    assert!((skew - 3600.0).abs() < 1.0, "{skew}");
    assert!(told["clock_remarks"].to_string().contains("zone"), "{told}");
    assert!(told["future_times"].as_u64() > Some(0) && told["unusable_times"].as_u64() > Some(0));

    let by_reception = scene(json!({ "freshness_by": "reception" }), &batches);
    let stats = stats_after(&by_reception, 5500);
    assert_eq!(stats.tag("a").quality, "good");
    let told = link(&stats);
    assert_eq!(told["freshness_by"], "reception");
    assert!(told["clock_remarks"].to_string().contains("reception"), "shown as such: {told}");
}

#[test]
fn doctor_tells_links_and_clocks() {
    let behind =
        |i: u64| (i * 100, json!([sample("a", i as f64, "good", Some(8 * 3_600_000), &[])]));
    let batches: Vec<(u64, Value)> = (0..50).map(behind).collect();
    let scene = scene(json!({}), &batches);
    let listen = (LEAD_MILLIS / 1000 + 5).to_string();
    let output = finish(busbar().arg("doctor").arg(scene.write()).args([
        "--json",
        "--listen-seconds",
        &listen,
    ]));
    let found: Value = serde_json::from_str(&output.stdout).expect("JSON");
    let findings = found["findings"].as_array().expect("findings");
    let of = |check: &str| {
        findings
            .iter()
            .find(|finding| finding["check"] == check)
            .unwrap_or_else(|| panic!("{found:#}"))
    };
    assert!(of("link")["cause"].to_string().contains("source"));
    let clock = of("clock of a source");
    assert!(clock["cause"].to_string().contains("8 h 0 min behind"), "{clock}");
    assert!(clock["remedy"].to_string().contains("zone"), "{clock}");
}

#[test]
fn what_was_before_a_pause_is_not_good_after_it() {
    let before =
        json!([sample("a", 1.0, "good", None, &[]), sample("b", 1.0, "good", Some(0), &[])]);
    let after = json!([sample("b", 2.0, "good", Some(0), &[])]);
    let scene = scene(json!({}), &[(0, before), (6_000, after)]);
    let mut rendering = scene.rendering((LEAD_MILLIS + 8_000) as f64 / 1e3);
    let process = Process::start(&mut rendering);
    std::thread::sleep(Duration::from_millis(LEAD_MILLIS + 2_000));
    process.signal(Signal::STOP);
    std::thread::sleep(Duration::from_secs(3));
    process.signal(Signal::CONT);
    process.finish().expect_code(0);
    let stats = scene.stats();
    assert!(stats.count("pauses") >= 1, "a pause is counted");
    let (a, b) = (stats.tag("a"), stats.tag("b"));
    assert_eq!((a.quality.as_str(), a.reason.as_deref()), ("bad", Some("stale")));
    assert_eq!((b.value, b.quality.as_str()), (json!(2.0), "good"), "it came after the pause");
}

#[test]
fn simulated_instances_and_their_tags_say_so() {
    let batches = [(
        0,
        json!([
            sample("a", 1.0, "good", None, &[]),
            sample("b", 1.0, "good", None, &["test", "substituted"]),
        ]),
    )];
    let stats = stats_after(&scene(json!({}), &batches), 1000);
    let origins = |id: &str| {
        let tags = stats.0["tags"].as_array().expect("tags").clone();
        tags.into_iter().find(|tag| tag["id"] == id).expect("the tag")["origin"].clone()
    };
    assert_eq!(origins("a"), json!(["simulated"]));
    assert_eq!(origins("b"), json!(["substituted", "test", "simulated"]));
    assert_eq!(stats.0["origin"], json!(["substituted", "test", "simulated"]));
}
