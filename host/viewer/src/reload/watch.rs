//! When a file has changed and settled.
//!
//! Its folder is watched, since editors replace files by renaming others, and so is the
//! folder that a link leads to. Where folders tell nothing (some network drives), the file
//! is looked at now and then.

use std::collections::BTreeSet;
use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use notify::{RecommendedWatcher, RecursiveMode, Watcher};

/// How long a file must stay as it is before it is read: editors write in several steps.
pub const SETTLE: Duration = Duration::from_millis(50);
/// How often it is looked at where nobody tells of it.
const LOOK_PERIOD: Duration = Duration::from_secs(2);

/// What tells a file from the one before: where it is, its length, when it was written.
type Version = Option<(u64, u64, u64, i64, i64)>;

/// When a change settled that nobody has asked for yet.
type Settled = Mutex<Option<Instant>>;

/// Watches one file, until it is dropped.
pub(super) struct Watch {
    settled: Arc<Settled>,
}

impl Watch {
    /// Watches a file; `wake` is called when it changed and settled.
    pub(super) fn start(path: &Path, wake: Arc<dyn Fn() + Send + Sync>) -> std::io::Result<Self> {
        // One event that waits says all.
        let (sender, events) = sync_channel(1);
        let watcher = notify::recommended_watcher(move |_| {
            let _ = sender.try_send(());
        });
        let watcher = watcher
            .inspect_err(|error| {
                tracing::info!("the configuration is looked at now and then: {error}")
            })
            .ok();
        let settled = Arc::<Settled>::default();
        let mut watched = Watched {
            path: path.to_owned(),
            seen: version(path),
            settled: Arc::downgrade(&settled),
            wake,
            folders: BTreeSet::new(),
            watcher,
        };
        watched.watch_folders();
        let run = move || watched.run(&events);
        std::thread::Builder::new().name("configuration watch".into()).spawn(run)?;
        Ok(Self { settled })
    }

    /// When a change settled that was not told yet.
    pub(super) fn settled(&self) -> Option<Instant> {
        self.settled.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

struct Watched {
    path: PathBuf,
    /// As it was told, or at the start.
    seen: Version,
    settled: Weak<Settled>,
    wake: Arc<dyn Fn() + Send + Sync>,
    folders: BTreeSet<PathBuf>,
    watcher: Option<RecommendedWatcher>,
}

impl Watched {
    /// Until nobody asks any more, which is seen within [`LOOK_PERIOD`].
    fn run(mut self, events: &Receiver<()>) {
        while self.settled.strong_count() > 0 {
            match events.recv_timeout(LOOK_PERIOD) {
                Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK_PERIOD),
                Ok(()) | Err(RecvTimeoutError::Timeout) => {}
            }
            let mut now = version(&self.path);
            if now == self.seen {
                continue;
            }
            // Until it stays as it is.
            loop {
                std::thread::sleep(SETTLE);
                let later = version(&self.path);
                if later == now {
                    break;
                }
                now = later;
            }
            self.watch_folders();
            self.seen = now;
            let Some(settled) = self.settled.upgrade() else { return };
            // A file that is away is being replaced, or is gone: what is shown stays.
            if now.is_some() {
                *settled.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
                (self.wake)();
            }
        }
    }

    /// Watches the folder of the file, and that of the file that a link leads to.
    fn watch_folders(&mut self) {
        let Some(watcher) = &mut self.watcher else { return };
        let target = self.path.canonicalize().ok();
        let files = [Some(self.path.clone()), target].into_iter().flatten();
        let folders: BTreeSet<PathBuf> =
            files.filter_map(|file| file.parent().map(Path::to_owned)).collect();
        for folder in self.folders.difference(&folders) {
            // One that is gone is watched no more in any case.
            let _ = watcher.unwatch(folder);
        }
        self.folders.retain(|folder| folders.contains(folder));
        for folder in folders {
            if !self.folders.contains(&folder)
                && watcher.watch(&folder, RecursiveMode::NonRecursive).is_ok()
            {
                self.folders.insert(folder);
            }
        }
    }
}

fn version(path: &Path) -> Version {
    let of = |file: Metadata| (file.dev(), file.ino(), file.len(), file.mtime(), file.mtime_nsec());
    std::fs::metadata(path).ok().map(of)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;
    use std::sync::mpsc::channel;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(10);

    /// Waits for a change to settle; none within `patience`.
    fn next(watch: &Watch, woken: &Receiver<()>, patience: Duration) -> Option<Instant> {
        woken.recv_timeout(patience).ok()?;
        watch.settled()
    }

    #[test]
    fn a_file_is_told_once_it_rests_however_it_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        fs::write(&path, "0").unwrap();
        let (sender, woken) = channel();
        let watch = Watch::start(
            &path,
            Arc::new(move || {
                let _ = sender.send(());
            }),
        )
        .unwrap();
        fs::write(folder.path().join("other.json"), "1").unwrap();
        assert!(next(&watch, &woken, SETTLE * 4).is_none(), "another file");

        // In place, in several steps.
        let begun = Instant::now();
        for text in ["1", "12", "123"] {
            fs::write(&path, text).unwrap();
            std::thread::sleep(SETTLE / 3);
        }
        let written = Instant::now();
        let settled = next(&watch, &woken, PATIENCE).unwrap();
        assert!(settled >= begun + SETTLE && settled < written + PATIENCE / 2);
        assert_eq!(watch.settled(), None, "once");

        // By a new file in its place, away and back, and by a link that leads elsewhere.
        fs::write(folder.path().join(".new"), "1234").unwrap();
        fs::rename(folder.path().join(".new"), &path).unwrap();
        assert!(next(&watch, &woken, PATIENCE).is_some());
        fs::remove_file(&path).unwrap();
        std::thread::sleep(SETTLE * 3);
        assert!(watch.settled().is_none(), "a file that is gone is not to be read");
        let elsewhere = tempfile::tempdir().unwrap();
        fs::write(elsewhere.path().join("real.json"), "5").unwrap();
        symlink(elsewhere.path().join("real.json"), &path).unwrap();
        assert!(next(&watch, &woken, PATIENCE).is_some());
        std::thread::sleep(SETTLE * 3);
        fs::write(elsewhere.path().join("real.json"), "56").unwrap();
        assert!(next(&watch, &woken, PATIENCE).is_some(), "what the link leads to");
    }

    #[test]
    fn the_thread_ends_with_the_watch() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        fs::write(&path, "0").unwrap();
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(|| {});
        let watch = Watch::start(&path, Arc::clone(&wake)).unwrap();
        drop(watch);
        let start = Instant::now();
        while Arc::strong_count(&wake) > 1 && start.elapsed() < PATIENCE {
            std::thread::sleep(SETTLE);
        }
        assert_eq!(Arc::strong_count(&wake), 1);
    }
}
