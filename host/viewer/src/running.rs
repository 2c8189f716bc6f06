//! Plugins that run while a view is open.

use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_host::OverlayPicture;
use busbar_plugin_process::{RunningOverlay, RunningTelemetry};
use busbar_tags::Snapshot;

use crate::ViewError;
use crate::load::LoadedScene;

/// The longest that a frame in a window waits for an isolated overlay: mostly
/// enough for the picture of this frame, and too little to be seen.
pub(crate) const WINDOW_PATIENCE: Duration = Duration::from_millis(4);
/// The longest that a frame without a window waits for one.
pub(crate) const HEADLESS_PATIENCE: Duration = Duration::from_millis(250);

/// An overlay and what went wrong with it last.
pub(crate) struct ShownOverlay {
    pub(crate) overlay: RunningOverlay,
    pub(crate) fault: Option<String>,
}

/// Configures the overlays of a scene.
pub(crate) fn start_overlays(scene: &LoadedScene) -> Result<Vec<ShownOverlay>, ViewError> {
    let mut overlays = Vec::new();
    for overlay in &scene.config.overlays {
        if let Some(plugin) = scene.instances.get(&overlay.plugin) {
            let overlay = RunningOverlay::configure(plugin, scene.overlay_bindings())?;
            overlays.push(ShownOverlay { overlay, fault: None });
        }
    }
    Ok(overlays)
}

/// Starts the telemetry plugins of a scene on their tags.
pub(crate) fn start_telemetry(scene: &LoadedScene) -> Result<Vec<RunningTelemetry>, ViewError> {
    let mut running = Vec::new();
    for (name, plugin) in &scene.instances {
        let tags = scene.telemetry_tags(name);
        if !tags.is_empty() {
            running.push(RunningTelemetry::start(plugin, &tags)?);
        }
    }
    Ok(running)
}

/// Lets every overlay draw; all of them share the patience. One that fails draws
/// nothing and keeps its fault, which is logged once.
pub(crate) fn run_overlays(
    overlays: &mut [ShownOverlay],
    snapshot: Snapshot<'_>,
    patience: Duration,
) -> OverlayPicture {
    let mut all = OverlayPicture::default();
    let (now, start) = (SystemTime::now(), Instant::now());
    for shown in overlays {
        let left = patience.saturating_sub(start.elapsed());
        match shown.overlay.draw(|tag| snapshot.state(tag), now, left) {
            Ok(picture) => {
                all.lines.extend(picture.lines);
                all.tints.extend(picture.tints);
                shown.fault = None;
            }
            Err(error) => {
                let fault = error.to_string();
                if shown.fault.as_ref() != Some(&fault) {
                    tracing::error!(plugin = shown.overlay.name(), "{fault}");
                }
                shown.fault = Some(fault);
            }
        }
    }
    all
}
