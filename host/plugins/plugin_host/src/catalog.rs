//! Plugin discovery: libraries of the configured directories.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::library::{PluginInfo, PluginLibrary};
use crate::text::shown;
use crate::trust::{LibraryFile, LoadRules, RejectedLibrary, libraries};
use crate::{Instance, PluginError, SettingsError};

/// Keyword of a settings schema: words on what to write where the schema refuses.
const REMEDY_KEYWORD: &str = "x-busbar-remedy";
/// Longest remedy of a schema that is shown, bytes.
const MAX_REMEDY_BYTES: usize = 500;

/// The plugins of some directories. Libraries are loaded from there alone,
/// never from the working directory or a search path.
pub struct Catalog {
    searched: Vec<PathBuf>,
    libraries: Vec<Arc<PluginLibrary>>,
    refused: Vec<RejectedLibrary>,
}

impl Catalog {
    /// Loads the libraries of absolute directories, in order of name. Of two
    /// plugins with one id the first directory's counts.
    pub fn discover(directories: &[PathBuf]) -> Self {
        let (files, refused) = libraries(directories, &LoadRules::default());
        let mut catalog = Self { searched: directories.to_vec(), libraries: Vec::new(), refused };
        for file in &files {
            if let Err(reason) = PluginLibrary::open(file).and_then(|l| catalog.add(l)) {
                catalog.refused.push(RejectedLibrary { path: file.path().to_owned(), reason });
            }
        }
        catalog
    }

    /// Loads one library that was judged already.
    ///
    /// # Errors
    /// Why it gives no plugin, in words.
    pub fn from_file(file: &LibraryFile) -> Result<Self, String> {
        let searched = file.path().parent().map(Path::to_owned).into_iter().collect();
        let libraries = vec![PluginLibrary::open(file)?];
        Ok(Self { searched, libraries, refused: Vec::new() })
    }

    /// Iterates over all plugins found.
    pub fn plugins(&self) -> impl Iterator<Item = &PluginInfo> {
        self.libraries.iter().flat_map(|library| &library.plugins)
    }

    /// Returns the libraries that were rejected.
    pub fn refused(&self) -> &[RejectedLibrary] {
        &self.refused
    }

    /// Creates an instance. `name` is the configuration's own id for it.
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

    fn add(&mut self, library: Arc<PluginLibrary>) -> Result<(), String> {
        for info in &library.plugins {
            if let Some(other) = self.plugins().find(|other| other.id == info.id) {
                return Err(format!("'{}' is already in {}", info.id, other.path.display()));
            }
        }
        self.libraries.push(library);
        Ok(())
    }
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
        .map(|error| SettingsError {
            pointer: error.instance_path().to_string(),
            // Masked: settings may hold secrets.
            message: with_remedy(error.masked().to_string(), schema, error.schema_path().as_str()),
        })
        .collect();
    if faults.is_empty() {
        return Ok(());
    }
    Err(PluginError::Settings { id: info.id.clone(), faults })
}

/// Appends the schema's remedy for a fault at this place (see [`REMEDY_KEYWORD`]).
fn with_remedy(fault: String, schema: &serde_json::Value, keyword_path: &str) -> String {
    let place = keyword_path.rsplit_once('/').map_or("", |(place, _)| place);
    let remedy = schema.pointer(place).and_then(|place| place.get(REMEDY_KEYWORD));
    match remedy.and_then(serde_json::Value::as_str) {
        Some(remedy) => format!("{fault}: {}", shown(remedy, MAX_REMEDY_BYTES)),
        None => fault,
    }
}
