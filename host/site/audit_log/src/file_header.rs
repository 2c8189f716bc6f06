//! First line of a file: its number, its key, and the manifest of the files before it.

use serde::{Deserialize, Serialize};

/// Files that a manifest lists, the newest; older ones stay in the folder, unlisted.
pub(crate) const MAX_LISTED_FILES: usize = 2_000;
/// Remarks that a header keeps.
pub(crate) const MAX_REMARKS: usize = 20;
/// Length of a remark that a header keeps, in bytes.
pub(crate) const MAX_REMARK_BYTES: usize = 500;

/// Header of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FileHeader {
    /// Number of the file; each has one more than the one before.
    pub(crate) file: u64,
    /// Name of the key that its lines are chained by; empty for none.
    pub(crate) key: String,
    /// Number of the newest record before it.
    pub(crate) after: u64,
    /// Carried records that follow.
    pub(crate) carried: u64,
    /// True where an anchor existed when the file began.
    #[serde(default)]
    pub(crate) has_anchor: bool,
    /// The files before it that are kept, the oldest first, as they ended.
    #[serde(default)]
    pub(crate) files: Vec<ListedFile>,
    /// Names of files that were removed for it, being more than are to be kept.
    #[serde(default)]
    pub(crate) removed: Vec<String>,
    /// Faults that were found when it began.
    #[serde(default)]
    pub(crate) remarks: Vec<String>,
}

/// A file of a manifest.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ListedFile {
    pub(crate) name: String,
    /// Size at its end, bytes.
    pub(crate) bytes: u64,
    /// SHA-256 of so many bytes, hexadecimal.
    pub(crate) sha256: String,
    /// True where unsynced records may follow; the next file repeats them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) is_unsynced: bool,
}

impl FileHeader {
    /// Keeps remarks up to the limit of a header.
    pub(crate) fn keep_remarks(&mut self, remarks: &[String]) {
        let short = |remark: &String| {
            let end = remark.floor_char_boundary(MAX_REMARK_BYTES);
            remark[..end].to_owned()
        };
        self.remarks = remarks.iter().take(MAX_REMARKS).map(short).collect();
    }
}
