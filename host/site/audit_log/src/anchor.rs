//! Anchor: number and chain value of the newest record, in a file outside the log's folder.
//!
//! Lines that are removed at the end of a log leave a chain that is whole. The anchor tells
//! how far it went.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use serde::{Deserialize, Serialize};

use crate::chain::{ChainKey, Digest256, KeyRing};
use crate::line::{self, Line};

/// The longest anchor, in bytes.
const MAX_ANCHOR_BYTES: u64 = 4_096;

/// End of a log: the newest record that is on the disk.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Anchor {
    /// Number of the file.
    pub(crate) file: u64,
    /// Number of the record.
    pub(crate) number: u64,
    /// Chain value of its line, hexadecimal.
    pub(crate) at: String,
    /// Name of the key.
    pub(crate) key: String,
}

impl Anchor {
    pub(crate) fn value(&self) -> Option<Digest256> {
        self.at.parse().ok()
    }
}

/// An anchor as it was found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum AnchorState {
    /// No anchor is configured.
    #[default]
    Unused,
    /// The file does not exist.
    Absent,
    /// The file is no anchor under this key, or cannot be read.
    Unusable(String),
    /// One that may be believed as far as its key.
    Found(Anchor),
}

/// Reads an anchor; links are not followed.
pub(crate) fn read(path: &Path, keys: &KeyRing) -> AnchorState {
    match read_text(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => AnchorState::Absent,
        Err(error) => AnchorState::Unusable(error.to_string()),
        Ok(text) => parse(&text, keys),
    }
}

/// Parses the text of an anchor, and checks it by its key.
pub(crate) fn parse(text: &[u8], keys: &KeyRing) -> AnchorState {
    let unusable = |cause: &str| AnchorState::Unusable(cause.to_owned());
    let line = text.strip_suffix(b"\n").and_then(line::read);
    let Some(line) = line else { return unusable("it is damaged") };
    let (Line::Anchor(anchor), Some(link)) = (line.content, line.link) else {
        return unusable("it is not understood");
    };
    match keys.find(&anchor.key) {
        None => unusable("it was written with another key"),
        Some(key) if !link.follows(&Digest256::default(), key) => unusable("it was changed"),
        // Whoever has no key can make one without.
        Some(key) if keys.is_keyed() && key.id().is_empty() => {
            unusable("it was written without key")
        }
        Some(_) if anchor.number > line::MAX_NUMBER || anchor.file > line::MAX_NUMBER => {
            unusable("its numbers are impossible")
        }
        Some(_) => AnchorState::Found(anchor),
    }
}

/// The text of an anchor.
pub(crate) fn text_of(anchor: &Anchor, key: &ChainKey) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    line::write(&mut text, line::ANCHOR, anchor, &Digest256::default(), key)?;
    Ok(text)
}

/// Writes an anchor: the new one is on the disk before it takes the place of the old one.
pub(crate) fn write(path: &Path, anchor: &Anchor, key: &ChainKey) -> io::Result<()> {
    let text = text_of(anchor, key)?;
    let beside = scratch_of(path)?;
    match std::fs::remove_file(&beside) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let flags = OFlags::NOFOLLOW.bits() as i32;
    let mut options = OpenOptions::new();
    let mut file =
        options.write(true).create_new(true).mode(0o600).custom_flags(flags).open(&beside)?;
    file.write_all(&text)?;
    file.sync_all()?;
    std::fs::rename(&beside, path)?;
    File::open(folder_of(path))?.sync_all()
}

/// Checks that an anchor could be written, and writes nothing.
pub(crate) fn check_writable(path: &Path) -> io::Result<()> {
    scratch_of(path)?;
    let access = rustix::fs::Access::WRITE_OK | rustix::fs::Access::EXEC_OK;
    Ok(rustix::fs::access(folder_of(path), access)?)
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn scratch_of(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| io::Error::other("it names no file"))?;
    let mut name = name.to_owned();
    name.push(".new");
    Ok(path.with_file_name(name))
}

fn read_text(path: &Path) -> io::Result<Vec<u8>> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
    let file = OpenOptions::new().read(true).custom_flags(flags.bits() as i32).open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let mut text = Vec::new();
    file.take(MAX_ANCHOR_BYTES + 1).read_to_end(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_anchor_is_believed_under_its_key_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("anchor");
        let key = ChainKey::new(b"0123456789abcdef");
        let anchor = Anchor {
            file: 3,
            number: 70,
            at: Digest256::default().to_string(),
            key: key.id().to_owned(),
        };
        let ring = KeyRing::new(Some(key.clone()));
        assert_eq!(read(&path, &ring), AnchorState::Absent);
        check_writable(&path).unwrap();
        for number in [70, 71] {
            let anchor = Anchor { number, ..anchor.clone() };
            write(&path, &anchor, &key).unwrap();
            assert_eq!(read(&path, &ring), AnchorState::Found(anchor));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no other file is left");
        let is_refused = |ring: &KeyRing| matches!(read(&path, ring), AnchorState::Unusable(_));
        assert!(is_refused(&KeyRing::default()));
        assert!(is_refused(&KeyRing::new(Some(ChainKey::new(b"another key, as long")))));
        let text = std::fs::read(&path).unwrap();
        let changed =
            String::from_utf8(text.clone()).unwrap().replace("\"number\":71", "\"number\":61");
        std::fs::write(&path, changed).unwrap();
        assert!(is_refused(&ring));
        std::fs::write(&path, &text[..text.len() / 2]).unwrap();
        assert!(is_refused(&ring));
        let unkeyed = Anchor { key: String::new(), ..anchor };
        write(&path, &unkeyed, &ChainKey::default()).unwrap();
        assert!(is_refused(&ring), "anybody can write it");
        assert_eq!(read(&path, &KeyRing::default()), AnchorState::Found(unkeyed));
        let aside = folder.path().join("aside");
        std::fs::rename(&path, &aside).unwrap();
        std::os::unix::fs::symlink(&aside, &path).unwrap();
        assert!(is_refused(&KeyRing::default()), "links are not followed");
    }
}
