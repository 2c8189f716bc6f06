//! `busbar import --skip-bad-rows`: a row that is skipped hides no duplicate of its tag.

use std::fs;
use std::path::PathBuf;

use e2e::{Output, built, built_folder, busbar, finish, model};
use serde_json::Value;
use tempfile::TempDir;

/// Folder with a model, a plugin and a list.
struct Example(TempDir);

impl Example {
    fn new(rows: &str) -> Self {
        let example = Self(tempfile::tempdir().expect("a temporary folder can be made"));
        fs::create_dir(example.path("plugins")).expect("it can be written");
        let name = "libmodbus_adapter.so";
        let library = built(built_folder().join(name));
        fs::copy(library, example.path("plugins").join(name)).expect("it can be copied");
        fs::copy(model("transformer.glb"), example.path("transformer.glb")).expect("a copy");
        let columns = "tag,type,low,address.table,address.register,address.type\n";
        fs::write(example.path("points.csv"), format!("{columns}{rows}")).expect("it is written");
        example
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn import(&self, more: &[&str]) -> Output {
        let mut command = busbar();
        command.current_dir(self.0.path());
        command.args(["import", "transformer.glb", "points.csv", "--out", "scene.json"]);
        command.args(["--plugin", "bay=modbus_adapter,host=127.0.0.1"]);
        finish(command.args(more))
    }

    /// Returns the tag ids of the written scene.
    fn tags(&self) -> Vec<String> {
        let text = fs::read(self.path("scene.json")).expect("a scene was written");
        let scene: Value = serde_json::from_slice(&text).expect("it is JSON");
        scene["tags"].as_object().expect("it has tags").keys().cloned().collect()
    }
}

#[test]
fn a_bad_first_row_lets_no_later_duplicate_through() {
    // The first row of T1.P is bad, and the later one names another register.
    let rows = "T1.P,f64,x,holding,100,i16\n\
                T1.Q,f64,,holding,101,i16\n\
                T1.P,f64,,holding,200,i16\n";
    let example = Example::new(rows);
    let output = example.import(&[]).expect_code(1);
    for line in ["points.csv:2: error", "points.csv:4: error"] {
        assert!(output.stderr.contains(line), "{line} is not in {}", output.stderr);
    }
    assert!(!example.path("scene.json").exists());
    let output = example.import(&["--skip-bad-rows"]).expect_code(0);
    for line in ["points.csv:2: warning: skipped", "points.csv:4: warning: skipped"] {
        assert!(output.stderr.contains(line), "{line} is not in {}", output.stderr);
    }
    assert!(output.stderr.contains("T1.P"), "{}", output.stderr);
    assert_eq!(example.tags(), ["T1.Q"], "nobody knows which register is right");
}
