//! Renderer interface: models in, frames and picks out.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use busbar_gpu::{
    Gpu, GpuOptions, GpuQueue, ImageArea, ValidationLog, WindowFrames, WindowHandles,
};
use busbar_panel_painter::PanelPainter;

use crate::draw_reduction::{DrawReduction, NoReduction};
use crate::model::GpuModel;
use crate::pick::{self, PendingPick, PickState, PickTargets, PixelArea};
use crate::scene_layer::SceneLayer;
use crate::scene_resources::{self as scene, FirstPass, SceneResources, millis_since};
use crate::software::SoftwareReduction;
use crate::targets::SceneTargets;
use crate::{
    DensityCounts, DensityInput, DensityProgress, EguiFrame, Frame, FrameStats, MeshAtCursor,
    ModelHandle, ModelUpload, Picture, Quality, RenderError, ResolveRequest,
};

/// Models that one renderer ever takes, removed ones included.
const MAX_MODELS: usize = 1 << 20;

/// Options of drawing: quality, samples and validation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RendererOptions {
    /// Quality on graphics hardware.
    pub quality: Quality,
    /// Samples a pixel, 1 or 4.
    pub samples: u32,
    /// Quality and samples where the processor draws, if others.
    pub on_software_rasterizer: Option<(Quality, u32)>,
    /// Turns the Vulkan validation layer on.
    pub validation: bool,
}

impl Default for RendererOptions {
    /// Returns medium quality, four samples, no validation.
    fn default() -> Self {
        Self {
            quality: Quality::Medium,
            samples: 4,
            on_software_rasterizer: None,
            validation: false,
        }
    }
}

/// Choice of the device, and the folder of its pipeline cache.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceChoice {
    /// Number of the device, or a part of its name; `BUSBAR_DEVICE` in the environment takes
    /// precedence. `None` takes the best.
    pub device: Option<String>,
    /// A folder for compiled pipelines; `None` keeps none.
    pub pipeline_cache: Option<PathBuf>,
}

/// All that a renderer is made from, kept to make its device anew.
#[derive(Clone)]
struct RendererSetup {
    gpu: GpuOptions,
    picture: PictureSettings,
    window: Option<Arc<dyn WindowHandles>>,
    defers_presentation: bool,
}

/// Quality and samples, for hardware and for software rasterizers.
#[derive(Clone, Copy, PartialEq, Eq)]
struct PictureSettings {
    quality: Quality,
    samples: u32,
    on_software_rasterizer: Option<(Quality, u32)>,
}

impl PictureSettings {
    fn from_options(
        RendererOptions { quality, samples, on_software_rasterizer, .. }: RendererOptions,
    ) -> Self {
        Self { quality, samples, on_software_rasterizer }
    }

    /// Returns quality and samples for hardware, or for a software rasterizer.
    fn for_device(self, is_software: bool) -> (Quality, u32) {
        let other = self.on_software_rasterizer.filter(|_| is_software);
        other.unwrap_or((self.quality, self.samples))
    }
}

/// Draws frames into a window, or into a picture that can be read back.
pub struct Renderer {
    scene: SceneResources,
    targets: Option<SceneTargets>,
    /// Targets of a scene at reduced resolution, where one was drawn last.
    reduced_targets: Option<SceneTargets>,
    layer: SceneLayer,
    /// True while the targets hold the last frame, panels included.
    is_picture_whole: bool,
    /// True while the window shows that picture; without a window, while it can be read.
    is_shown: bool,
    /// Progress of the last count of records.
    counted: Option<DensityProgress>,
    one_pixel: PickTargets,
    /// Begun, and not asked for yet.
    pending: Option<PendingPick>,
    panels: PanelPainter,
    setup: RendererSetup,
    /// The picture's size; in a window, the window's.
    size: [u32; 2],
    /// Software rasterizer: the processor draws.
    is_software: bool,
    queue: GpuQueue,
}

impl Renderer {
    /// Draws into pictures of this size, without a window.
    ///
    /// # Errors
    /// When there is no Vulkan loader, driver, fitting device or, if asked for,
    /// validation layer; each says what to install.
    pub fn headless(options: RendererOptions, size: [u32; 2]) -> Result<Self, RenderError> {
        Self::open(options, DeviceChoice::default(), None, size)
    }

    /// Draws into a window of this size in pixels. The window is kept, so that
    /// it outlives its surface.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::headless`], or when the window cannot be drawn into.
    pub fn for_window(
        options: RendererOptions,
        window: Arc<dyn WindowHandles>,
        size: [u32; 2],
    ) -> Result<Self, RenderError> {
        Self::open(options, DeviceChoice::default(), Some(window), size)
    }

    /// Draws into a window or, without one, into pictures, on a chosen device.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::for_window`], or when the device chosen is not there.
    pub fn open(
        options: RendererOptions,
        choice: DeviceChoice,
        window: Option<Arc<dyn WindowHandles>>,
        size: [u32; 2],
    ) -> Result<Self, RenderError> {
        let gpu = GpuOptions {
            validation: options.validation,
            device: choice.device,
            pipeline_cache: choice.pipeline_cache,
            ..GpuOptions::default()
        };
        Self::open_with(
            RendererSetup {
                gpu,
                picture: PictureSettings::from_options(options),
                window,
                defers_presentation: false,
            },
            size,
        )
    }

    fn open_with(setup: RendererSetup, size: [u32; 2]) -> Result<Self, RenderError> {
        let mut queue = match &setup.window {
            Some(window) => GpuQueue::for_window(&setup.gpu, Arc::clone(window))?,
            None => GpuQueue::headless(&setup.gpu)?,
        };
        queue.resize_window(size);
        queue.defer_presentation(setup.defers_presentation);
        let gpu = &queue.gpu().clone();
        let is_software = gpu.is_software();
        let reduction: Box<dyn DrawReduction> =
            if is_software { Box::<SoftwareReduction>::default() } else { Box::new(NoReduction) };
        queue.set_max_triangles_per_pass(reduction.max_triangles_per_pass());
        let (quality, samples) = setup.picture.for_device(is_software);
        if !matches!(samples, 1 | 4) || !gpu.supports_samples(samples) {
            return Err(RenderError::BadSamples(samples));
        }
        let scene = SceneResources::new(&mut queue, (quality, samples), reduction)?;
        let one_pixel = PickTargets::new(gpu, [1, 1])?;
        let panels = PanelPainter::new(gpu, gpu.picture_format())?;
        save_pipelines_to_disk(gpu);
        if setup.picture.on_software_rasterizer.is_some() && is_software {
            tracing::info!("the processor draws, at quality {quality:?} with {samples} samples");
        }
        if !gpu.can_draw_lines() {
            tracing::warn!("this device draws no lines: wireframes show the fill alone");
        }
        Ok(Self {
            scene,
            targets: None,
            reduced_targets: None,
            layer: SceneLayer::default(),
            is_picture_whole: false,
            is_shown: false,
            counted: None,
            one_pixel,
            pending: None,
            panels,
            setup,
            size,
            is_software,
            queue,
        })
    }

    /// Changes how it draws, on which device, from the next [`Renderer::renew`] on; whether
    /// anything is otherwise than before.
    pub fn set_options(&mut self, options: RendererOptions, choice: DeviceChoice) -> bool {
        let own = &mut self.setup;
        let before = (own.picture, own.gpu.device.take());
        (own.picture, own.gpu.device) = (PictureSettings::from_options(options), choice.device);
        before != (own.picture, own.gpu.device.clone())
    }

    /// Makes a new device in place of a lost one. Models are gone. Panel textures, limits and the
    /// validation log stay.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::open`]; then nothing can be drawn until a later call
    /// succeeds.
    pub fn renew(&mut self) -> Result<(), RenderError> {
        // A window has one surface at a time; models need not be there twice.
        self.queue.release_window();
        (self.targets, self.reduced_targets) = (None, None);
        self.scene.clear();
        let mut next = Self::open_with(self.setup.clone(), self.size)?;
        next.panels.inherit(&self.panels);
        next.scene.cache.set_limit(self.scene.cache.limit());
        next.queue.continue_window_frames(self.queue.window_frames());
        *self = next;
        Ok(())
    }

    /// Gives back all memory of the device that can be had again.
    ///
    /// # Errors
    /// When the device is lost or hangs.
    pub fn free_memory(&mut self) -> Result<(), RenderError> {
        self.layer = SceneLayer::default();
        self.reduced_targets = None;
        self.scene.cache.drop_all();
        self.scene.morpher.drop_all();
        self.scene.density = None;
        self.queue.free_memory()?;
        self.scene.trim();
        Ok(self.queue.free_memory()?)
    }

    /// Uploads a model: vertices, materials and textures, once.
    ///
    /// # Errors
    /// When the model refers to what it does not hold, or memory runs out.
    pub fn upload_model(&mut self, upload: ModelUpload<'_>) -> Result<ModelHandle, RenderError> {
        let handle = ModelHandle(self.scene.models.len() as u32);
        self.upload_model_at(handle, upload)?;
        Ok(handle)
    }

    /// Uploads a model that has this handle from here on, in place of the one that had it.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::upload_model`].
    pub fn upload_model_at(
        &mut self,
        handle: ModelHandle,
        upload: ModelUpload<'_>,
    ) -> Result<(), RenderError> {
        let index = handle.0 as usize;
        if index >= MAX_MODELS {
            let (asked, limit) = (index as u64 + 1, MAX_MODELS as u64);
            return Err(RenderError::TooMany { what: "models", asked, limit });
        }
        self.layer.forget();
        self.remove_model(handle);
        let mut recorder = self.queue.begin_transfer()?;
        let SceneResources { material_resources, feature_resources, vertices, .. } =
            &mut self.scene;
        let model = GpuModel::upload(
            &mut recorder,
            (material_resources, feature_resources),
            vertices,
            upload,
        )?;
        recorder.submit_and_wait()?;
        let models = &mut self.scene.models;
        if models.len() <= index {
            models.resize_with(index + 1, || None);
        }
        models[index] = Some(model);
        Ok(())
    }

    /// Frees a model once no frame in flight draws it. Drawing it again is an
    /// error.
    pub fn remove_model(&mut self, model: ModelHandle) {
        let slot = self.scene.models.get_mut(model.0 as usize).and_then(Option::take);
        if slot.is_some() {
            self.layer.forget();
            self.scene.resolver.cancel_where(|request| request.key().model == model.0);
            self.scene.morpher.remove_where(|key| key.model == model.0);
            self.scene.cache.remove_model(model.0);
            self.scene.invalidate_order();
        }
    }

    /// Frees all models; handles count from the first again.
    pub fn remove_all_models(&mut self) {
        self.layer.forget();
        self.scene.clear();
    }

    /// Requests geometry of later frames, the most urgent first. Worker threads resolve it; each
    /// frame uploads a share of [`MAX_UPLOAD_BYTES_PER_FRAME`](crate::MAX_UPLOAD_BYTES_PER_FRAME).
    /// A call replaces the requests before: others are dropped. Requests beyond
    /// [`MAX_PENDING_RESOLVES`](crate::MAX_PENDING_RESOLVES) are ignored: ask again after the next
    /// frame.
    pub fn request(&mut self, wanted: impl Iterator<Item = ResolveRequest>) {
        self.scene.request(wanted);
    }

    /// Returns the live triangles of a mesh at a cursor, if it can be drawn without being resolved
    /// first.
    pub fn triangles_at(&self, at: &MeshAtCursor) -> Option<u32> {
        let (key, _) = scene::find(&self.scene.models, at)?;
        Some(self.scene.cache.get(key)?.triangles)
    }

    /// Reports whether the morph to a coarser cursor can be drawn without resolving it first.
    pub fn has_morph_target(&self, coarser: &MeshAtCursor) -> bool {
        let found = scene::find(&self.scene.models, coarser);
        found.is_some_and(|(key, _)| self.scene.morpher.is_ready(key))
    }

    /// Takes changed textures of panels over without drawing. Each must come here
    /// or with a frame, and may come twice.
    ///
    /// # Errors
    /// When they contradict each other.
    pub fn update_textures(&mut self, delta: &egui::TexturesDelta) -> Result<(), RenderError> {
        Ok(self.panels.update(delta)?)
    }

    /// Counts records between the bins of axes, and which of them are brushed, on the device; waits
    /// for the result. Values stay there until others come.
    ///
    /// # Errors
    /// When values, axes and pairs do not fit each other, memory runs out, or the device is
    /// lost.
    pub fn count_records(
        &mut self,
        input: &DensityInput<'_>,
    ) -> Result<DensityCounts, RenderError> {
        self.layer.forget();
        let counted = busbar_density::count(&mut self.queue, &mut self.scene.density, input);
        if counted.is_err() {
            // Among it may be what was never filled.
            self.scene.density = None;
        }
        Ok(counted?)
    }

    /// Advances counting and the density picture for
    /// [`Polylines::planes`](crate::Polylines::planes): a slice of
    /// [`SLICE_RECORDS`](crate::SLICE_RECORDS) a call, without waiting for the device. With
    /// `waits`, waits for the end.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::count_records`]; what was counted before is gone then.
    pub fn advance_density(
        &mut self,
        input: &DensityInput<'_>,
        waits: bool,
    ) -> Result<DensityProgress, RenderError> {
        let density = &mut self.scene.density;
        let advanced = busbar_density::advance(&mut self.queue, density, input, waits);
        if advanced.is_err() {
            self.scene.density = None;
        }
        let counted = advanced.as_ref().ok().copied();
        if std::mem::replace(&mut self.counted, counted) != counted {
            self.layer.forget();
        }
        Ok(advanced?)
    }

    /// Changes the size of the picture from the next frame on. In a window,
    /// call it when the window's size changes. With a size of zero, as of a
    /// minimised window, frames are skipped.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.queue.resize_window(size);
    }

    /// Defers showing frames in the window where the processor draws, so that the next frame can be
    /// prepared meanwhile: each is shown by [`Renderer::present_deferred`], and at the latest with
    /// the next frame.
    pub fn defer_presentation(&mut self) {
        self.setup.defers_presentation = true;
        self.queue.defer_presentation(true);
    }

    /// Shows the last frame if that was deferred.
    ///
    /// # Errors
    /// When the device is lost or memory runs out; the next frame is drawn and shown at once.
    pub fn present_deferred(&mut self) -> Result<(), RenderError> {
        let presented = self.queue.present_deferred();
        let WindowFrames { submitted, shown } = self.queue.window_frames();
        self.is_shown &= submitted == shown;
        Ok(presented?)
    }

    /// Returns the numbers of the window's frames: the last one drawn, and the last one shown.
    pub fn window_frames(&self) -> WindowFrames {
        self.queue.window_frames()
    }

    /// Draws a frame; in a window, shows it, unless [`Renderer::defer_presentation`] was called.
    ///
    /// # Errors
    /// When the frame asks for what is not there or too much, memory runs out,
    /// or the device or window is lost. The renderer stays usable unless the
    /// device is lost.
    pub fn draw(&mut self, frame: &Frame<'_>) -> Result<FrameStats, RenderError> {
        if let Some(overlay) = &frame.overlay {
            // Also when the frame is skipped: egui tells of a change only once.
            self.panels.update(overlay.textures_delta)?;
        }
        let Some(size) = self.size_to_draw()? else {
            return Ok(FrameStats::default());
        };
        let drawn = self.draw_sized(frame, size);
        self.is_picture_whole = drawn.is_ok();
        match drawn {
            Ok(_) => self.panels.end_frame(),
            Err(_) => {
                self.is_shown = false;
                self.layer.forget();
                self.scene.abandon_frame();
                self.panels.abandon_frame();
            }
        }
        drawn
    }

    /// Reports whether the last picture is that of a frame, panels included, and the window shows
    /// it, so that drawing it would change nothing. False where that is not known, and while
    /// geometry is on its way.
    pub fn shows(&self, frame: &Frame<'_>) -> bool {
        let Some(size) = self.targets.as_ref().map(SceneTargets::size) else { return false };
        let fits = match self.setup.window {
            Some(_) => self.queue.fits_window(),
            None => self.size == size,
        };
        // A lost device is found out here where nothing else is asked of it.
        let has_device = self.queue.is_idle().is_ok();
        fits && has_device
            && self.is_shown
            && self.is_picture_whole
            && self.scene.resolver.pending_count() == 0
            && self.layer.shows(frame, size)
            && self.panels.difference(frame.overlay.as_ref(), size).is_none()
    }

    /// Forgets the last picture and the kept image of the scene: the next frame draws all of it.
    pub fn forget_picture(&mut self) {
        self.layer.forget();
        (self.is_picture_whole, self.is_shown) = (false, false);
    }

    /// Notes that the window lost its picture, for instance because it was uncovered.
    pub fn invalidate_shown(&mut self) {
        self.is_shown = false;
    }

    /// Returns the size of the next picture; `None` if there is nothing to draw into.
    fn size_to_draw(&mut self) -> Result<Option<[u32; 2]>, RenderError> {
        if self.setup.window.is_some() {
            return Ok(self.queue.prepare_window()?);
        }
        Ok(Some(self.size).filter(|size| !size.contains(&0)))
    }

    fn draw_sized(&mut self, frame: &Frame<'_>, size: [u32; 2]) -> Result<FrameStats, RenderError> {
        let samples = self.scene.samples;
        if self.targets.as_ref().is_none_or(|targets| targets.size() != size) {
            self.layer.forget();
            self.reduced_targets = None;
        }
        let targets = SceneTargets::fitting(&mut self.targets, self.queue.gpu(), samples, size)?;
        let mut recorder = self.queue.begin_frame()?;
        let started = Instant::now();
        let difference = self.layer.difference(frame, size);
        let is_kept = self.layer.is_kept()
            && self.scene.resolver.pending_count() == 0
            && difference.is_none();
        if let Some(part) = difference {
            tracing::debug!("the scene is drawn: {part} changed");
        }
        let (mut stats, first_pass, mut damage);
        if is_kept {
            let Self { layer, panels, is_picture_whole, .. } = self;
            let difference = panels.difference(frame.overlay.as_ref(), size);
            damage = if *is_picture_whole { difference } else { Some(whole(size)) };
            if let Some(area) = damage {
                layer.restore(&mut recorder, &targets.picture, area)?;
            }
            (stats, first_pass) = (layer.stats(), None);
        } else {
            damage = Some(whole(size));
            self.scene.cache.begin_frame();
            let scene_size = frame.scene_size(size);
            if scene_size == size {
                (stats, first_pass) = self.scene.record(&mut recorder, targets, frame)?;
            } else {
                let (slot, gpu) = (&mut self.reduced_targets, recorder.gpu());
                let reduced = SceneTargets::fitting(slot, gpu, samples, scene_size)?;
                (stats, first_pass) = self.scene.record(&mut recorder, reduced, frame)?;
                recorder.scale_image(&reduced.picture, &targets.picture)?;
            }
            self.layer.note_drawn(&mut recorder, frame, &targets.picture, stats)?;
        }
        match (frame.overlay, damage.take()) {
            (Some(EguiFrame { primitives, pixels_per_point, .. }), Some(area)) => {
                let _span = tracing::debug_span!("panels").entered();
                let target = (&targets.picture, area);
                self.panels.record(&mut recorder, target, primitives, pixels_per_point)?;
                recorder.end_stage("panels");
            }
            (None, Some(_)) => self.panels.note_none(),
            (_, None) => {}
        }
        stats.cpu_millis = millis_since(started);
        if let Some(FirstPass { handed, there, .. }) = first_pass {
            let millis = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e3;
            stats.cpu_millis = millis(started, handed);
            stats.depth_wait_millis = millis(handed, there);
            stats.occlusion_millis = millis_since(there);
        }
        stats.gpu_millis = recorder.queue().frame_millis();
        stats.gpu_stages = recorder.queue().stage_millis();
        self.is_shown = if self.setup.window.is_some() {
            recorder.present(&targets.picture)?
        } else {
            recorder.submit()?;
            true
        };
        if !is_kept {
            self.scene.cache.evict();
            self.scene.trim();
        }
        Ok(stats)
    }

    /// Reports whether all frames are finished; does not wait. False on a lost device.
    pub fn has_finished(&self) -> bool {
        self.queue.is_idle().unwrap_or(false)
    }

    /// Frees device memory of what was removed since the last frame; does not wait. For times in
    /// which no frame is drawn.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn free_idle_memory(&mut self) -> Result<(), RenderError> {
        Ok(self.queue.free_idle_memory()?)
    }

    /// Waits until all frames are finished, so that their time can be measured.
    ///
    /// # Errors
    /// When the device hangs or is lost.
    pub fn finish(&mut self) -> Result<(), RenderError> {
        Ok(self.queue.wait()?)
    }

    /// Reads the last frame drawn, once it is finished.
    ///
    /// # Errors
    /// When nothing was drawn yet, memory runs out, or the device is lost.
    pub fn read_picture(&mut self) -> Result<Picture, RenderError> {
        let picture = &self.targets.as_ref().ok_or(RenderError::NoPicture)?.picture;
        let mut recorder = self.queue.begin_transfer()?;
        let download = recorder.download(picture)?;
        recorder.submit_and_wait()?;
        let [width, height] = picture.size();
        Ok(Picture { width, height, rgba8: download.pixels()? })
    }

    /// Picks the object at a pixel of the frame, drawn at the present size; `None` for the
    /// background. Panels are ignored.
    ///
    /// # Errors
    /// When the pixel lies outside the picture; otherwise as [`Renderer::draw`].
    pub fn pick(&mut self, frame: &Frame<'_>, pixel: [u32; 2]) -> Result<Option<u32>, RenderError> {
        let size = self.picked_size();
        if pixel[0] >= size[0] || pixel[1] >= size[1] {
            return Err(RenderError::OutsidePicture { pixel, size });
        }
        let picked = self.pick_into(None, &PixelArea::pixel(pixel, size), frame)?;
        Ok(picked.first().copied().flatten())
    }

    /// Picks the objects at all pixels, as [`Renderer::pick`] does: rows from the top. The width is
    /// that of [`Renderer::picked_size`].
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::draw`].
    pub fn pick_all(&mut self, frame: &Frame<'_>) -> Result<Vec<Option<u32>>, RenderError> {
        let size = self.picked_size();
        if size.contains(&0) {
            return Ok(Vec::new());
        }
        let targets = PickTargets::new(self.queue.gpu(), size)?;
        self.pick_into(Some(&targets), &PixelArea::whole(size), frame)
    }

    /// Begins to ask for the objects in a part of a picture of the frame, and does not
    /// wait for the answer; a pick that was begun before is given up.
    ///
    /// # Errors
    /// Returns the errors of [`Renderer::pick`].
    pub fn begin_pick(&mut self, frame: &Frame<'_>, area: &PixelArea) -> Result<(), RenderError> {
        self.pending = None;
        if !area.is_within() {
            return Err(RenderError::OutsidePicture { pixel: area.origin, size: area.picture });
        }
        self.scene.cache.begin_frame();
        let begun = begin_pick(&mut self.queue, &mut self.scene, area, frame);
        match begun {
            Ok(_) => self.scene.cache.evict(),
            Err(_) => self.scene.cache.abandon_frame(),
        }
        self.pending = Some(begun?);
        Ok(())
    }

    /// Takes the result of a pick that was begun; a result is returned once.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn take_pick(&mut self) -> Result<PickState, RenderError> {
        let Some(pick) = self.pending.take() else { return Ok(PickState::None) };
        if !self.queue.has_finished(pick.submission)? {
            self.pending = Some(pick);
            return Ok(PickState::Pending);
        }
        Ok(PickState::Done(pick::objects_of(&pick.download.pixels()?).collect()))
    }

    /// Returns the size of the picture that picks refer to, pixels: the last one shown.
    pub fn picked_size(&self) -> [u32; 2] {
        self.targets.as_ref().map_or(self.size, SceneTargets::size)
    }

    /// Draws ids, into a single pixel if not told otherwise.
    fn pick_into(
        &mut self,
        targets: Option<&PickTargets>,
        area: &PixelArea,
        frame: &Frame<'_>,
    ) -> Result<Vec<Option<u32>>, RenderError> {
        self.scene.cache.begin_frame();
        let targets = targets.unwrap_or(&self.one_pixel);
        let picked = pick_with(&mut self.queue, &mut self.scene, targets, area, frame);
        match picked {
            Ok(_) => self.scene.cache.evict(),
            Err(_) => self.scene.cache.abandon_frame(),
        }
        picked
    }

    /// Bounds the index buffers that are kept beyond the current frame's; at
    /// first it is [`MAX_CACHED_INDEX_BYTES`](crate::MAX_CACHED_INDEX_BYTES).
    pub fn set_index_cache_limit(&mut self, bytes: u64) {
        self.scene.cache.set_limit(bytes);
    }

    /// Returns the bytes of the index buffers now.
    pub fn index_cache_bytes(&self) -> u64 {
        self.scene.cache.bytes()
    }

    /// Reports whether wireframes show lines; if not, they show the fill alone.
    pub fn can_draw_wireframe(&self) -> bool {
        self.queue.gpu().can_draw_lines()
    }

    /// Returns all messages of the validation layer so far, warnings and errors.
    pub fn validation_messages(&self) -> Vec<String> {
        self.validation_log().messages()
    }

    /// Returns the validation log, readable also after the renderer is gone.
    pub fn validation_log(&self) -> ValidationLog {
        self.queue.gpu().validation_log()
    }

    /// Reports whether a software rasterizer draws: CPU triangle culling and occlusion culling are
    /// on then.
    pub fn uses_software_rasterizer(&self) -> bool {
        self.is_software
    }

    /// Returns the name of the device.
    pub fn device_name(&self) -> &str {
        self.queue.gpu().device_name()
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // Some are compiled when first asked for.
        save_pipelines_to_disk(self.queue.gpu());
    }
}

/// Returns the area of a whole picture.
fn whole(size: [u32; 2]) -> ImageArea {
    ImageArea { origin: [0; 2], size }
}

/// Saves newly compiled pipelines to disk.
fn save_pipelines_to_disk(gpu: &Gpu) {
    if let Err(error) = gpu.save_pipelines() {
        tracing::info!("compiled pipelines are not kept: {error}");
    }
}

fn pick_with(
    queue: &mut GpuQueue,
    scene: &mut SceneResources,
    targets: &PickTargets,
    area: &PixelArea,
    frame: &Frame<'_>,
) -> Result<Vec<Option<u32>>, RenderError> {
    let mut recorder = queue.begin_transfer()?;
    scene.record_pick(&mut recorder, targets, area, frame)?;
    let download = recorder.download(&targets.id)?;
    recorder.submit_and_wait()?;
    Ok(pick::objects_of(&download.pixels()?).collect())
}

fn begin_pick(
    queue: &mut GpuQueue,
    scene: &mut SceneResources,
    area: &PixelArea,
    frame: &Frame<'_>,
) -> Result<PendingPick, RenderError> {
    let targets = PickTargets::new(queue.gpu(), area.size)?;
    let mut recorder = queue.begin_transfer()?;
    scene.record_pick(&mut recorder, &targets, area, frame)?;
    let download = recorder.download(&targets.id)?;
    Ok(PendingPick { submission: recorder.submit_tracked()?, download })
}
