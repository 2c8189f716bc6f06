//! State that is kept across reconfiguration, restarts and edits.

use super::*;

fn bench(transformer: &str, file: &std::path::Path) -> Bench {
    let more = format!(r#", "state_file": "{}""#, file.display());
    Bench::new(transformer, &more, &[("load", "A"), ("ambient", "°C")])
}

/// Drawing of a new instance so many minutes after another one ended at 12 hours.
fn restart(transformer: &str, file: &std::path::Path, minutes: i64) -> Drawing {
    let mut bench = bench(transformer, file);
    bench.minute = 24 * 60 + minutes;
    bench.at_load(0, 0.6)
}

/// A file that an instance left behind after a day at 0.6.
fn kept() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("states.json");
    bench(EXAMPLE, &file).at_load(24 * 60, 0.6);
    (folder, file)
}

#[test]
fn reconfiguration_keeps_the_state() {
    let mut bench = Bench::example();
    let before = degrees(&bench.at_load(24 * 60, 0.6));
    bench.bindings = Some(vec![binding(("load", "A")), binding(("ambient", "°C"))]);
    assert_eq!(degrees(&bench.at_load(0, 0.6)), before);
    // The minutes around it were not seen.
    bench.bindings = Some(vec![binding(("load", "A")), binding(("ambient", "°C"))]);
    bench.minute += 3;
    assert!(bench.at_load(0, 0.6).lines[1].text.starts_with("between"));
}

#[test]
fn a_restart_goes_on_where_it_ended() {
    let (_folder, file) = kept();
    assert_near(degrees(&restart(EXAMPLE, &file, 0)), exact(&[(1e5, 0.6)]));
    let drawing = restart(EXAMPLE, &file, 0);
    let counted = drawing.lines[3].text.rsplit(' ').nth(1).unwrap();
    assert!(counted.parse::<f64>().unwrap() > 15.0, "{}", drawing.lines[3].text);
    // What was not seen widens it: the truth at 1.5 lies within.
    let later = restart(EXAMPLE, &file, 180);
    let [low, high] = bounds(&later.lines[1]);
    let [_, truth] = exact(&[(1e5, 0.6), (180.0, 1.5)]);
    assert!(low < truth && truth < high, "{low} {truth} {high}");
    assert_eq!(verdict(&later), Verdict::Unknown);
}

#[test]
fn edits_of_what_does_not_concern_it_keep_the_state() {
    let (_folder, file) = kept();
    let edited = format!(r#"{EXAMPLE}, "hot_spot_limit": 110, "size": "medium", "moisture": 1"#);
    assert_near(degrees(&restart(&edited, &file, 0)), exact(&[(1e5, 0.6)]));
}

#[test]
fn a_state_of_other_parameters_or_of_the_future_is_not_taken() {
    let (_folder, file) = kept();
    let other = EXAMPLE.replace("38.3", "38.4");
    assert!(restart(&other, &file, 0).lines[1].text.starts_with("between"));
    let (_folder, file) = kept();
    assert!(restart(EXAMPLE, &file, -1).lines[1].text.starts_with("between"));
}

#[test]
fn a_damaged_file_is_ignored_and_replaced() {
    let (_folder, file) = kept();
    let text = std::fs::read_to_string(&file).unwrap();
    let damaged = [
        String::new(),
        text[..text.len() / 2].to_owned(),
        text.replace("\"version\":1", "\"version\":2"),
        text.replace("\"low\":", "\"low\":1e9,\"x\":"),
        text.replace("\"counted_hours\":", "\"counted_hours\":-"),
        "[".repeat(100_000),
        "\0".repeat(9 << 20),
    ];
    for damaged in damaged {
        assert_ne!(damaged, text);
        std::fs::write(&file, &damaged).unwrap();
        let drawing = restart(EXAMPLE, &file, 0);
        assert!(
            drawing.lines[1].text.starts_with("between"),
            "{}",
            &damaged[..damaged.len().min(80)]
        );
        let replaced = std::fs::read_to_string(&file).unwrap();
        assert!(replaced.starts_with("{\"version\":1"), "{replaced}");
    }
}

#[test]
fn no_file_is_left_beside_and_none_is_written_of_a_trial() {
    let (folder, file) = kept();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let before = std::fs::read(&file).unwrap();
    let mut trial = bench(EXAMPLE, &file);
    trial.overlay.configure(Vec::new()).unwrap();
    drop(trial);
    assert_eq!(std::fs::read(&file).unwrap(), before);
    // A folder that is not there is told, and no reason to stop.
    let nowhere = folder.path().join("missing").join("states.json");
    assert!(!bench(EXAMPLE, &nowhere).at_load(1, 0.5).lines.is_empty());
}

#[test]
fn states_are_written_while_it_runs() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("states.json");
    let mut bench = bench(EXAMPLE, &file);
    bench.at_load(10, 0.6);
    assert!(!file.exists());
    bench.overlay.last_save = Instant::now().checked_sub(SAVE_INTERVAL).unwrap();
    bench.at_load(1, 0.6);
    let deadline = Instant::now() + Duration::from_secs(20);
    while !file.exists() {
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(5));
    }
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["transformers"]["=T1"]
            .is_object()
    );
}
