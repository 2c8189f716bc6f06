//! Declarations of dependencies: one version for all crates, in the workspace's manifest, with the
//! purpose of each.

use std::collections::BTreeMap;
use std::fs;

use e2e::workspace_path;

use crate::packages;

/// Names in the dependency tables of a manifest, each with its declaration.
fn declarations(manifest: &str) -> Vec<(&str, &str)> {
    let mut is_dependency = false;
    let mut found = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_dependency = line.trim_end_matches(']').ends_with("dependencies");
        } else if let Some((name, declaration)) = line.split_once('=').filter(|_| is_dependency)
            && !name.starts_with('#')
        {
            found.push((name.trim(), declaration.trim()));
        }
    }
    found
}

#[test]
fn dependencies_of_several_crates_are_declared_by_the_workspace() {
    let mut declared: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (name, package) in packages() {
        let manifest = fs::read_to_string(package.folder.join("Cargo.toml")).expect("it is text");
        for (dependency, declaration) in declarations(&manifest) {
            if !dependency.ends_with(".workspace") && !declaration.contains("workspace = true") {
                declared.entry(dependency.to_owned()).or_default().push(name.clone());
            }
        }
    }
    assert!(declared.len() > 10, "{declared:?}");
    declared.retain(|_, crates| crates.len() > 1);
    assert!(declared.is_empty(), "not of the workspace: {declared:?}");
}

#[test]
fn dependencies_of_the_workspace_have_a_purpose() {
    let manifest = fs::read_to_string(workspace_path("Cargo.toml")).expect("it is text");
    let (_, table) = manifest.split_once("[workspace.dependencies]").expect("it has the table");
    let table = table.split("\n[").next().unwrap_or_default();
    let lines: Vec<_> = table.lines().collect();
    let mut seen = 0;
    for pair in lines.windows(2) {
        let [before, line] = pair else { continue };
        let is_own = line.contains("{ path = ");
        if line.is_empty() || line.starts_with('#') || is_own {
            continue;
        }
        seen += 1;
        assert!(before.starts_with("# "), "{line}: no purpose in the line above");
    }
    assert!(seen > 40, "{seen} dependencies looked at");
}

#[test]
fn declarations_are_read() {
    let manifest = "[package]\nname = \"a\"\n[dependencies]\n# A purpose = b.\nb = \"1\"\nc.workspace = true\n\
                    [lints]\nworkspace = true\n[target.x.dev-dependencies]\nd = { version = \"2\" }\n";
    let found = declarations(manifest);
    assert_eq!(found, [("b", "\"1\""), ("c.workspace", "true"), ("d", "{ version = \"2\" }")]);
}
