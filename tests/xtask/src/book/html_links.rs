//! Link check of built HTML pages: files and anchors.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, bail};

/// Attributes that hold links.
const ATTRIBUTES: [&str; 2] = [" href=\"", " src=\""];
/// Page that mdBook writes for servers; its links are relative to the server's root.
const NOT_FOUND_PAGE: &str = "404.html";
/// Page that repeats all others.
const PRINT_PAGE: &str = "print.html";

/// Returns how many pages a folder has, and each link that leads nowhere. Links to other
/// servers are not followed.
pub(super) fn check(folder: &Path) -> Result<(usize, Vec<String>)> {
    let mut pages = BTreeMap::new();
    collect(folder, &mut pages)?;
    if pages.is_empty() {
        bail!("{} has no page", folder.display());
    }
    let anchors: BTreeMap<_, BTreeSet<_>> =
        pages.iter().map(|(path, text)| (path, values(text, " id=\"").collect())).collect();
    let mut broken = Vec::new();
    for (path, text) in &pages {
        for link in ATTRIBUTES.iter().flat_map(|attribute| values(text, attribute)) {
            if is_elsewhere(link) {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { path.clone() } else { resolve(path, file) };
            let leads_somewhere = match anchors.get(&target) {
                Some(anchors) => anchor.is_empty() || anchors.contains(anchor),
                None => target.exists(),
            };
            if !leads_somewhere {
                broken.push(format!("{} leads to {link}", path.display()));
            }
        }
    }
    Ok((pages.len(), broken))
}

fn collect(folder: &Path, pages: &mut BTreeMap<PathBuf, String>) -> Result<()> {
    let list = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    for entry in list {
        let path = entry.with_context(|| format!("cannot list {}", folder.display()))?.path();
        let is_page = path.extension().is_some_and(|extension| extension == "html");
        let is_special = path.ends_with(NOT_FOUND_PAGE) || path.ends_with(PRINT_PAGE);
        if path.is_dir() {
            collect(&path, pages)?;
        } else if is_page && !is_special {
            let text = fs::read_to_string(&path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            pages.insert(path, text);
        }
    }
    Ok(())
}

fn values<'a>(text: &'a str, attribute: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(attribute).skip(1).filter_map(|rest| rest.split('"').next())
}

fn is_elsewhere(link: &str) -> bool {
    let scheme = link.split(['/', '#', '?']).next().unwrap_or_default();
    link.is_empty() || link.starts_with("//") || scheme.contains(':')
}

/// Returns the file that a relative link of a page names; `..` is resolved by its text.
fn resolve(page: &Path, link: &str) -> PathBuf {
    let file = link.split('?').next().unwrap_or_default();
    let mut target = page.parent().map(Path::to_owned).unwrap_or_default();
    for component in Path::new(file).components() {
        match component {
            Component::ParentDir => {
                target.pop();
            }
            Component::CurDir => {}
            other => target.push(other),
        }
    }
    target
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_anchors_are_checked() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("a.html", "<h1 id=\"top\"></h1><a href=\"b/c.html#good\"></a><img src=\"d.png\">");
        write(
            "b/c.html",
            "<h2 id=\"good\"></h2><a href=\"../a.html#none\"></a><a href=\"#good\"></a>\
             <a href=\"https://h.example/x\"></a><a href=\"mailto:a@b\"></a>",
        );
        let (pages, broken) = check(folder.path()).unwrap();
        assert_eq!(pages, 2);
        let ends: Vec<_> = broken.iter().map(|line| line.rsplit('/').next().unwrap()).collect();
        assert_eq!(ends, ["a.html leads to d.png", "a.html#none"]);
    }

    #[test]
    fn a_folder_without_pages_is_a_fault() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check(folder.path()).is_err());
    }
}
