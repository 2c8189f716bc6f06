//! Large meshes that somebody keeps between imports.

#![allow(clippy::unwrap_used)]

mod common;

use std::collections::HashMap;
use std::fs;
use std::sync::Mutex;

use busbar_gltf_import::{
    CachedMesh, ImportLimits, ImportOptions, ImportedModel, MIN_CACHED_TRIANGLES, MeshCache,
    import_file_with,
};
use common::{Builder, shorts, square_with_features};
use serde_json::json;

/// Keeps all in memory, by the content itself.
#[derive(Default)]
struct Keeper {
    contents: Mutex<Vec<Vec<u8>>>,
    kept: Mutex<HashMap<(u128, usize), CachedMesh>>,
    found: Mutex<usize>,
}

impl MeshCache for Keeper {
    fn digest(&self, content: &[&[u8]]) -> u128 {
        let mut contents = self.contents.lock().unwrap();
        let content = content.concat();
        let known = contents.iter().position(|other| *other == content);
        known.unwrap_or_else(|| {
            contents.push(content);
            contents.len() - 1
        }) as u128
    }

    fn get(&self, content: u128, mesh: usize) -> Option<CachedMesh> {
        let found = self.kept.lock().unwrap().get(&(content, mesh)).cloned();
        *self.found.lock().unwrap() += usize::from(found.is_some());
        found
    }

    fn insert(&self, content: u128, mesh: usize, built: &CachedMesh) {
        self.kept.lock().unwrap().insert((content, mesh), built.clone());
    }
}

/// The square over and over, of two features.
fn squares(triangles: usize) -> Builder {
    let mut builder = square_with_features([0, 0, 1, 1], &["T1", "T2"]);
    let corners: Vec<u16> = [0, 1, 2, 2, 3, 0].into_iter().cycle().take(3 * triangles).collect();
    let indices = builder.accessor(&shorts(&corners), 5123, "SCALAR", corners.len());
    builder.primitive()["indices"] = json!(indices);
    builder
}

fn import(cache: &Keeper, builder: &Builder, max_features: u32) -> Result<ImportedModel, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.gltf");
    fs::write(&path, builder.bytes()).unwrap();
    let limits = ImportLimits { max_features, ..ImportLimits::default() };
    let options =
        ImportOptions { limits: Some(&limits), cache: Some(cache), ..ImportOptions::default() };
    import_file_with(&path, options).map_err(|error| error.to_string())
}

#[test]
fn what_is_kept_comes_back_as_it_was_welded() {
    let (cache, builder) = (Keeper::default(), squares(MIN_CACHED_TRIANGLES));
    let plain = builder.import();
    for found in 0..2 {
        let imported = import(&cache, &builder, 10).unwrap();
        assert_eq!(imported.model.meshes, plain.model.meshes);
        assert_eq!(imported.model.features, plain.model.features);
        assert_eq!(imported.report.meshes, plain.report.meshes);
        assert_eq!(*cache.found.lock().unwrap(), found);
    }
}

#[test]
fn other_bytes_are_another_content() {
    let cache = Keeper::default();
    import(&cache, &squares(MIN_CACHED_TRIANGLES), 10).unwrap();
    import(&cache, &squares(MIN_CACHED_TRIANGLES + 1), 10).unwrap();
    assert_eq!((cache.kept.lock().unwrap().len(), *cache.found.lock().unwrap()), (2, 0));
}

#[test]
fn small_meshes_are_not_worth_it() {
    let cache = Keeper::default();
    import(&cache, &squares(MIN_CACHED_TRIANGLES - 1), 10).unwrap();
    assert!(cache.kept.lock().unwrap().is_empty() && cache.contents.lock().unwrap().is_empty());
}

#[test]
fn features_of_kept_meshes_count_towards_their_limit() {
    let (cache, builder) = (Keeper::default(), squares(MIN_CACHED_TRIANGLES));
    import(&cache, &builder, 2).unwrap();
    let error = import(&cache, &builder, 1).unwrap_err();
    assert!(error.contains("2 features, and the limit is 1"), "{error}");
    assert_eq!(*cache.found.lock().unwrap(), 1);
}
