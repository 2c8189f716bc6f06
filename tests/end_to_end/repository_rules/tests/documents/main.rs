//! Documents: their links, the paths and commands that they name, their length and the book's
//! table of contents.

mod commands;
mod markdown;
mod repository;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use e2e::workspace_path;
use serde_json::Value;

use crate::commands::{CommandLine, Help};
use crate::markdown::Document;
use crate::repository::Repository;

/// Folder of the book's chapters.
const BOOK: &str = "host/app/busbar/book/src";
/// Folder of chapters that `cargo xtask book` generates.
const GENERATED: &str = "host/app/busbar/book/src/generated";
/// Folder of the SDK's chapters, of which the book's are generated.
const SDK_CHAPTERS: &str = "plugins/sdk/sdk/src/book";
/// Most lines of documents that newcomers read first.
const MAX_LINES: [(&str, usize); 2] = [("README.md", 130), ("ARCHITECTURE.md", 250)];
/// Sentences that operators and integrators must see in the README.
const LIMITS: [&str; 2] = ["faults, not malice", "a paused virtual machine"];
/// Words that tell of a plan or a former state; decisions may have them.
const FORMER_STATES: [&str; 7] =
    ["the plan ", "used to be", "no longer", "formerly", "fell from", "by now", "issue #"];
/// Verbs that are run; they are quick and write nothing.
const RUN_VERBS: [&[&str]; 3] = [&["check"], &["schema"], &["plugin", "list"]];
/// JSON Schema of configurations.
const SCHEMA: &str = "config/busbar.schema.json";
/// Names that examples choose, settings and addresses of plugins.
const EXAMPLE_KEYS: [&str; 7] = ["bay", "env", "host", "order", "register", "reweighted", "table"];
/// Table of keys that the window shows, and the book's page with the same keys.
const KEY_HELP: &str = "host/app/ui/src/help.rs";
const KEY_PAGE: &str = "host/app/busbar/book/src/operate/window.md";
/// Mark of code blocks whose commands are not run.
const NOT_RUN: &str = "no_run";

#[test]
fn links_lead_somewhere() {
    let (mut followed, mut faults) = (0, Vec::new());
    for document in Document::all() {
        for link in &document.links {
            let target = link.split('#').next().unwrap_or_default();
            if target.is_empty() || target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            // Rustdoc resolves links to items.
            if target.starts_with("crate::") || target.starts_with("super::") {
                continue;
            }
            followed += 1;
            let path = normalized(&document.folder().join(target));
            let path = path.to_string_lossy();
            if !exists(&path) && !is_generated(&path) {
                faults.push(format!("{} leads to {link}, which is not there", document.name));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(followed > 100, "{followed} links");
}

/// Reports whether a page of the book is generated.
fn is_generated(path: &str) -> bool {
    let Some(name) = path.strip_prefix(GENERATED) else { return false };
    match name.strip_prefix("/sdk/") {
        Some(chapter) => workspace_path(SDK_CHAPTERS).join(chapter).is_file(),
        None => ["/configuration.md", "/command_line.md"].contains(&name),
    }
}

#[test]
fn includes_of_the_book_have_text() {
    let mut includes = 0;
    for document in Document::all().iter().filter(|document| document.name.starts_with(BOOK)) {
        for include in document.text.split("{{#include ").skip(1) {
            let include = include.split("}}").next().unwrap_or_default();
            let (file, from) = include.split_once(':').unwrap_or((include, "1:"));
            let path = document.folder().join(file);
            let text = fs::read_to_string(workspace_path("").join(&path));
            let text = text.unwrap_or_else(|error| panic!("{}: {file}: {error}", document.name));
            let from: usize = from.trim_end_matches(':').parse().expect("a line number");
            let first = text.lines().nth(from - 1).unwrap_or_default();
            assert!(!first.trim().is_empty(), "{}: line {from} of {file}", document.name);
            includes += 1;
        }
    }
    assert!(includes > 15, "{includes} includes");
}

#[test]
fn the_table_of_contents_is_whole() {
    let summary = Document::read(&format!("{BOOK}/SUMMARY.md"));
    let listed: BTreeSet<_> = summary.links.iter().map(|link| format!("{BOOK}/{link}")).collect();
    let chapters = Document::all().into_iter().map(|document| document.name);
    let chapters = chapters.filter(|name| name.starts_with(BOOK) && !name.ends_with("SUMMARY.md"));
    let sdk = fs::read_dir(workspace_path(SDK_CHAPTERS)).expect("the SDK has chapters");
    let sdk = sdk.map(|entry| entry.expect("it can be read").file_name());
    let sdk = sdk.map(|name| format!("{GENERATED}/sdk/{}", name.to_string_lossy()));
    let references = ["configuration.md", "command_line.md"].map(|n| format!("{GENERATED}/{n}"));
    let there: BTreeSet<_> = chapters.chain(sdk).chain(references).collect();
    let differences: Vec<_> = listed.symmetric_difference(&there).collect();
    assert!(differences.is_empty(), "only in SUMMARY.md, or only in folders: {differences:?}");
}

#[test]
fn paths_that_are_named_exist() {
    let repository = Repository::find();
    let (mut checked, mut faults) = (0, Vec::new());
    for document in Document::current() {
        let in_blocks = document.blocks.iter().filter(|block| block.is_shell());
        let in_blocks = in_blocks.flat_map(|block| block.text.split_whitespace());
        for word in document.code.iter().flat_map(|code| code.split_whitespace()).chain(in_blocks) {
            let is_mark = |c: char| !c.is_alphanumeric() && c != '_';
            // A folder may be hidden, such as `.config`.
            let word = word.trim_end_matches(is_mark);
            let word = word.trim_start_matches(|c| is_mark(c) && c != '.');
            if let Some(exists) = repository.names(word, document.folder()) {
                checked += 1;
                if !exists {
                    faults.push(format!("{} names `{word}`, which is not there", document.name));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 100, "{checked} paths");
}

#[test]
fn environment_variables_that_are_named_exist() {
    let known = Repository::find().environment_variables();
    let (mut checked, mut faults) = (0, Vec::new());
    for document in Document::current() {
        for name in repository::environment_variables(&document.text) {
            checked += 1;
            if !known.contains(&name) {
                faults.push(format!("{} names {name}, which no source has", document.name));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 10, "{checked} variables");
}

#[test]
fn commands_that_are_named_exist() {
    let repository = Repository::find();
    let mut help = Help::default();
    let (mut checked, mut faults) = (0, Vec::new());
    for document in Document::current() {
        for line in document.command_lines() {
            checked += 1;
            if let Some(fault) = line.fault(&mut help, &repository) {
                faults.push(format!("{}: `{line}`: {fault}", document.name));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 100, "{checked} commands");
}

#[test]
fn quick_commands_of_the_book_do_what_they_say() {
    let mut run = 0;
    for document in Document::all() {
        let blocks = document.blocks.iter().filter(|b| b.is_shell() && !b.info.contains(NOT_RUN));
        for line in blocks.flat_map(|block| CommandLine::of_shell(&block.text)) {
            let Some(arguments) = line.busbar_arguments() else { continue };
            let is_quick = RUN_VERBS.iter().any(|verb| arguments.starts_with(&owned(verb)));
            let names_files = arguments.iter().filter(|a| a.ends_with(".json"));
            // Other configurations are the reader's.
            let is_ours = names_files.clone().all(|file| file.starts_with("config/"));
            if !is_quick || !is_ours {
                continue;
            }
            names_files.for_each(|file| {
                e2e::built(workspace_path(file));
            });
            let mut command = e2e::busbar();
            command.args(arguments).current_dir(workspace_path(""));
            e2e::finish(&mut command).expect_code(0);
            run += 1;
        }
    }
    assert!(run >= 3, "{run} commands");
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(ToString::to_string).collect()
}

#[test]
fn first_documents_are_short() {
    for (name, most) in MAX_LINES {
        let lines = Document::read(name).text.lines().count();
        assert!(lines <= most, "{name} has {lines} lines; {most} are the most");
    }
}

#[test]
fn the_readme_tells_its_limits() {
    let text = Document::read("README.md").text.split_whitespace().collect::<Vec<_>>().join(" ");
    for limit in LIMITS {
        assert!(text.contains(limit), "README.md does not say `{limit}`");
    }
}

#[test]
fn documents_tell_how_things_are() {
    let mut faults = Vec::new();
    for document in Document::current() {
        let is_history = document.name.contains("/decisions/");
        let is_ours = !document.name.contains('/')
            || document.name.starts_with(BOOK)
            || document.name.ends_with("DESIGN.md");
        if is_history || !is_ours {
            continue;
        }
        let text = document.text.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
        for words in FORMER_STATES {
            if text.contains(words) {
                faults.push(format!("{} tells of a former state: `{words}`", document.name));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_book_has_all_keys_of_the_window() {
    let help = fs::read_to_string(workspace_path(KEY_HELP)).expect("it is there");
    let (_, table) = help.split_once("const HELP").expect("it has a table of keys");
    let table = table.split("];").next().unwrap_or_default();
    let page = Document::read(KEY_PAGE);
    let told: BTreeSet<_> = page.code.iter().flat_map(|code| code.split_whitespace()).collect();
    let words = table.split(|c: char| !c.is_alphanumeric());
    let is_function = |word: &str| {
        word.strip_prefix('F').is_some_and(|n| !n.is_empty() && n.chars().all(char::is_numeric))
    };
    let is_letter = |word: &str| word.len() == 1 && word.chars().all(|c| c.is_ascii_uppercase());
    let keys: BTreeSet<_> = words.filter(|word| is_function(word) || is_letter(word)).collect();
    assert!(keys.len() > 15, "{keys:?}");
    let missing: Vec<_> = keys.iter().filter(|key| !told.contains(**key)).collect();
    assert!(missing.is_empty(), "{KEY_PAGE} does not have {missing:?}");
}

#[test]
fn configuration_keys_of_the_book_exist() {
    let schema = fs::read_to_string(workspace_path(SCHEMA)).expect("it is there");
    let schema: Value = serde_json::from_str(&schema).expect("it is JSON");
    let mut known: BTreeSet<String> = EXAMPLE_KEYS.iter().map(ToString::to_string).collect();
    add_keys(&schema, &mut known);
    let (mut checked, mut faults) = (0, Vec::new());
    for document in Document::all().iter().filter(|document| document.name.starts_with(BOOK)) {
        let blocks = document.blocks.iter().filter(|block| block.info == "json");
        let texts = blocks.map(|block| &block.text).chain(&document.code);
        for key in texts.flat_map(|text| keys(text)) {
            checked += 1;
            if !known.contains(key) {
                faults.push(format!("{} has \"{key}\", which is no key", document.name));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 50, "{checked} keys");
}

/// Adds the names of all properties of a schema.
fn add_keys(schema: &Value, known: &mut BTreeSet<String>) {
    match schema {
        Value::Object(members) => {
            if let Some(properties) = members.get("properties").and_then(Value::as_object) {
                known.extend(properties.keys().cloned());
            }
            members.values().for_each(|member| add_keys(member, known));
        }
        Value::Array(items) => items.iter().for_each(|item| add_keys(item, known)),
        _ => {}
    }
}

/// Returns the words in quotes before colons, and a text that is one word in quotes.
fn keys(text: &str) -> Vec<&str> {
    let parts: Vec<_> = text.split('"').collect();
    let is_word =
        |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    let pairs = parts.windows(2).skip(1).step_by(2);
    let before_colons =
        pairs.filter(|pair| pair[1].trim_start().starts_with(':') || parts.len() == 3);
    before_colons.map(|pair| pair[0]).filter(|word| is_word(word)).collect()
}

#[test]
fn keys_are_words_before_colons() {
    assert_eq!(keys(r#""view": { "theme": "dark", "=A1-B": 1 }"#), ["view", "theme"]);
    assert_eq!(keys(r#""isolation""#), ["isolation"]);
    assert!(keys("no quotes").is_empty() && keys(r#"say "a" and "b""#).is_empty());
}

fn exists(path: &str) -> bool {
    workspace_path(path).exists()
}

/// Returns a path without `..`, by its text.
fn normalized(path: &Path) -> PathBuf {
    let mut result = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => assert!(result.pop(), "{} leaves the house", path.display()),
            Component::CurDir => {}
            other => result.push(other),
        }
    }
    result
}
