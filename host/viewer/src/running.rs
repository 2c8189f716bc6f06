//! Plugins that run while a view is open.

use std::sync::Arc;
use std::time::SystemTime;

use busbar_plugin_host::{Overlay, OverlayPicture, Telemetry};
use busbar_tags::{SampleQueue, Snapshot};

use crate::ViewError;
use crate::load::LoadedScene;

/// An overlay and what went wrong with it last.
pub(crate) struct RunningOverlay {
    pub(crate) overlay: Overlay,
    pub(crate) fault: Option<String>,
}

/// Configures the overlays of a scene.
pub(crate) fn start_overlays(scene: &LoadedScene) -> Result<Vec<RunningOverlay>, ViewError> {
    let mut overlays = Vec::new();
    for overlay in &scene.config.overlays {
        if let Some(instance) = scene.instances.get(&overlay.plugin) {
            let overlay = Overlay::configure(instance.clone(), scene.overlay_bindings())?;
            overlays.push(RunningOverlay { overlay, fault: None });
        }
    }
    Ok(overlays)
}

/// Telemetry plugins and the queues that they fill.
pub(crate) type RunningTelemetry = (Vec<Telemetry>, Vec<Arc<SampleQueue>>);

/// Starts the telemetry plugins of a scene on their tags.
pub(crate) fn start_telemetry(scene: &LoadedScene) -> Result<RunningTelemetry, ViewError> {
    let (mut running, mut queues) = (Vec::new(), Vec::new());
    for (name, instance) in &scene.instances {
        let tags = scene.telemetry_tags(name);
        if tags.is_empty() {
            continue;
        }
        let queue = Arc::new(SampleQueue::default());
        running.push(Telemetry::start(instance.clone(), &tags, queue.clone())?);
        queues.push(queue);
    }
    Ok((running, queues))
}

/// Lets every overlay draw. One that fails draws nothing and keeps its fault,
/// which is logged once.
pub(crate) fn run_overlays(overlays: &mut [RunningOverlay], snapshot: &Snapshot) -> OverlayPicture {
    let mut all = OverlayPicture::default();
    let now = SystemTime::now();
    for running in overlays {
        match running.overlay.draw(|tag| snapshot.state(tag), now) {
            Ok(picture) => {
                all.lines.extend(picture.lines);
                all.tints.extend(picture.tints);
                running.fault = None;
            }
            Err(error) => {
                let fault = error.to_string();
                if running.fault.as_ref() != Some(&fault) {
                    tracing::error!(plugin = running.overlay.instance().name(), "{fault}");
                }
                running.fault = Some(fault);
            }
        }
    }
    all
}
