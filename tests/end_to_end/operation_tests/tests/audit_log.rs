//! Audit log of alarms by the command line: `busbar log verify` of a whole log and of one from
//! which lines were removed, reordered and lost, and `busbar check` of a damaged one.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{AlarmState, RendererOptions, Viewer};
use e2e::{Output, Scene, busbar, finish};
use serde_json::json;
use tempfile::TempDir;

const SIZE: [u32; 2] = [64, 48];
/// Exit code of a command whose input is at fault.
const EXIT_INPUT: i32 = 1;
const STATES: [AlarmState; 4] = [
    AlarmState::Unacknowledged,
    AlarmState::Acknowledged,
    AlarmState::ReturnedUnacknowledged,
    AlarmState::Normal,
];

/// Configuration whose alarms were logged, with a key and an anchor outside the log.
struct AuditedRun {
    scene: Scene,
    /// Folder of key and anchor.
    secrets: TempDir,
}

impl AuditedRun {
    fn new() -> Self {
        let secrets = tempfile::tempdir().expect("a temporary folder can be made");
        let mut scene = Scene::without_tags();
        let key = secrets.path().join("log.key");
        fs::write(&key, "a key of thirty bytes and more").expect("it can be written");
        let owner_only = fs::Permissions::from_mode(0o600);
        fs::set_permissions(&key, owner_only).expect("it is ours");
        scene.config["alarms"] =
            json!({ "Grid": { "mirrored": true, "message": "Load shedding is armed" } });
        scene.config["alarm_handling"] = json!({
            "log_directory": "log",
            "log_key_file": key,
            "log_anchor_file": secrets.path().join("log.anchor"),
        });
        let logged = Self { scene, secrets };
        logged.write_records();
        logged
    }

    /// Changes the state of a host program's alarm twelve times.
    fn write_records(&self) {
        let scene = LoadedScene::load(&self.scene.write(), &|_, _, _| {}).expect("it loads");
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer = Viewer::new_offscreen(scene, options, SIZE).expect("there is a device");
        for (number, state) in STATES.into_iter().cycle().take(12).enumerate() {
            viewer.mirror_alarm("Grid", state, None, Some("host")).expect("it is mirrored");
            let input = viewer.headless_input(number as f64);
            viewer.frame(input).expect("a frame is drawn");
        }
        // Closes the log and writes its anchor.
        drop(viewer);
    }

    fn log(&self) -> PathBuf {
        self.scene.path("log")
    }

    /// Returns the lines of the log's newest file; the first is its header.
    fn lines(&self) -> Vec<String> {
        let text = fs::read_to_string(self.log().join("alarms.jsonl")).expect("there is a log");
        text.lines().map(str::to_owned).collect()
    }

    fn set_lines(&self, lines: &[String]) {
        let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
        fs::write(self.log().join("alarms.jsonl"), text).expect("it can be written");
    }

    fn verify(&self, with_anchor: bool) -> Output {
        let mut command = busbar();
        command.args(["log", "verify"]).arg(self.log());
        command.arg("--key").arg(self.secret("log.key"));
        if with_anchor {
            command.arg("--anchor").arg(self.secret("log.anchor"));
        }
        finish(&mut command)
    }

    fn secret(&self, name: &str) -> PathBuf {
        self.secrets.path().join(name)
    }

    fn check(&self) -> Output {
        finish(busbar().arg("check").arg(self.scene.write()))
    }
}

/// Returns the files of a folder with their contents.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = fs::read_dir(folder).expect("it is there");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("it can be read").path())
        .map(|path| (path.clone(), fs::read(path).expect("it can be read")))
        .collect();
    files.sort();
    files
}

#[test]
fn a_whole_log_has_no_faults_and_is_left_as_it_is() {
    let logged = AuditedRun::new();
    let before = contents(&logged.log());
    for with_anchor in [false, true] {
        let output = logged.verify(with_anchor).expect_code(0);
        assert!(output.stdout.contains("12 records"), "{}", output.stdout);
        assert!(output.stdout.trim_end().ends_with("no faults"), "{}", output.stdout);
        assert!(!output.stdout.contains("FAULT"), "{}", output.stdout);
    }
    assert_eq!(contents(&logged.log()), before);
}

#[test]
fn removed_and_reordered_lines_are_found() {
    let logged = AuditedRun::new();
    let whole = logged.lines();
    assert!(whole.len() >= 13, "a header and twelve records: {whole:?}");
    let middle = whole.len() - 6;
    let mut removed = whole.clone();
    removed.remove(middle);
    let mut reordered = whole.clone();
    reordered.swap(middle, middle + 1);
    for (name, damaged) in [("removed", removed), ("reordered", reordered)] {
        logged.set_lines(&damaged);
        let output = logged.verify(false).expect_code(EXIT_INPUT);
        assert!(output.stdout.contains("FAULT"), "{name}: {}", output.stdout);
        assert!(output.stdout.contains("alarms.jsonl"), "{name}: {}", output.stdout);
        assert_eq!(logged.lines(), damaged, "{name}: nothing is written");
    }
    logged.set_lines(&whole);
    logged.verify(true).expect_code(0);
}

#[test]
fn the_loss_of_the_last_lines_is_found_by_the_anchor() {
    let logged = AuditedRun::new();
    let whole = logged.lines();
    logged.set_lines(&whole[..whole.len() - 2]);
    // Without it, nobody can know.
    logged.verify(false).expect_code(0);
    let output = logged.verify(true).expect_code(EXIT_INPUT);
    assert!(output.stdout.contains("FAULT"), "{}", output.stdout);
    assert!(output.stdout.contains("12"), "{}", output.stdout);
    // Nor is the loss of all of it passed over.
    fs::remove_file(logged.log().join("alarms.jsonl")).expect("it is ours");
    logged.verify(true).expect_code(EXIT_INPUT);
}

#[test]
fn a_check_tells_of_a_damaged_log_and_destroys_no_byte() {
    let logged = AuditedRun::new();
    let output = logged.check();
    assert!(!output.stderr.contains("alarms.jsonl"), "{}", output.stderr);
    let mut lines = logged.lines();
    let middle = lines.len() - 6;
    lines[middle].replace_range(20..24, "????");
    logged.set_lines(&lines);
    let before = contents(&logged.log());
    let output = logged.check();
    let said = output.stdout.clone() + &output.stderr;
    assert!(said.contains("the audit log") && said.contains("(line "), "{said}");
    assert_eq!(contents(&logged.log()), before);
    logged.verify(true).expect_code(EXIT_INPUT);
}
