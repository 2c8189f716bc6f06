//! Plugin discovery without loading a library into this process.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    Catalog, Digest, LibraryFile, LoadRules, PluginError, PluginInfo, RejectedLibrary, libraries,
};

use crate::environment::Environment;
use crate::loaded::LoadedLibrary;
use crate::message::Confinement;
use crate::plugin::Plugin;
use crate::restart_policy::{Deadlines, RestartPolicy};

/// Times that a library is loaded which could be described.
const MAX_LOADS: usize = 3;
/// Processes that are started at once.
const MAX_STARTING: usize = 8;

/// Isolation of plugins from the viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Isolation {
    /// Each plugin in a supervised process of its own.
    #[default]
    Process,
    /// Plugins in the viewer's process.
    None,
}

/// Options of one instance.
#[derive(Clone, Debug)]
pub struct PluginOptions {
    /// Isolation of the instance.
    pub isolation: Isolation,
    /// Resource limits of its process.
    pub confinement: Confinement,
    /// Restart policy after a crash.
    pub policy: RestartPolicy,
    /// Deadlines of its calls.
    pub deadlines: Deadlines,
    /// Required digest of its library.
    pub pin: Option<Digest>,
}

impl Default for PluginOptions {
    fn default() -> Self {
        Self {
            isolation: Isolation::default(),
            confinement: DEFAULT_CONFINEMENT,
            policy: RestartPolicy::default(),
            deadlines: Deadlines::default(),
            pin: None,
        }
    }
}

/// Default limits of a plugin's process, also of one that only describes its library: 4 GB and no
/// network.
pub const DEFAULT_CONFINEMENT: Confinement =
    Confinement { memory_bytes: 4_000_000_000, network: false };

/// The plugins of some directories.
pub struct PluginCatalog {
    searched: Vec<PathBuf>,
    found: Vec<FoundLibrary>,
    refused: Vec<RejectedLibrary>,
}

/// A library that has plugins.
struct FoundLibrary {
    file: LibraryFile,
    plugins: Vec<PluginInfo>,
    /// The process that described them, until an instance takes it.
    idle: Mutex<Option<LoadedLibrary>>,
}

impl PluginCatalog {
    /// Discovers the libraries of absolute directories, in order of name. Of two plugins with one
    /// id the first directory's counts. With isolation each library is loaded in a process of its
    /// own, and none in this process.
    pub fn discover(directories: &[PathBuf], rules: &LoadRules, isolation: Isolation) -> Self {
        let (files, refused) = libraries(directories, rules);
        let mut catalog = Self { searched: directories.to_vec(), found: Vec::new(), refused };
        let described = match isolation {
            Isolation::Process => describe_isolated(&files),
            Isolation::None => files.iter().map(describe_in_process).collect(),
        };
        for (file, described) in files.into_iter().zip(described) {
            let path = file.path().to_owned();
            if let Err(reason) = described.and_then(|found| catalog.add(file, found)) {
                catalog.refused.push(RejectedLibrary { path, reason });
            }
        }
        catalog
    }

    /// Iterates over all plugins found.
    pub fn plugins(&self) -> impl Iterator<Item = &PluginInfo> {
        self.found.iter().flat_map(|found| &found.plugins)
    }

    /// Iterates over the plugins that simplify meshes.
    pub fn optimizers(&self) -> impl Iterator<Item = &PluginInfo> {
        self.with_capability(abi::MESH_OPTIMIZER_ID)
    }

    /// Iterates over the plugins that draw overlays.
    pub fn overlays(&self) -> impl Iterator<Item = &PluginInfo> {
        self.with_capability(abi::OVERLAY_ID)
    }

    fn with_capability(&self, capability: &'static str) -> impl Iterator<Item = &PluginInfo> {
        self.plugins().filter(move |plugin| plugin.capabilities.iter().any(|id| id == capability))
    }

    /// Returns the libraries that were rejected.
    pub fn refused(&self) -> &[RejectedLibrary] {
        &self.refused
    }

    /// Creates an instance. `name` is the configuration's own id for it. An isolated plugin that
    /// crashes or fails by itself gives an instance too, which is restarted: its
    /// [`Plugin::status`] has the crash.
    ///
    /// # Errors
    /// [`PluginError::NotFound`], [`PluginError::Pinned`],
    /// [`PluginError::Settings`], or what the plugin says.
    pub fn create(
        &self,
        name: &str,
        id: &str,
        settings: &serde_json::Value,
        options: &PluginOptions,
    ) -> Result<Plugin, PluginError> {
        let found = self.found.iter().find_map(|found| {
            found.plugins.iter().find(|info| info.id == id).map(|info| (found, info))
        });
        let Some((found, info)) = found else {
            return Err(PluginError::NotFound {
                id: id.to_owned(),
                searched: self.searched.clone(),
                refused: self.refused.clone(),
            });
        };
        let broken = |what| PluginError::Violation { id: id.to_owned(), what };
        if let Some(pin) = options.pin {
            let digest = found.file.digest().map_err(broken)?;
            if digest != pin {
                let path = found.file.path().to_owned();
                return Err(PluginError::Pinned { id: id.to_owned(), path, found: digest });
            }
        }
        if options.isolation == Isolation::None {
            let catalog = Catalog::from_file(&found.file).map_err(broken)?;
            return catalog.create(name, id, settings).map(Plugin::InProcess);
        }
        let environment = Environment::of_settings(settings).map_err(|message| {
            PluginError::Failed { id: id.to_owned(), settings_at_fault: true, message }
        })?;
        let library = found.process(options, &environment).map_err(|reason| {
            let path = found.file.path();
            PluginError::Lost { id: id.to_owned(), reason: format!("{}: {reason}", path.display()) }
        })?;
        library.create(name, info, settings, options).map(Arc::new).map(Plugin::Isolated)
    }

    fn add(&mut self, file: LibraryFile, described: DescribedLibrary) -> Result<(), String> {
        for info in &described.plugins {
            if let Some(other) = self.plugins().find(|other| other.id == info.id) {
                return Err(format!("'{}' is already in {}", info.id, other.path.display()));
            }
        }
        let DescribedLibrary { plugins, idle } = described;
        self.found.push(FoundLibrary { file, plugins, idle: Mutex::new(idle) });
        Ok(())
    }
}

impl FoundLibrary {
    /// A process with this library: the one that described it, if it is confined
    /// and sees the environment as this instance is to, or a new one.
    fn process(
        &self,
        options: &PluginOptions,
        environment: &Environment,
    ) -> Result<LoadedLibrary, String> {
        let confinement = options.confinement;
        let fits = |idle: &mut LoadedLibrary| {
            idle.confinement == confinement && idle.environment == *environment
        };
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = idle.take_if(fits) {
            return Ok(library);
        }
        // It could be loaded once: what went wrong since may not go wrong again.
        let load = || LoadedLibrary::load(&self.file, confinement, environment);
        let mut loaded = load();
        for _ in 1..MAX_LOADS {
            loaded = loaded.or_else(|_| load());
        }
        loaded
    }
}

/// Plugins of a library, with the process that described them.
struct DescribedLibrary {
    plugins: Vec<PluginInfo>,
    idle: Option<LoadedLibrary>,
}

fn describe_in_process(file: &LibraryFile) -> Result<DescribedLibrary, String> {
    let plugins = Catalog::from_file(file)?.plugins().cloned().collect();
    Ok(DescribedLibrary { plugins, idle: None })
}

/// Loads each library in a process of its own, some at once.
fn describe_isolated(files: &[LibraryFile]) -> Vec<Result<DescribedLibrary, String>> {
    let next = AtomicUsize::new(0);
    let described = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..files.len().min(MAX_STARTING) {
            scope.spawn(|| {
                while let Some(index) = next_index(&next, files.len()) {
                    let nothing = Environment::default();
                    let loaded = LoadedLibrary::load(&files[index], DEFAULT_CONFINEMENT, &nothing);
                    let found = loaded.map(|library| DescribedLibrary {
                        plugins: library.plugins.clone(),
                        idle: Some(library),
                    });
                    described.lock().unwrap_or_else(PoisonError::into_inner).push((index, found));
                }
            });
        }
    });
    let mut described = described.into_inner().unwrap_or_else(PoisonError::into_inner);
    described.sort_by_key(|(index, _)| *index);
    described.into_iter().map(|(_, found)| found).collect()
}

fn next_index(next: &AtomicUsize, count: usize) -> Option<usize> {
    Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&index| index < count)
}
