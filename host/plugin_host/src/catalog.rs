//! Which plugins there are: libraries of the configured directories.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::library::{PluginInfo, PluginLibrary};
use crate::{Instance, PluginError, SettingsFault};

/// Libraries looked at in one directory.
pub const MAX_LIBRARIES: usize = 256;

/// A file or directory that gave no plugin, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The file or directory.
    pub path: PathBuf,
    /// Why.
    pub reason: String,
}

/// The plugins of some directories. Libraries are loaded from there alone,
/// never from the working directory or a search path.
pub struct Catalog {
    searched: Vec<PathBuf>,
    libraries: Vec<Arc<PluginLibrary>>,
    refused: Vec<Refused>,
}

impl Catalog {
    /// Loads the libraries of absolute directories, in order of name. Of two
    /// plugins with one id the first directory's counts.
    pub fn discover(directories: &[PathBuf]) -> Self {
        let mut catalog =
            Self { searched: directories.to_vec(), libraries: Vec::new(), refused: Vec::new() };
        for directory in directories {
            match libraries_in(directory) {
                Ok(paths) => paths.iter().for_each(|path| catalog.add(path)),
                Err(reason) => {
                    catalog.refused.push(Refused { path: directory.clone(), reason });
                }
            }
        }
        catalog
    }

    /// Every plugin found.
    pub fn plugins(&self) -> impl Iterator<Item = &PluginInfo> {
        self.libraries.iter().flat_map(|library| &library.plugins)
    }

    /// What was refused.
    pub fn refused(&self) -> &[Refused] {
        &self.refused
    }

    /// Makes an instance. `name` is the configuration's own id for it.
    ///
    /// # Errors
    /// [`PluginError::NotFound`], [`PluginError::Settings`], or what the
    /// plugin says.
    pub fn create(
        &self,
        name: &str,
        id: &str,
        settings: &serde_json::Value,
    ) -> Result<Arc<Instance>, PluginError> {
        let found = self.libraries.iter().find_map(|library| {
            library.plugins.iter().find(|info| info.id == id).map(|info| (library, info))
        });
        let Some((library, info)) = found else {
            return Err(PluginError::NotFound {
                id: id.to_owned(),
                searched: self.searched.clone(),
                refused: self.refused.clone(),
            });
        };
        check_settings(info, settings)?;
        Instance::create(library.clone(), info.clone(), name, settings).map(Arc::new)
    }

    fn add(&mut self, path: &Path) {
        let mut refuse = |reason| self.refused.push(Refused { path: path.to_owned(), reason });
        let library = match PluginLibrary::open(path) {
            Ok(library) => library,
            Err(reason) => return refuse(reason),
        };
        let known =
            |id: &str| self.libraries.iter().flat_map(|l| &l.plugins).find(|other| other.id == id);
        for info in &library.plugins {
            if let Some(other) = known(&info.id) {
                let other = other.path.display();
                return refuse(format!("'{}' is already in {other}", info.id));
            }
        }
        self.libraries.push(library);
    }
}

/// Regular files of a directory that are named like libraries, in order.
fn libraries_in(directory: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(directory)
        .map_err(|error| format!("cannot read this plugin directory: {error}"))?;
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| {
            path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION) && path.is_file()
        })
        .collect();
    if paths.len() > MAX_LIBRARIES {
        return Err(format!("it holds {} libraries; the limit is {MAX_LIBRARIES}", paths.len()));
    }
    paths.sort();
    Ok(paths)
}

fn check_settings(info: &PluginInfo, settings: &serde_json::Value) -> Result<(), PluginError> {
    let Some(schema) = &info.settings_schema else {
        return Ok(());
    };
    let validator = jsonschema::validator_for(schema).map_err(|e| PluginError::Violation {
        id: info.id.clone(),
        what: format!("its settings schema is not valid: {e}"),
    })?;
    let faults: Vec<_> = validator
        .iter_errors(settings)
        .map(|error| SettingsFault {
            pointer: error.instance_path().to_string(),
            // Masked: settings may hold secrets.
            message: error.masked().to_string(),
        })
        .collect();
    if faults.is_empty() {
        return Ok(());
    }
    Err(PluginError::Settings { id: info.id.clone(), faults })
}
