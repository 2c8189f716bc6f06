//! Contents of the repository that documents name: files, packages, targets, variables.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use e2e::{finish, workspace_path};
use serde_json::Value;

/// Folders at the top, by which a path in a document is known.
const TOP: [&str; 5] = ["config/", "host/", "plugins/", "shaders/", "tests/"];
/// Characters of patterns and examples, which name no single file.
const PATTERN: [char; 6] = ['*', '{', '<', '…', '$', ':'];
/// Start of environment variables.
const VARIABLE: &str = "BUSBAR_";
/// Extensions of sources that read environment variables.
const SOURCES: [&str; 6] = ["rs", "py", "c", "h", "service", "toml"];

/// Files and packages of the repository.
pub(crate) struct Repository {
    files: BTreeSet<PathBuf>,
    ignored: Vec<String>,
    packages: BTreeMap<String, Vec<(String, String)>>,
}

impl Repository {
    /// Lists files and asks cargo about packages.
    pub(crate) fn find() -> Self {
        let mut files = BTreeSet::new();
        collect(&workspace_path(""), Path::new(""), &mut files);
        let ignored = fs::read_to_string(workspace_path(".gitignore")).expect("it is text");
        let ignored = ignored.lines().filter_map(|line| line.strip_prefix('/'));
        let ignored = ignored.map(|line| line.trim_end_matches('*').to_owned()).collect();
        Self { files, ignored, packages: packages() }
    }

    /// Reports whether a path exists that a document in `folder` names; nothing where the word is
    /// no path of the repository.
    pub(crate) fn names(&self, word: &str, folder: &Path) -> Option<bool> {
        let is_pattern = word.contains(PATTERN) || word.split(['/', '.']).any(is_placeholder);
        if is_pattern || self.ignored.iter().any(|ignored| word.starts_with(ignored.as_str())) {
            return None;
        }
        let in_top = TOP.iter().any(|top| word.starts_with(top));
        let in_crate = word.starts_with("src/");
        let is_source = word.ends_with(".rs") && word.len() > 3;
        if !in_top && !in_crate && !is_source {
            return None;
        }
        let ends_a_path = || self.files.iter().any(|file| file.ends_with(word));
        let beside = workspace_path("").join(folder).join(word).exists();
        Some(workspace_path(word).exists() || beside || (is_source && ends_a_path()))
    }

    /// Reports whether a package has a target of a kind, such as `test` or `example`; without a
    /// target, whether the package is there.
    pub(crate) fn has(&self, package: &str, target: Option<(&str, &str)>) -> bool {
        let Some(targets) = self.packages.get(package) else { return false };
        target.is_none_or(|(kind, name)| targets.iter().any(|(k, n)| k == kind && n == name))
    }

    /// Reports whether any package has a test of this name.
    pub(crate) fn has_test(&self, name: &str) -> bool {
        self.packages.values().flatten().any(|(kind, test)| kind == "test" && test == name)
    }

    /// Returns the environment variables of all sources.
    pub(crate) fn environment_variables(&self) -> BTreeSet<String> {
        let is_source = |file: &&PathBuf| {
            let extension = file.extension().and_then(|extension| extension.to_str());
            extension.is_some_and(|extension| SOURCES.contains(&extension))
        };
        let sources = self.files.iter().filter(is_source);
        let texts =
            sources.filter_map(|file| fs::read_to_string(workspace_path("").join(file)).ok());
        texts.flat_map(|text| environment_variables(&text)).collect()
    }
}

/// Reports whether a part of a path stands for what the reader chooses, such as `TARGET`.
fn is_placeholder(part: &str) -> bool {
    part.len() > 1 && part.chars().all(|c| c.is_ascii_uppercase()) && part != "README"
}

/// Returns the names in a text that begin with `BUSBAR_`.
pub(crate) fn environment_variables(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_ascii_uppercase() && !c.is_ascii_digit() && c != '_');
    let words = words.filter(|word| word.starts_with(VARIABLE) && word.len() > VARIABLE.len());
    words.map(str::to_owned).collect()
}

fn collect(folder: &Path, relative: &Path, files: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let entry = entry.expect("it can be read");
        let name = entry.file_name();
        if name.to_string_lossy().starts_with('.') || name == "target" {
            continue;
        }
        let relative = relative.join(&name);
        if entry.file_type().expect("it has a type").is_dir() {
            collect(&entry.path(), &relative, files);
        } else {
            files.insert(relative);
        }
    }
}

fn packages() -> BTreeMap<String, Vec<(String, String)>> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["metadata", "--format-version", "1", "--no-deps", "--offline"]);
    let output = finish(cargo.current_dir(workspace_path(""))).expect_code(0);
    let metadata: Value = serde_json::from_str(&output.stdout).expect("metadata are JSON");
    let text = |value: &Value| value.as_str().expect("it is text").to_owned();
    let target = |target: &Value| (text(&target["kind"][0]), text(&target["name"]));
    let package = |package: &Value| {
        let targets = package["targets"].as_array().expect("packages have targets");
        (text(&package["name"]), targets.iter().map(target).collect())
    };
    metadata["packages"].as_array().expect("metadata have packages").iter().map(package).collect()
}

#[test]
fn paths_are_told_from_other_words() {
    let repository = Repository::find();
    let names = |word| repository.names(word, Path::new("plugins/telemetry/iec104"));
    assert_eq!(names("host/app/busbar"), Some(true));
    assert_eq!(names("host/no_such_crate"), Some(false));
    assert_eq!(names("src/lib.rs"), Some(true));
    assert_eq!(names("no_such_file.rs"), Some(false));
    for word in ["plugins/*", "config/models/x.glb", "and/or", "tests/TARGET.rs", "1/s"] {
        assert_eq!(names(word), None, "{word}");
    }
}

#[test]
fn packages_have_their_targets() {
    let repository = Repository::find();
    let documents = Some(("test", "documents"));
    assert!(repository.has("repository_rules", documents) && repository.has("xtask", None));
    let no_such = Some(("test", "no_such_test"));
    assert!(!repository.has("repository_rules", no_such) && !repository.has("no", None));
}

#[test]
fn variables_are_words() {
    assert_eq!(
        environment_variables("BUSBAR_A=1 xBUSBAR_B, BUSBAR_, `BUSBAR_C_2`"),
        ["BUSBAR_A", "BUSBAR_B", "BUSBAR_C_2"]
    );
}
