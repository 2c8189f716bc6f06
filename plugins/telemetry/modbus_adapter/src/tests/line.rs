//! A serial line without wires: two pseudo-terminals that socat joins.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use super::peer::available;
use super::*;

/// A line with two ends, each a device file; cut when dropped.
pub(crate) struct Line {
    socat: Child,
    folder: tempfile::TempDir,
}

impl Line {
    /// Lays a line; `None`, said aloud, where there is no socat. Where peers are
    /// required that is a failure.
    pub(crate) fn lay() -> Option<Self> {
        let has_socat = Command::new("socat").arg("-V").stdout(Stdio::null()).status().is_ok();
        if !available(has_socat, "no socat: install it") {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let socat = join(folder.path());
        Some(Self { socat, folder })
    }

    /// Returns the adapter's end of the line.
    pub(super) fn ours(&self) -> PathBuf {
        self.folder.path().join("ours")
    }

    /// Returns the devices' end of the line.
    pub(crate) fn theirs(&self) -> PathBuf {
        self.folder.path().join("theirs")
    }

    /// Takes the line away.
    pub(super) fn cut(&mut self) {
        let _ = self.socat.kill();
        let _ = self.socat.wait();
        for end in [self.ours(), self.theirs()] {
            let _ = std::fs::remove_file(end);
        }
    }

    /// Joins the two pseudo-terminals again after a cut.
    pub(super) fn mend(&mut self) {
        self.socat = join(self.folder.path());
    }

    /// Starts an adapter at our end; `settings` are added to fast ones.
    pub(super) fn start(&self, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
        let mut all = self.settings();
        add(&mut all, settings);
        start_with(all, QUICK, tags)
    }

    pub(crate) fn settings(&self) -> serde_json::Value {
        json!({"serial": {"device": self.ours()}, "timeout_seconds": 0.4})
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.cut();
    }
}

fn join(folder: &Path) -> Child {
    let ends = ["ours", "theirs"].map(|name| folder.join(name));
    let mut socat = Command::new("socat");
    for end in &ends {
        socat.arg(format!("pty,raw,echo=0,link={}", end.display()));
    }
    let child = socat.spawn().unwrap();
    let deadline = Instant::now() + PATIENCE;
    while !ends.iter().all(|end| end.exists()) {
        assert!(Instant::now() < deadline, "socat laid no line");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}
