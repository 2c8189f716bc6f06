//! Size of crates: lines of code, their tests aside.

use std::fs;

use e2e::workspace_path;

use crate::{is_test, packages, rust_files, without_test_modules};

/// Lines that a crate has at most, its tests aside.
const MAX_LINES: usize = 8_000;
/// Crates that are still to be divided, and the most lines that each may have until then.
const UNDIVIDED: [(&str, usize); 1] = [("busbar_viewer", 20_000)];

#[test]
fn crates_are_small_enough_to_be_known() {
    let tests = workspace_path("tests").canonicalize().expect("it is there");
    for (name, package) in packages() {
        // Crates of tests are made of them: there all counts.
        let is_of_tests = package.folder.canonicalize().expect("it is there").starts_with(&tests);
        let counted = |path: &std::path::PathBuf| {
            let within = path.strip_prefix(&package.folder).expect("it is below");
            is_of_tests || !is_test(within)
        };
        let lines = |path: &std::path::PathBuf| {
            let text = fs::read_to_string(path).expect("sources are text");
            if is_of_tests {
                text.lines().count()
            } else {
                without_test_modules(&text).lines().count()
            }
        };
        let count: usize =
            rust_files(&package.folder).iter().filter(|p| counted(p)).map(lines).sum();
        let undivided = UNDIVIDED.iter().find(|(crate_name, _)| *crate_name == name);
        let most = undivided.map_or(MAX_LINES, |(_, most)| *most);
        assert!(count <= most, "{name} has {count} lines, at most {most} are allowed: divide it");
        assert!(
            undivided.is_none() || count > MAX_LINES,
            "{name} has {count} lines: take it off UNDIVIDED"
        );
    }
}
