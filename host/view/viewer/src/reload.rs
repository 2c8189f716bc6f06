//! Hot reload: the configuration file and its models are watched, loaded beside the frames when
//! one changed, and shown where it has no fault. One that has leaves the scene as it is.

mod file_watcher;
mod prepared_reload;
mod reload_counters;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;

use crate::Viewer;
use file_watcher::FileWatcher;
pub use file_watcher::SETTLE_TIME;
pub use prepared_reload::{PreparedReload, ReloadError};
pub use reload_counters::{ReloadCounters, ReloadOutcome};

/// Time for which a frame waits for a load that has just begun; most loads finish within it.
const LOAD_GRACE: Duration = Duration::from_millis(30);

/// Configuration that a thread loads beside the frames.
pub struct BackgroundLoad {
    since: Instant,
    loaded: Receiver<LoadResult>,
}

type LoadResult = Result<Option<PreparedReload>, ReloadError>;

impl BackgroundLoad {
    /// Begins to load a file in place of what a viewer shows; `wake` is called once it is
    /// there.
    ///
    /// # Errors
    /// The operating system's error if no thread can be started.
    pub fn begin(
        viewer: &Viewer,
        path: &Path,
        since: Instant,
        wake: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (scene, path): (LoadedScene, PathBuf) = (viewer.shared_scene(), path.to_owned());
        let (sender, loaded) = channel();
        let load = move || {
            // Nobody listens any more when the viewer has gone.
            let _ = sender.send(PreparedReload::load(&scene, &path));
            drop(scene);
            wake();
        };
        std::thread::Builder::new().name("reload".into()).spawn(load)?;
        Ok(Self { since, loaded })
    }

    /// Shows it, once it is there; none before.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn step(&self, viewer: &mut Viewer) -> Option<ReloadOutcome> {
        self.step_with_timeout(Duration::ZERO, viewer)
    }

    /// Steps like [`BackgroundLoad::step`], but waits up to `grace` for the load.
    fn step_with_timeout(&self, grace: Duration, viewer: &mut Viewer) -> Option<ReloadOutcome> {
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

/// Watcher of a viewer's configuration file that applies its changes.
pub struct Reloader {
    path: PathBuf,
    file_watcher: FileWatcher,
    loading: Option<BackgroundLoad>,
    /// True once the watcher follows the models of the present scene.
    follows_models: bool,
    wake: std::sync::Arc<dyn Fn() + Send + Sync>,
}

impl Reloader {
    /// Watches a file; `wake` is called from other threads when [`Reloader::step`] has
    /// something to do.
    ///
    /// # Errors
    /// The operating system's error if no thread can be started.
    pub fn start(path: &Path, wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let wake: std::sync::Arc<dyn Fn() + Send + Sync> = std::sync::Arc::new(wake);
        let path = std::path::absolute(path)?;
        let file_watcher = FileWatcher::start(&path, std::sync::Arc::clone(&wake))?;
        Ok(Self { path, file_watcher, loading: None, follows_models: false, wake })
    }

    /// Starts loading a file that has changed and settled, or applies a finished load, between
    /// frames. Returns the outcome once it is known.
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
        let outcome = self.loading.as_ref()?.step_with_timeout(grace, viewer)?;
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
