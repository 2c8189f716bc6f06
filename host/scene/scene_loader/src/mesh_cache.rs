//! The cache of welded meshes and of optimised models, and what its results depend on.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use busbar_config::{CacheConfig, join_pointer};
use busbar_gltf_import::{CachedMesh, MeshCache};
use busbar_plugin_process::Plugin;
use busbar_stack_cache::{MeshKey, OptimizerDigest, StackCache, WeldedMesh, content_digest};
use serde_json::Value;

/// The largest plugin library whose results are kept.
const MAX_LIBRARY_BYTES: u64 = 1 << 30;

/// Opens the configured cache; none if it is turned off or has no directory. An unusable cache
/// gives a remark; loading then takes longer.
pub(crate) fn open(
    config: &CacheConfig,
    folder: &Path,
    notes: &mut Vec<String>,
) -> Option<StackCache> {
    let limit_bytes = u64::from(config.max_megabytes) * 1_000_000;
    if limit_bytes == 0 {
        return None;
    }
    let directory = match &config.directory {
        Some(directory) => folder.join(directory),
        None => users_cache()?.join("busbar").join("stacks"),
    };
    let opened = StackCache::open(&directory, limit_bytes);
    opened
        .inspect_err(|error| {
            let place = join_pointer(&config.pointer, "directory");
            notes.push(format!("{error}; or name another one at {place}"));
        })
        .ok()
}

/// XDG Base Directory Specification: relative paths are to be ignored.
fn users_cache() -> Option<PathBuf> {
    let path = |name| std::env::var_os(name).map(PathBuf::from).filter(|p| p.is_absolute());
    path("XDG_CACHE_HOME").or_else(|| path("HOME").map(|home| home.join(".cache")))
}

/// Returns the digest of the optimizer for cache keys: plugin id, version, library content and
/// settings.
pub(crate) fn optimizer_digest(
    plugin: &Plugin,
    settings: &Value,
) -> std::io::Result<OptimizerDigest> {
    let info = plugin.info();
    let length = std::fs::metadata(&info.path)?.len();
    if length > MAX_LIBRARY_BYTES {
        let what = format!("{} has more than {MAX_LIBRARY_BYTES} bytes", info.path.display());
        return Err(std::io::Error::other(what));
    }
    let library = std::fs::read(&info.path)?;
    let settings = settings.to_string();
    let parts = [info.id.as_bytes(), info.version.as_bytes(), &library, settings.as_bytes()];
    Ok(OptimizerDigest::from_parts(&parts))
}

/// Welded meshes in the cache.
pub(crate) struct WeldedMeshCache<'a> {
    cache: &'a StackCache,
    /// Remarks on faults of the cache.
    notes: Mutex<Vec<String>>,
}

impl<'a> WeldedMeshCache<'a> {
    pub(crate) fn new(cache: &'a StackCache) -> Self {
        Self { cache, notes: Mutex::default() }
    }

    pub(crate) fn into_notes(self) -> Vec<String> {
        self.notes.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, note: String) {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(note);
    }
}

impl MeshCache for WeldedMeshCache<'_> {
    fn digest(&self, content: &[&[u8]]) -> u128 {
        content_digest(content)
    }

    fn get(&self, content: u128, mesh: usize) -> Option<CachedMesh> {
        let key = MeshKey::new(content, mesh);
        let found = self.cache.load_mesh(key).unwrap_or_else(|reason| {
            let path = self.cache.mesh_path(key);
            self.note(format!("{} is built anew: {reason}", path.display()));
            None
        });
        found.map(|WeldedMesh { mesh, feature_names, report }| (mesh, feature_names, report))
    }

    fn insert(&self, content: u128, mesh: usize, (welded, names, report): &CachedMesh) {
        let key = MeshKey::new(content, mesh);
        if let Err(error) = self.cache.store_mesh(key, welded, names, *report) {
            self.note(error.to_string());
        }
    }
}
