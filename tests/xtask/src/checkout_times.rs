//! Modification times of a fresh checkout, set back where a file is as the build before had it:
//! cargo goes by times, and builds anew only what changed.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::process;

/// Files that are recorded at most.
const MAX_FILES: usize = 1 << 17;

/// Files of the checkout that the build in a target folder was last begun with.
#[derive(Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Checkout {
    /// Root folder of the checkout, which programs have built in.
    root: PathBuf,
    files: BTreeMap<String, RecordedFile>,
}

/// Content and time of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct RecordedFile {
    /// Git's id of the content.
    content: String,
    /// Modification time since 1970.
    modified: Duration,
}

/// Sets back the times of files whose content is that of the last build in `target` from the same
/// root, and records those of this one. Returns the number of files set back.
///
/// # Errors
/// If git does not list the files, or the record cannot be written.
pub(crate) fn restore(root: &Path, target: &Path) -> Result<usize> {
    let record = target.join("checkout.json");
    // A record that cannot be read is none: all is built.
    let before = fs::read(&record).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let before: Checkout = before.unwrap_or_default();
    let mut restored = 0;
    let mut now = Checkout { root: root.to_owned(), files: BTreeMap::new() };
    for (path, content) in unchanged_files(root)?.into_iter().take(MAX_FILES) {
        let Ok(file) = File::open(root.join(&path)) else { continue };
        let same = before.files.get(&path).filter(|of| of.content == content);
        if let Some(same) = same.filter(|_| before.root == root)
            && file.set_modified(UNIX_EPOCH + same.modified).is_ok()
        {
            restored += 1;
        }
        let modified = file.metadata().and_then(|metadata| metadata.modified());
        let modified = modified.unwrap_or_else(|_| SystemTime::now());
        let modified = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
        now.files.insert(path, RecordedFile { content, modified });
    }
    // Before the build: one that is broken off must not pass for that of an older content.
    fs::create_dir_all(target)
        .and_then(|()| fs::write(&record, serde_json::to_vec(&now)?))
        .with_context(|| format!("cannot write {}", record.display()))?;
    Ok(restored)
}

/// Files that git tracks and that are as it has them, with the ids of their contents.
fn unchanged_files(root: &Path) -> Result<BTreeMap<String, String>> {
    let list = |arguments: &[&str]| -> Result<String> {
        let mut command = Command::new("git");
        command.arg("-C").arg(root).args(["ls-files", "-z"]).args(arguments);
        let output = process::quiet_output(&mut command)?;
        anyhow::ensure!(output.status.success(), "git ls-files failed in {}", root.display());
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let staged = list(&["--stage"])?;
    let entries = staged.split_terminator('\0').filter_map(|entry| {
        // Mode, id and stage, then the path.
        let (description, path) = entry.split_once('\t')?;
        Some((path.to_owned(), description.split(' ').nth(1)?.to_owned()))
    });
    let mut files: BTreeMap<_, _> = entries.collect();
    for path in list(&["--modified"])?.split_terminator('\0') {
        files.remove(path);
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn git(folder: &Path, arguments: &[&str]) {
        let mut command = Command::new("git");
        command.arg("-C").arg(folder).args(["-c", "user.name=t", "-c", "user.email=t@example.org"]);
        assert!(process::succeeds(command.args(arguments)), "git {arguments:?}");
    }

    fn modified(path: &Path) -> SystemTime {
        fs::metadata(path).unwrap().modified().unwrap()
    }

    #[test]
    fn what_changed_keeps_its_time_and_the_rest_gets_that_of_the_last_build() {
        let folder = tempfile::tempdir().unwrap();
        let (root, target) = (folder.path().join("checkout"), folder.path().join("target"));
        fs::create_dir(&root).unwrap();
        git(&root, &["init", "--quiet"]);
        let [same, changed, edited] =
            ["same.rs", "changed.rs", "edited.rs"].map(|of| root.join(of));
        let set = |path: &Path, seconds| {
            let time = UNIX_EPOCH + Duration::from_secs(seconds);
            File::open(path).unwrap().set_modified(time).unwrap();
            time
        };
        for path in [&same, &changed, &edited] {
            fs::write(path, "one").unwrap();
        }
        let [built, ..] = [&same, &changed, &edited].map(|path| set(path, 1_000));
        git(&root, &["add", "."]);
        assert_eq!(restore(&root, &target).unwrap(), 0);

        // A later checkout: another content of one file, and one that is edited since.
        fs::write(&changed, "two").unwrap();
        git(&root, &["add", "."]);
        let [later, ..] = [&same, &changed, &edited].map(|path| set(path, 2_000));
        fs::write(&edited, "three").unwrap();
        set(&edited, 3_000);
        assert_eq!(restore(&root, &target).unwrap(), 1);
        assert_eq!((modified(&same), modified(&changed)), (built, later));
        assert_eq!(modified(&edited), UNIX_EPOCH + Duration::from_secs(3_000));

        // The content of before again, which the last build did not have.
        fs::write(&changed, "one").unwrap();
        git(&root, &["add", "."]);
        let latest = set(&changed, 4_000);
        restore(&root, &target).unwrap();
        assert_eq!(modified(&changed), latest);
    }

    #[test]
    fn another_root_is_built_anew() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("target");
        let [first, second] = ["first", "second"].map(|of| folder.path().join(of));
        for root in [&first, &second] {
            fs::create_dir(root).unwrap();
            git(root, &["init", "--quiet"]);
            fs::write(root.join("same.rs"), "one").unwrap();
            git(root, &["add", "."]);
        }
        assert_eq!(restore(&first, &target).unwrap(), 0);
        assert_eq!(restore(&second, &target).unwrap(), 0);
        assert_eq!(restore(&second, &target).unwrap(), 1);
    }
}
