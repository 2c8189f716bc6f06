//! Reload: a changed configuration, loaded in place of a scene that is still shown.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use busbar_config::Changes;

use crate::config_file::{config_folder, read_config};
use crate::diagnostics::LoadError;
use crate::loaded_model::LoadMillis;
use crate::loaded_scene::LoadedScene;
use crate::reuse::ReusePlan;
use crate::stack_builder::millis_since;

/// Changed configuration with everything it names. Its new plugins exist, but none has been
/// started on its duties.
pub struct ReloadedScene {
    /// Scene of the changed configuration.
    pub scene: LoadedScene,
    /// Changes against the previous configuration.
    pub changes: Changes,
    /// Names of the plugins that are kept unchanged.
    pub kept: BTreeSet<String>,
    /// True if nodes and models are unchanged.
    pub has_same_graph: bool,
}

impl LoadedScene {
    /// Loads a configuration in place of this scene, while this scene is still shown. Returns none
    /// if nothing has changed. Models whose files were rewritten are loaded again; other files that
    /// the configuration names are not checked.
    ///
    /// # Errors
    /// Every fault of the file, of the files it names, and of what it asks of plugins. This
    /// scene goes on undisturbed.
    pub fn reload(&self, path: &Path) -> Result<Option<ReloadedScene>, LoadError> {
        let start = Instant::now();
        let config = read_config(path)?;
        let is_elsewhere = self.folder != config_folder(path);
        let mut changes = Changes::between(&self.config, &config);
        changes.add_models(self.edited_models());
        if changes.is_empty() && !is_elsewhere {
            return Ok(None);
        }
        let millis = LoadMillis::from([("config".into(), millis_since(start))]);
        // Relative paths of another folder lead elsewhere.
        let reuse = match is_elsewhere {
            true => ReusePlan::none_of(self, &changes),
            false => ReusePlan::new(self, &config, &changes),
        };
        let scene = Self::assemble(path, config, millis, &reuse, &|_, _, _| {})?;
        let (has_same_graph, kept) = (reuse.has_same_graph(), reuse.into_kept_plugins());
        Ok(Some(ReloadedScene { scene, changes, kept, has_same_graph }))
    }
}
