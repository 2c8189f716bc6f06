//! Scenes whose values come from a generator, in a folder of their own.

use std::fmt::Write;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use busbar_plugin_host::{LoadRules, SourcePolicy, TelemetryTag};
use busbar_plugin_process::{
    Confinement, DEFAULT_CONFINEMENT, Isolation, Plugin, PluginCatalog, PluginOptions,
    RunningTelemetry,
};
use busbar_scene_loader::LoadedScene;
use busbar_tags::TagHandle;
use busbar_types::ValueKind;
use busbar_viewer::{RendererOptions, Viewer};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Size of the pictures, pixels.
pub(crate) const PICTURE: [u32; 2] = [320, 180];
/// Plugin that generates the tags' values.
const GENERATOR: &str = "sample_generator";
const OVERLAY: &str = "power_overlay";
/// Freshness limit of the tags: longer than any measurement.
const FRESHNESS: Duration = Duration::from_secs(600);
/// Number of tags that show at the transformer.
const BOUND: usize = 14;

/// Folder with plugins and models for generated scenes.
pub(crate) struct GeneratedScene {
    folder: TempDir,
    /// Divisor of counts and times.
    pub(crate) divisor: u64,
}

impl GeneratedScene {
    pub(crate) fn new(libraries: &[PathBuf], models: &Path, divisor: u64) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let plugins = folder.path().join("plugins");
        fs::create_dir(&plugins)?;
        for library in libraries {
            let name = library.file_name().context("a library without a name")?;
            fs::copy(library, plugins.join(name))
                .with_context(|| format!("cannot copy {}: was it built?", library.display()))?;
        }
        let models = models.canonicalize().context("where are the models?")?;
        symlink(models, folder.path().join("models"))?;
        Ok(Self { folder, divisor })
    }

    /// Starts a generator that serves so many tags, isolated, without a scene.
    pub(crate) fn generator(&self, settings: &Value, tags: u32) -> Result<RunningTelemetry> {
        let plugin = self.plugin(GENERATOR, settings)?;
        let tags: Vec<_> = (0..tags).map(|tag| telemetry_tag(tag, &json!({}))).collect();
        Ok(RunningTelemetry::start(&plugin, &tags, SourcePolicy::default())?)
    }

    /// Returns a plugin in a process of its own.
    pub(crate) fn plugin(&self, id: &str, settings: &Value) -> Result<Plugin> {
        let directories = [self.folder.path().join("plugins")];
        let isolation = Isolation::Process;
        let catalog = PluginCatalog::discover(&directories, &LoadRules::default(), isolation);
        // As for every source of tags.
        let confinement = Confinement { network: true, ..DEFAULT_CONFINEMENT };
        let options = PluginOptions { isolation, confinement, ..PluginOptions::default() };
        Ok(catalog.create("source", id, settings, &options)?)
    }

    /// Opens a view of the demo's transformer with so many tags of this type, some of them shown
    /// there; returns the seconds of loading too.
    pub(crate) fn view(
        &self,
        settings: &Value,
        tags: u64,
        kind: &str,
        shown: usize,
    ) -> Result<(Viewer, f64)> {
        let path = self.folder.path().join("scene.json");
        fs::write(&path, configuration(settings, tags, kind, shown.min(BOUND)))?;
        let start = Instant::now();
        let scene = LoadedScene::load(&path, &|_, _, _| ())?;
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer = Viewer::new_headless(scene, options, PICTURE)?;
        viewer.set_settles(false);
        Ok((viewer, start.elapsed().as_secs_f64()))
    }
}

/// Returns a tag of a number at an address.
pub(crate) fn telemetry_tag(tag: u32, address: &Value) -> TelemetryTag {
    TelemetryTag {
        tag: TagHandle(tag),
        kind: ValueKind::F64,
        freshness: FRESHNESS,
        id: format!("tag {tag}"),
        address_json: address.to_string(),
        unit: String::new(),
    }
}

/// Formats the configuration as text directly: a value of a million tags would take gigabytes.
fn configuration(settings: &Value, tags: u64, kind: &str, shown: usize) -> String {
    let frame = json!({
        "version": 1,
        "plugin_directories": ["plugins"],
        "plugins": {
            "source": { "plugin": GENERATOR, "settings": settings },
            "values": { "plugin": OVERLAY },
        },
        "models": { "transformer": { "file": "models/transformer.glb" } },
        "scene": [{ "id": "=T1", "model": "transformer" }],
        "overlays": ["values"],
        "window": { "size": PICTURE },
        "graphics": { "samples": 1 },
        "bindings": (0..shown)
            .map(|tag| json!({ "tag": tag_id(tag as u64), "node": "=T1" }))
            .collect::<Vec<_>>(),
    });
    let mut text = frame.to_string();
    text.truncate(text.len() - 1);
    text += ",\"tags\":{";
    let limits = if kind == "f64" { ",\"limits\":{\"high\":50}" } else { "" };
    let freshness = FRESHNESS.as_secs_f64();
    for tag in 0..tags {
        let (comma, id) = (if tag > 0 { "," } else { "" }, tag_id(tag));
        // Writing to a string does not fail.
        let _ = write!(
            text,
            "{comma}\"{id}\":{{\"type\":\"{kind}\",\"freshness_seconds\":{freshness}{limits},\
             \"source\":{{\"instance\":\"source\",\"address\":{tag}}}}}"
        );
    }
    text + "}}"
}

/// Returns the id of a tag; ids are in the order of their numbers.
pub(crate) fn tag_id(tag: u64) -> String {
    format!("T{tag:07}")
}

/// Draws frames without a pause for `duration`; returns the milliseconds of each, from its
/// beginning to its end.
pub(crate) fn frames(viewer: &mut Viewer, duration: Duration) -> Result<Vec<f64>> {
    let (start, mut millis) = (Instant::now(), Vec::new());
    while start.elapsed() < duration {
        let began = Instant::now();
        let input = viewer.headless_input(start.elapsed().as_secs_f64());
        viewer.frame(input)?;
        millis.push(began.elapsed().as_secs_f64() * 1e3);
    }
    Ok(millis)
}
