//! Language: first words and least length of doc comments, and names of functions that say nothing.

use std::collections::BTreeMap;
use std::fs;

use e2e::workspace_path;

use crate::rust_files;

/// Words that no doc comment begins with: the reader would have to look for their noun.
const FORBIDDEN_FIRST_WORDS: [&str; 18] = [
    "as", "he", "how", "it", "its", "of", "that", "their", "these", "they", "this", "those",
    "what", "where", "whether", "which", "who", "why",
];
/// Words of the shortest first paragraph.
const MIN_WORDS: usize = 4;
/// Folders whose comments are still to be rewritten, and the most faults that each may have.
const UNFINISHED: &[(&str, usize)] = &[];

/// First paragraphs of the doc comments of a source, and their lines, from 1.
fn first_paragraphs(source: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    // Marker of the comment that the line before belongs to; whether its first paragraph ended.
    let mut open: Option<(&str, bool)> = None;
    for (index, line) in source.lines().enumerate() {
        let line = line.trim_start();
        let marker = ["///", "//!"].into_iter().find(|marker| line.starts_with(marker));
        let Some(marker) = marker.filter(|_| !line.starts_with("////")) else {
            open = None;
            continue;
        };
        let text = line[marker.len()..].trim();
        let has_ended = match open {
            Some((before, has_ended)) if before == marker => has_ended || text.is_empty(),
            _ => {
                found.push((index + 1, String::new()));
                text.is_empty()
            }
        };
        open = Some((marker, has_ended));
        if let (false, Some((_, paragraph))) = (has_ended, found.last_mut()) {
            paragraph.push_str(text);
            paragraph.push(' ');
        }
    }
    found
}

/// Fault of a first paragraph, where it has one.
fn fault(paragraph: &str) -> Option<String> {
    let first: String = paragraph.chars().take_while(|c| c.is_alphabetic()).collect();
    if FORBIDDEN_FIRST_WORDS.contains(&first.to_lowercase().as_str()) {
        return Some(format!("begins with '{first}'"));
    }
    let words = paragraph.split_whitespace().count();
    (words < MIN_WORDS).then(|| format!("has {words} words, at least {MIN_WORDS} are wanted"))
}

/// Folder of a crate, such as `host/site/tags`, for a path in the workspace.
fn crate_folder(path: &str) -> String {
    path.split('/').take(2).collect::<Vec<_>>().join("/")
}

#[test]
fn doc_comments_begin_with_a_noun_phrase_or_a_verb_and_say_something() {
    let mut faults: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let root = workspace_path("");
    for path in
        ["host", "plugins", "shaders", "tests"].iter().flat_map(|f| rust_files(&root.join(f)))
    {
        let name = path.strip_prefix(&root).expect("it is below the root").display().to_string();
        let source = fs::read_to_string(&path).expect("sources are text");
        for (line, paragraph) in first_paragraphs(&source) {
            if let Some(fault) = fault(&paragraph) {
                let place = format!("{name}:{line}: {fault}: {}", paragraph.trim());
                faults.entry(crate_folder(&name)).or_default().push(place);
            }
        }
    }
    let allowed: BTreeMap<&str, usize> = UNFINISHED.iter().copied().collect();
    let most = |folder: &str| allowed.get(folder).copied().unwrap_or_default();
    let over: Vec<_> = faults.iter().filter(|(folder, found)| found.len() > most(folder)).collect();
    let told = |(folder, found): &(&String, &Vec<String>)| {
        format!(
            "{folder}: {} faults, {} allowed\n  {}",
            found.len(),
            most(folder),
            found.join("\n  ")
        )
    };
    assert!(over.is_empty(), "{}", over.iter().map(told).collect::<Vec<_>>().join("\n"));
    for (folder, most) in UNFINISHED {
        let left = faults.get(*folder).map_or(0, Vec::len);
        assert!(left == *most, "{folder} has {left} faults left: lower its number in UNFINISHED");
    }
}

#[test]
fn functions_are_called_by_what_they_do() {
    // Within quotes it is a name here.
    let forbidden = [["fn ", "of("].concat(), ["fn ", "of<"].concat()];
    let root = workspace_path("");
    let roots = ["host", "plugins", "shaders", "tests"].map(|folder| root.join(folder));
    for path in roots.iter().flat_map(|folder| rust_files(folder)) {
        let source = fs::read_to_string(&path).expect("sources are text");
        for (index, line) in source.lines().enumerate() {
            let is_named_so = forbidden.iter().any(|name| line.contains(name.as_str()));
            assert!(
                !is_named_so,
                "{}:{}: a function called `of`: name it by what it returns or does",
                path.display(),
                index + 1
            );
        }
    }
}

#[test]
fn faults_of_doc_comments_are_found() {
    let source = "//! Of it.\n//!\n//! More.\nfn a() {}\n    /// Returns the voltage,\n    /// in kV.\n\
                  fn b() {}\n/// Volts.\n//// no doc\n/// What it is for all.\n";
    let found = first_paragraphs(source);
    let told: Vec<_> = found.iter().map(|(line, text)| (*line, fault(text).is_some())).collect();
    assert_eq!(told, [(1, true), (5, false), (8, true), (10, true)]);
}
