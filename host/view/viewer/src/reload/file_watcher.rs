//! File watcher for the configuration and its models, with debouncing of writes.
//!
//! Folders are watched, since editors replace files by renaming; folders of link targets are
//! watched, too. Files in folders without notification, such as some network drives, are polled.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use notify::{RecommendedWatcher, RecursiveMode, Watcher};

use busbar_scene_loader::{FileVersion, file_version};

/// Debounce time: a file must be unchanged for so long before it is read.
pub const SETTLE_TIME: Duration = Duration::from_millis(50);
/// Polling period for files without change notification.
const POLL_PERIOD: Duration = Duration::from_secs(2);
/// Folders that are watched; files elsewhere are looked at now and then.
const MAX_FOLDERS: usize = 64;

/// Files, and as what each is known.
type Versions = BTreeMap<PathBuf, FileVersion>;

/// State shared with the watching thread.
#[derive(Default)]
struct Shared {
    /// Instant at which an unreported change settled.
    settled: Mutex<Option<Instant>>,
    /// Models to follow from now on, in place of those before.
    models: Mutex<Option<Versions>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Watches one configuration and its models, until it is dropped.
pub(super) struct FileWatcher {
    shared: Arc<Shared>,
    events: SyncSender<()>,
}

impl FileWatcher {
    /// Watches a file; `wake` is called when it changed and settled.
    pub(super) fn start(path: &Path, wake: Arc<dyn Fn() + Send + Sync>) -> std::io::Result<Self> {
        // One event that waits says all.
        let (sender, events) = sync_channel(1);
        let told = sender.clone();
        let watcher = notify::recommended_watcher(move |_| {
            let _ = told.try_send(());
        });
        let watcher = watcher
            .inspect_err(|error| {
                tracing::info!("the configuration is looked at now and then: {error}")
            })
            .ok();
        let shared = Arc::<Shared>::default();
        let mut watched = WatchThread {
            path: path.to_owned(),
            seen: Versions::from([(path.to_owned(), file_version(path))]),
            shared: Arc::downgrade(&shared),
            wake,
            folders: BTreeSet::new(),
            watcher,
        };
        watched.watch_folders();
        let run = move || watched.run(&events);
        std::thread::Builder::new().name("configuration watch".into()).spawn(run)?;
        Ok(Self { shared, events: sender })
    }

    /// Takes the instant at which an unreported change settled.
    pub(super) fn settled(&self) -> Option<Instant> {
        lock(&self.shared.settled).take()
    }

    /// Watches these models, at the versions that are shown, in place of those before.
    pub(super) fn follow_models(&self, models: impl Iterator<Item = (PathBuf, FileVersion)>) {
        *lock(&self.shared.models) = Some(models.collect());
        let _ = self.events.try_send(());
    }
}

struct WatchThread {
    path: PathBuf,
    /// Versions that were last reported, or those at the start.
    seen: Versions,
    shared: Weak<Shared>,
    wake: Arc<dyn Fn() + Send + Sync>,
    folders: BTreeSet<PathBuf>,
    watcher: Option<RecommendedWatcher>,
}

impl WatchThread {
    /// Runs until the watcher is dropped, which is noticed within [`POLL_PERIOD`].
    fn run(mut self, events: &Receiver<()>) {
        while let Some(shared) = self.shared.upgrade() {
            let models = lock(&shared.models).take();
            drop(shared);
            if let Some(models) = models {
                self.set_models(models);
            }
            self.check_files();
            if events.recv_timeout(POLL_PERIOD) == Err(RecvTimeoutError::Disconnected) {
                std::thread::sleep(POLL_PERIOD);
            }
        }
    }

    /// The configuration stays; a model counts as it is shown.
    fn set_models(&mut self, models: Versions) {
        let own = self.seen.remove(&self.path).unwrap_or_default();
        self.seen = models;
        self.seen.insert(self.path.clone(), own);
        self.watch_folders();
    }

    /// Reports changes once the files are stable.
    fn check_files(&mut self) {
        let mut now = self.versions();
        if now == self.seen {
            return;
        }
        loop {
            std::thread::sleep(SETTLE_TIME);
            let later = self.versions();
            if later == now {
                break;
            }
            now = later;
        }
        self.watch_folders();
        // A file that is away is being replaced, or is gone: what is shown stays.
        let is_news = now
            .iter()
            .any(|(path, version)| version.is_some() && self.seen.get(path) != Some(version));
        self.seen = now;
        if let Some(shared) = self.shared.upgrade().filter(|_| is_news) {
            *lock(&shared.settled) = Some(Instant::now());
            (self.wake)();
        }
    }

    fn versions(&self) -> Versions {
        self.seen.keys().map(|path| (path.clone(), file_version(path))).collect()
    }

    /// Watches the folders of the files, and of those that links lead to.
    fn watch_folders(&mut self) {
        let Some(watcher) = &mut self.watcher else { return };
        let mut folders = BTreeSet::new();
        let others = self.seen.keys().filter(|path| **path != self.path);
        for file in std::iter::once(&self.path).chain(others) {
            let files = [Some(file.clone()), file.canonicalize().ok()];
            let parents = files.iter().flatten().filter_map(|file| file.parent());
            folders.extend(parents.map(Path::to_owned));
            if folders.len() >= MAX_FOLDERS {
                break;
            }
        }
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

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;
    use std::sync::mpsc::channel;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(10);

    /// Waits for a change to settle; none within `patience`.
    fn next(
        file_watcher: &FileWatcher,
        woken: &Receiver<()>,
        patience: Duration,
    ) -> Option<Instant> {
        woken.recv_timeout(patience).ok()?;
        file_watcher.settled()
    }

    #[test]
    fn a_changed_file_is_reported_once_it_settles_for_every_way_of_writing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        fs::write(&path, "0").unwrap();
        let (sender, woken) = channel();
        let file_watcher = FileWatcher::start(
            &path,
            Arc::new(move || {
                let _ = sender.send(());
            }),
        )
        .unwrap();
        fs::write(folder.path().join("other.json"), "1").unwrap();
        assert!(next(&file_watcher, &woken, SETTLE_TIME * 4).is_none(), "another file");

        // In place, in several steps.
        let begun = Instant::now();
        for text in ["1", "12", "123"] {
            fs::write(&path, text).unwrap();
            std::thread::sleep(SETTLE_TIME / 3);
        }
        let written = Instant::now();
        let settled = next(&file_watcher, &woken, PATIENCE).unwrap();
        assert!(settled >= begun + SETTLE_TIME && settled < written + PATIENCE / 2);
        assert_eq!(file_watcher.settled(), None, "once");

        // By a new file in its place, away and back, and by a link that leads elsewhere.
        fs::write(folder.path().join(".new"), "1234").unwrap();
        fs::rename(folder.path().join(".new"), &path).unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some());
        fs::remove_file(&path).unwrap();
        std::thread::sleep(SETTLE_TIME * 3);
        assert!(file_watcher.settled().is_none(), "a file that is gone is not to be read");
        let elsewhere = tempfile::tempdir().unwrap();
        fs::write(elsewhere.path().join("real.json"), "5").unwrap();
        symlink(elsewhere.path().join("real.json"), &path).unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some());
        std::thread::sleep(SETTLE_TIME * 3);
        fs::write(elsewhere.path().join("real.json"), "56").unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some(), "what the link leads to");
    }

    #[test]
    fn model_edits_are_detected_against_the_shown_versions() {
        let folder = tempfile::tempdir().unwrap();
        let [path, model] = ["scene.json", "a.glb"].map(|name| folder.path().join(name));
        fs::write(&path, "0").unwrap();
        fs::write(&model, "shown").unwrap();
        let shown = file_version(&model);
        let (sender, woken) = channel();
        let wake = move || {
            let _ = sender.send(());
        };
        let file_watcher = FileWatcher::start(&path, Arc::new(wake)).unwrap();
        // Between its loading and here.
        fs::write(&model, "edited").unwrap();
        file_watcher.follow_models([(model.clone(), shown)].into_iter());
        assert!(next(&file_watcher, &woken, PATIENCE).is_some());
        fs::write(&model, "edited again").unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some());
        fs::remove_file(&model).unwrap();
        assert!(next(&file_watcher, &woken, SETTLE_TIME * 4).is_none(), "away");
        fs::write(&model, "back").unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some());
        file_watcher.follow_models(std::iter::empty());
        std::thread::sleep(SETTLE_TIME * 2);
        fs::write(&model, "of no use any more").unwrap();
        assert!(next(&file_watcher, &woken, SETTLE_TIME * 4).is_none());
        fs::write(&path, "1").unwrap();
        assert!(next(&file_watcher, &woken, PATIENCE).is_some(), "the configuration");
    }

    #[test]
    fn the_thread_ends_when_the_watcher_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        fs::write(&path, "0").unwrap();
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(|| {});
        let file_watcher = FileWatcher::start(&path, Arc::clone(&wake)).unwrap();
        drop(file_watcher);
        let start = Instant::now();
        while Arc::strong_count(&wake) > 1 && start.elapsed() < PATIENCE {
            std::thread::sleep(SETTLE_TIME);
        }
        assert_eq!(Arc::strong_count(&wake), 1);
    }
}
