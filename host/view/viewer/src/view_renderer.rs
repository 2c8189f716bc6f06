//! Renderer of a view, whose work is retried after failures of the graphics device.

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_renderer::{DeviceChoice, RenderError, Renderer, RendererOptions, WindowHandles};

use crate::device_recovery::DeviceRecovery;
use crate::renderer_options::renderer_options;
use crate::{ViewError, uploaded_models};
use busbar_scene_loader::{LoadedModel, LoadedScene};

/// Renderer with the recovery of its device.
pub(crate) struct ViewRenderer {
    renderer: Renderer,
    recovery: DeviceRecovery,
}

impl ViewRenderer {
    /// Opens a renderer with pictures of `size` pixels and uploads the models of a scene. With
    /// `waits`, work waits while the device is replaced; otherwise it is skipped.
    ///
    /// # Errors
    /// No usable graphics device.
    pub(crate) fn start(
        scene: &LoadedScene,
        options: RendererOptions,
        window: Option<Arc<dyn WindowHandles>>,
        size: [u32; 2],
        waits: bool,
    ) -> Result<Self, ViewError> {
        let options = options_of(options, !waits);
        let choice = device_choice(scene);
        let open = || Renderer::open(options, choice.clone(), window.clone(), size);
        let (recovery, renderer) = DeviceRecovery::start(scene, waits, open)?;
        Ok(Self { renderer, recovery })
    }

    /// Runs work on the device, and retries it after recovery. Returns `None` if the device is
    /// absent and the work does not wait.
    ///
    /// # Errors
    /// An error without recovery, or one that persists.
    pub(crate) fn run<T>(
        &mut self,
        scene: &LoadedScene,
        work: impl FnMut(&mut Renderer) -> Result<T, RenderError>,
    ) -> Result<Option<T>, ViewError> {
        self.recovery.run(&mut self.renderer, scene, work)
    }

    /// Returns the renderer for work that cannot fail.
    pub(crate) fn get(&self) -> &Renderer {
        &self.renderer
    }

    /// Returns the renderer for work that is not retried.
    pub(crate) fn get_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Returns the state of the device's recovery.
    pub(crate) fn recovery(&self) -> &DeviceRecovery {
        &self.recovery
    }

    /// Recreates the device where the next configuration requires other options; reports whether it
    /// did. If that fails, the device is recreated as it was.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub(crate) fn change_options(
        &mut self,
        scene: &LoadedScene,
        next: &LoadedScene,
        is_live: bool,
    ) -> Result<bool, ViewError> {
        let wanted = |scene: &LoadedScene| {
            (options_of(renderer_options(scene), is_live), device_choice(scene))
        };
        let (options, choice) = wanted(next);
        if !self.renderer.set_options(options, choice) {
            return Ok(false);
        }
        if let Err(error) = self.recovery.renew(&mut self.renderer, scene) {
            let (options, choice) = wanted(scene);
            self.renderer.set_options(options, choice);
            if let Err(lost) = self.recovery.renew(&mut self.renderer, scene) {
                self.recovery.mark_lost(lost)?;
            }
            return Err(error.into());
        }
        Ok(true)
    }

    /// Uploads the models of the next scene that the device does not have yet. Without a device they
    /// come with the next one.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub(crate) fn upload_new(
        &mut self,
        scene: &LoadedScene,
        next: &LoadedScene,
    ) -> Result<(), ViewError> {
        let present = slots_of(scene);
        self.run(scene, |renderer| {
            let is_new = |model: &LoadedModel| !present.contains(&model.slot);
            uploaded_models::upload_some(&next.models, renderer, is_new)
        })?;
        Ok(())
    }

    /// Removes the models of the previous scene that the present one does not have.
    pub(crate) fn remove_replaced(&mut self, before: &LoadedScene, scene: &LoadedScene) {
        let slots = slots_of(scene);
        let replaced = before.models.iter().filter(|model| !slots.contains(&model.slot));
        replaced.for_each(|model| self.renderer.remove_model(uploaded_models::handle_of(model)));
    }
}

fn slots_of(scene: &LoadedScene) -> BTreeSet<Option<u32>> {
    scene.models.iter().map(|model| model.slot).collect()
}

/// Returns the renderer options; headless pictures ignore those for software rasterizers.
fn options_of(options: RendererOptions, is_live: bool) -> RendererOptions {
    RendererOptions {
        on_software_rasterizer: options.on_software_rasterizer.filter(|_| is_live),
        ..options
    }
}

/// Returns the device that the configuration requires.
fn device_choice(scene: &LoadedScene) -> DeviceChoice {
    DeviceChoice {
        device: scene.config.view.device.clone(),
        pipeline_cache: scene.pipeline_cache.clone(),
    }
}
