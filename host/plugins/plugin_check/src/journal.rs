//! Journal file of a case: calls about to be made, and findings.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::finding::Finding;

/// Bytes of a journal that are read.
const MAX_JOURNAL_BYTES: u64 = 64 << 20;

/// One line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Entry {
    /// A function of the plugin is called next.
    Calling(String),
    /// A plugin of the library.
    Plugin(PluginFacts),
    /// Finding of the case.
    Found(Finding),
    /// The case does not apply.
    Skipped(String),
    /// The case stopped after a finding.
    Stopped,
    /// The case came to its end.
    Ended,
}

/// Facts about a plugin on which other cases depend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PluginFacts {
    /// Id of the plugin.
    pub(crate) id: String,
    /// Ids of its capabilities.
    pub(crate) capabilities: Vec<String>,
}

/// A journal being written. The file is opened anew for each line, so that a plugin
/// that closes descriptors of others cannot silence it.
pub(crate) struct Journal {
    path: PathBuf,
    last: Mutex<Option<Entry>>,
}

impl Journal {
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path, last: Mutex::new(None) }
    }

    /// Adds a line, unless it repeats the last one. A journal that cannot be written
    /// shows as a case without an end.
    pub(crate) fn note(&self, entry: Entry) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.as_ref() == Some(&entry) {
            return;
        }
        if let Ok(mut line) = serde_json::to_string(&entry) {
            line.push('\n');
            let file = OpenOptions::new().create(true).append(true).open(&self.path);
            let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
        }
        *last = Some(entry);
    }
}

/// Reads a journal; a line that is cut short, as by a crash, ends it.
pub(crate) fn read(path: &Path) -> Vec<Entry> {
    let small = std::fs::metadata(path).is_ok_and(|file| file.len() <= MAX_JOURNAL_BYTES);
    let text =
        if small { std::fs::read_to_string(path).unwrap_or_default() } else { String::new() };
    text.lines().map_while(|line| serde_json::from_str(line).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_ends_a_journal() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let journal = Journal::new(path.clone());
        let calling = |name: &str| Entry::Calling(name.into());
        for name in ["init", "init", "create"] {
            journal.note(calling(name));
        }
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        file.write_all(b"{\"calling\":\"dest").unwrap();
        assert_eq!(read(&path), [calling("init"), calling("create")]);
        assert_eq!(read(&folder.path().join("absent")), []);
    }
}
