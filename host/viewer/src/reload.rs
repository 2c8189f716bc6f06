//! Hot reload: the configuration file and its models are watched, loaded beside the frames when
//! one changed, and shown where it has no fault. One that has leaves the scene as it is.

mod file_watcher;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::Viewer;
use crate::load::{LoadedScene, PreparedReload, ReloadError};
use file_watcher::FileWatcher;
pub use file_watcher::SETTLE_TIME;

/// Bytes of a fault that are kept to be shown; a file may have two hundred.
const MAX_FAULT_BYTES: usize = 4_000;

/// How long a frame waits for an edit that was just begun to be loaded: most take less, and
/// are shown a frame earlier.
const LOAD_GRACE: Duration = Duration::from_millis(30);

/// How reloading went so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReloadCounters {
    /// Configurations that were shown in place of the one before.
    pub good: u64,
    /// Those that were not, for faults.
    pub bad: u64,
    /// From the file's settling to the frame that shows it, of the last good one; not
    /// counting the frame itself.
    pub last: Option<Duration>,
    /// The faults of the file as it is, if it has any: what is shown is the one before.
    pub fault: Option<String>,
}

impl ReloadCounters {
    /// Notes how a configuration fared that is asked for.
    pub(crate) fn note(&mut self, outcome: &ReloadOutcome, since: Instant) {
        match outcome {
            ReloadOutcome::Shown => {
                self.good += 1;
                (self.last, self.fault) = (Some(since.elapsed()), None);
            }
            ReloadOutcome::Same => self.fault = None,
            ReloadOutcome::Refused(fault) => {
                self.bad += 1;
                self.fault = Some(shortened(fault));
            }
        }
    }
}

fn shortened(fault: &str) -> String {
    if fault.len() <= MAX_FAULT_BYTES {
        return fault.to_owned();
    }
    let end = (0..=MAX_FAULT_BYTES).rev().find(|end| fault.is_char_boundary(*end)).unwrap_or(0);
    format!("{}\u{2026}", &fault[..end])
}

/// What became of a configuration that was to be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReloadOutcome {
    /// It is shown from the next frame on.
    Shown,
    /// Nothing is otherwise than it was.
    Same,
    /// It has faults, as these words say; the scene before stays.
    Refused(String),
}

/// A configuration that is loaded beside the frames.
pub(crate) struct BackgroundLoad {
    since: Instant,
    loaded: Receiver<LoadResult>,
}

type LoadResult = Result<Option<PreparedReload>, ReloadError>;

impl BackgroundLoad {
    /// Begins to load a file in place of what a viewer shows; `wake` is called once it is
    /// there.
    ///
    /// # Errors
    /// Without a thread for it.
    pub(crate) fn begin(
        viewer: &Viewer,
        path: &Path,
        since: Instant,
        wake: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (scene, path): (LoadedScene, PathBuf) = (viewer.shared_scene(), path.to_owned());
        let (sender, loaded) = channel();
        let load = move || {
            // Nobody listens any more when the viewer has gone.
            let _ = sender.send(scene.reload(&path));
            drop(scene);
            wake();
        };
        std::thread::Builder::new().name("reload".into()).spawn(load)?;
        Ok(Self { since, loaded })
    }

    /// Shows it, once it is there; none before.
    ///
    /// # Errors
    /// The device's.
    pub(crate) fn step(&self, viewer: &mut Viewer) -> Option<ReloadOutcome> {
        self.step_within(Duration::ZERO, viewer)
    }

    /// As [`BackgroundLoad::step`], but waits a while for it to be there.
    fn step_within(&self, grace: Duration, viewer: &mut Viewer) -> Option<ReloadOutcome> {
        let outcome = match self.loaded.recv_timeout(grace) {
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => {
                ReloadOutcome::Refused("a fault of Busbar itself; please report it".into())
            }
            Ok(Err(error)) => ReloadOutcome::Refused(error.to_string()),
            Ok(Ok(None)) => ReloadOutcome::Same,
            Ok(Ok(Some(reload))) => match viewer.apply_reload(reload) {
                Ok(()) => ReloadOutcome::Shown,
                Err(error) => ReloadOutcome::Refused(error.to_string()),
            },
        };
        viewer.reload_counters_mut().note(&outcome, self.since);
        Some(outcome)
    }
}

/// Watches the configuration file of a viewer and shows what it becomes.
pub struct Reloader {
    path: PathBuf,
    file_watcher: FileWatcher,
    loading: Option<BackgroundLoad>,
    /// Whether the models of what is shown are watched.
    follows_models: bool,
    wake: std::sync::Arc<dyn Fn() + Send + Sync>,
}

impl Reloader {
    /// Watches a file; `wake` is called from other threads when [`Reloader::step`] has
    /// something to do.
    ///
    /// # Errors
    /// Without a thread for it.
    pub fn start(path: &Path, wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let wake: std::sync::Arc<dyn Fn() + Send + Sync> = std::sync::Arc::new(wake);
        let path = std::path::absolute(path)?;
        let file_watcher = FileWatcher::start(&path, std::sync::Arc::clone(&wake))?;
        Ok(Self { path, file_watcher, loading: None, follows_models: false, wake })
    }

    /// Between frames: begins to load a file that has changed and settled, and shows it once
    /// it is loaded. What became of it, when that is known.
    pub fn step(&mut self, viewer: &mut Viewer) -> Option<ReloadOutcome> {
        if !std::mem::replace(&mut self.follows_models, true) {
            self.file_watcher.follow_models(viewer.model_files());
        }
        let mut grace = Duration::ZERO;
        if self.loading.is_none() {
            grace = LOAD_GRACE;
            let since = self.file_watcher.settled()?;
            let wake = std::sync::Arc::clone(&self.wake);
            match BackgroundLoad::begin(viewer, &self.path, since, move || wake()) {
                Ok(loading) => self.loading = Some(loading),
                Err(error) => {
                    let outcome = ReloadOutcome::Refused(error.to_string());
                    viewer.reload_counters_mut().note(&outcome, since);
                    return Some(outcome);
                }
            }
        }
        let outcome = self.loading.as_ref()?.step_within(grace, viewer)?;
        self.loading = None;
        self.follows_models = outcome != ReloadOutcome::Shown;
        // It may have changed meanwhile.
        (self.wake)();
        if let ReloadOutcome::Refused(fault) = &outcome {
            tracing::error!("the configuration is not loaded, the scene before stays: {fault}");
        }
        Some(outcome)
    }
}
