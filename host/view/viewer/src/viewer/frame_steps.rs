//! Steps of a frame: overlays, panels, graphics, level of detail, drawing.

use std::time::{Duration, Instant};

use busbar_renderer::{CameraView, EguiFrame, Frame, FrameStats, Picture, RenderError};
use busbar_scene::NodeIndex;
use busbar_site::CpuClock;
use busbar_ui::{Command, ListModels, SceneOverlay};
use egui::{PlatformOutput, RawInput, Rect};

use super::{FrameOutput, Viewer};
use crate::ViewError;
use crate::alarms::AlarmListRows;
use crate::frame_statistics::FrameStageMillis;
use crate::freed_memory::release_freed_memory;
use crate::panel_frame::{PanelFrame, are_same};
use crate::panel_rows::TagListRows;
use crate::scene_drawing::background;
use busbar_camera::NavigationContext;
use busbar_camera::Navigator;
use busbar_camera::Projection;
use busbar_lod::LodCamera;
use busbar_scene_loader::millis_since;
use busbar_scene_overlays::OverlayFrame;
use busbar_scene_overlays::{LinesByNode, OverlayCamera};

/// Shortest frame time that is aimed at while the camera moves, where the processor draws,
/// milliseconds: 30 frames a second.
const SOFTWARE_FRAME_MILLIS: f64 = 1_000.0 / 30.0;

/// Outcome of drawing a frame.
pub(super) enum DrawOutcome {
    /// Picture that was drawn.
    Drawn(Box<DrawnFrame>),
    /// Last picture, which is that of the frame as well.
    Unchanged,
    /// Last picture, which is of an earlier frame: nobody sees it.
    Unseen,
    /// No picture, for there is no device.
    NoDevice,
}

/// Frame that was drawn, with the camera view that it shows.
pub(super) struct DrawnFrame {
    view: CameraView,
    stats: FrameStats,
    /// CPU time before the renderer's part, milliseconds.
    prepared_millis: f64,
}

impl Viewer {
    /// Assembles what overlays, alarms and chart show. The chart may select equipment and visit it.
    pub(super) fn assemble_overlays(
        &mut self,
        seconds: f64,
        stages: &mut FrameStageMillis,
    ) -> OverlayFrame {
        let began = CpuClock::start();
        let Self { site, scene, overlays, interaction, host, .. } = self;
        let mut shown = overlays.assemble(site, &mut scene.graph);
        if let Some(id) = overlays.step_chart(site, &scene.graph, seconds) {
            interaction.select(scene.graph.find(&id));
            host.camera_commands.push(Command::Reveal(id));
        }
        overlays.add_chart(site, &scene.graph, interaction.selection(), &mut shown);
        stages.overlays += began.millis();
        shown
    }

    /// Steps the view while nobody sees the picture, which would be another than the last one: takes
    /// samples, steps alarms, obeys the host program, answers picks.
    pub(super) fn step_unseen(&mut self, seconds: f64) -> Result<FrameOutput, ViewError> {
        let Self { site, scene, overlays, interaction, host, navigator, target, .. } = self;
        if let Some(id) = overlays.step_chart(site, &scene.graph, seconds) {
            interaction.select(scene.graph.find(&id));
            host.camera_commands.push(Command::Reveal(id));
        }
        let selection = interaction.selected_bounds(&scene.graph);
        let (graph, cameras) = (&*scene.graph, &scene.config.cameras);
        let context = NavigationContext { graph, cameras, viewport: target.viewport, selection };
        navigator.steer(&std::mem::take(&mut host.camera_commands), &context);
        if let Err(error) = self.renderer.get_mut().free_idle_memory() {
            // The next frame that is seen replaces the device.
            tracing::debug!(%error, "memory of a view that nobody sees stays");
        }
        self.step_picks()?;
        let trouble = self.renderer.recovery().frozen_message();
        let (is_drawn, is_current) = (false, false);
        let repaint_after = Duration::MAX;
        Ok(FrameOutput { platform: None, repaint_after, is_drawn, is_current, trouble })
    }

    /// Runs the panels, steers the camera, and performs the operator's commands. Returns the panels
    /// and the nodes that labels stand at. The panels of the last frame are kept where others would
    /// look the same; returns none where they would not, and nobody sees them.
    pub(super) fn run_panels(
        &mut self,
        input: RawInput,
        shown: &OverlayFrame,
        stages: &mut FrameStageMillis,
    ) -> Option<(PanelFrame, Vec<NodeIndex>)> {
        let began = CpuClock::start();
        let lines =
            LinesByNode::new(shown.lines(), &shown.unknown_labels, self.interaction.selection());
        stages.overlays += began.millis();
        let began = CpuClock::start();
        let (snapshot, scene) = (self.site.snapshot(), &self.scene);
        let tag_rows =
            TagListRows::new(scene, snapshot, self.equipment.tag_filter(), shown.lines());
        let model = self.view_model(&tag_rows, &shown.states);
        let alarm_rows = AlarmListRows {
            alarm_service: self.site.alarms(),
            presentation: &self.alarms,
            scene,
            snapshot,
        };
        let tree_rows = self.equipment.tree_rows(scene);
        let lists = ListModels { tags: &tag_rows, alarms: &alarm_rows, equipment: &tree_rows };
        let host_commands = std::mem::take(&mut self.host.camera_commands);
        let (site, interaction, graph) = (&self.site, &self.interaction, &scene.graph);
        let (overlays, navigator) = (&mut self.overlays, &mut self.navigator);
        let (screen, selection) = (self.target.screen, interaction.selection());
        let selected_bounds = interaction.selected_bounds(graph);
        let mut over_scene_millis = [0.0; 2];
        let mut content_seen_by = |navigator: &Navigator, viewport: Rect| {
            let view = navigator.camera().view(viewport, screen, graph.bounds());
            let projection = Projection::new(&view, screen);
            let camera = OverlayCamera { projection, eye: view.eye };
            let pointed = (selection, interaction.pointer());
            let content =
                overlays.content_over_scene(site, graph, (shown, &lines), camera, pointed);
            over_scene_millis = content.millis;
            let measuring = interaction.measuring.as_ref();
            SceneOverlay {
                labels: content.labels,
                alarm_markers: content.alarm_markers,
                switch_symbols: content.switch_symbols,
                arrived: navigator.has_arrived(),
                measurement: measuring.map(|measuring| measuring.projected(projection)),
                hovered: interaction.hovered.map(|node| graph.node(node).id()),
                chart: content.chart,
            }
        };
        // Without a command the camera stands as it does, and the viewport is the last one.
        let is_kept = host_commands.is_empty()
            && !self.target.settles
            && self.panels.keeps_panels(&input, &model, &lists)
            && self.panels.keeps_overlay(&content_seen_by(navigator, self.target.viewport));
        // Panels that have not settled may still come to look as they did.
        let is_settled = self.panels.is_settled();
        if !is_kept && !self.is_seen && is_settled && input.events.is_empty() {
            self.host.camera_commands = host_commands;
            return None;
        }
        let panels = if is_kept {
            PanelFrame::kept(self.drawing.take_panels(), self.target.pixels_per_point)
        } else {
            let output = self.panels.run(input, &model, &lists, |viewport, commands| {
                let cameras = &scene.config.cameras;
                let context =
                    NavigationContext { graph, cameras, viewport, selection: selected_bounds };
                navigator.steer(&host_commands, &context);
                navigator.steer(commands, &context);
                let overlay = content_seen_by(navigator, viewport);
                navigator.take_arrival();
                overlay
            });
            self.target.viewport = output.viewport;
            let panels = PanelFrame::new(self.panels.context(), output.egui);
            let is_same = are_same(self.drawing.primitives(), &panels.primitives);
            self.panels.note_result(is_same);
            self.apply_commands(&output.commands);
            panels
        };
        let [labels_millis, markers_millis] = over_scene_millis;
        stages.panels = began.millis() - labels_millis - markers_millis;
        stages.overlays += labels_millis;
        stages.alarms += markers_millis;
        Some((panels, lines.nodes()))
    }

    /// Updates colours, lines and faces of the overlays, and outlines.
    pub(super) fn update_graphics(&mut self, shown: &OverlayFrame, stages: &mut FrameStageMillis) {
        let began = CpuClock::start();
        let Self { site, scene, overlays, interaction, navigator, target, .. } = self;
        let selection = interaction.selection();
        let camera = navigator.camera();
        let pixel = camera.pixel_size(target.viewport.size() * target.pixels_per_point);
        // A picture that nobody watches does not depend on those before it.
        let (settles, eye) = (target.settles, camera.eye());
        let pixel_at = |distance| if settles { 0.0 } else { pixel.at_distance(distance) };
        overlays.update_graphics(site, &scene.graph, shown, selection, (eye, &pixel_at));
        stages.overlays += began.millis();
        overlays.update_outlines(&scene.graph, selection, interaction.hovered);
    }

    /// Chooses the level of detail of all instances, and updates the draw list.
    pub(super) fn update_detail(&mut self, seconds: f64) {
        let Self { site, scene, alarms, overlays, detail, drawing, renderer, target, .. } = self;
        if let Some([unacknowledged, all]) = alarms.changed_detail(site, &scene.graph) {
            detail.set_emphasized(unacknowledged, all);
        }
        let moving = overlays.moving_parts();
        if !moving.just_moved().is_empty() {
            detail.move_instances(scene, moving.just_moved(), moving.moved());
            drawing.move_instances(scene, moving);
        }
        let camera = self.navigator.camera();
        let eye = LodCamera {
            position: camera.eye(),
            ahead: camera.forward(),
            pixel: camera.pixel_size(target.viewport.size() * target.pixels_per_point),
        };
        detail.update(renderer.get_mut(), eye, target.settles, seconds);
        drawing.update_draw_list(scene, detail, overlays.highlights());
    }

    /// Chooses the resolution of the scene, which is full in a view that settles. `seconds` is the
    /// time of the frame.
    pub(super) fn choose_resolution(&mut self, seconds: f64) {
        let target = self.scene.config.view.target_frame_millis.filter(|_| !self.target.settles);
        let target = match self.renderer.get().uses_software_rasterizer() {
            true => target.map(|target| target.max(SOFTWARE_FRAME_MILLIS)),
            false => target,
        };
        let view = self.view();
        self.drawing.choose_resolution(&view, (seconds, self.target.size_pixels()), target);
    }

    /// Draws scene and panels, unless the last picture shows the same.
    pub(super) fn draw(
        &mut self,
        panels: &mut PanelFrame,
        started: Instant,
    ) -> Result<DrawOutcome, ViewError> {
        let prepared_millis = millis_since(started);
        let (view, background) = (self.view(), self.background());
        let Self { scene, overlays, drawing, renderer, target, is_seen, .. } = self;
        let drawn = renderer.run(scene, |renderer| {
            overlays.count_chart(renderer)?;
            let highlights = overlays.highlights().of_nodes();
            let frame = drawing.frame(view, background, highlights, Some(panels.as_overlay()));
            let (outlined, polylines) = (overlays.outlined(), overlays.polylines());
            let frame = Frame { outlined, polylines, ..frame };
            if !target.settles && renderer.shows(&frame) {
                renderer.free_idle_memory()?;
                return Ok(DrawOutcome::Unchanged);
            }
            if !*is_seen {
                return Ok(DrawOutcome::Unseen);
            }
            let stats = renderer.draw(&frame)?;
            if !target.in_window {
                // Nobody watches: a frame counts from its beginning to its end.
                renderer.finish()?;
            }
            Ok(DrawOutcome::Drawn(Box::new(DrawnFrame { view, stats, prepared_millis })))
        });
        let drawn = drawn.map(|drawn| drawn.unwrap_or(DrawOutcome::NoDevice));
        if !matches!(drawn, Ok(DrawOutcome::Drawn(_))) {
            // egui tells of these once, and the next frame needs them.
            renderer.get_mut().update_textures(&panels.egui.textures_delta)?;
        }
        // Cleared in any case: egui panics when a delta is dropped full.
        panels.egui.textures_delta.clear();
        drawn
    }

    /// Notes a frame that was drawn, for the next frame and for picks.
    pub(super) fn note_drawn(&mut self, DrawnFrame { view, stats, prepared_millis }: DrawnFrame) {
        self.statistics.cpu_millis = prepared_millis + stats.cpu_millis;
        self.drawing.note_frame(view, stats);
        let is_judged = !self.drawing.is_resolution_intermediate();
        self.detail.note_frame(self.renderer.get(), &stats, is_judged);
    }

    /// Notes a frame whose picture is the last one.
    pub(super) fn note_unchanged(&mut self) {
        self.detail.note_cursors(self.renderer.get());
        self.drawing.note_unchanged();
    }

    /// Notes the content of overlays that the picture shows, for the next frame and for picks.
    pub(super) fn note_shown(&mut self, shown: OverlayFrame, labelled: Vec<NodeIndex>) {
        if self.overlays.note_frame(shown, labelled) {
            self.interaction.picks.forget_labels();
        }
    }

    /// Returns the memory of loading, which nobody needs again, after the first frame of a live
    /// view.
    pub(super) fn release_loading_memory(&self) {
        if self.statistics.frames() == 1 && !self.target.settles {
            release_freed_memory();
        }
    }

    /// Returns the output of a frame that was not drawn.
    pub(super) fn skipped_frame(&mut self, panels: PanelFrame) -> FrameOutput {
        let platform = self.keep_panels(panels);
        let recovery = self.renderer.recovery();
        FrameOutput {
            platform,
            repaint_after: recovery.next_try().unwrap_or(Duration::ZERO),
            is_drawn: false,
            is_current: false,
            trouble: recovery.frozen_message(),
        }
    }

    /// Returns the output of a frame with a device, which says nothing of its picture.
    pub(super) fn frame_output(&mut self, panels: PanelFrame) -> FrameOutput {
        let platform = self.keep_panels(panels);
        let needs_frames = self.detail.needs_frames(self.drawing.last_frame())
            || self.overlays.needs_frames()
            || self.interaction.picks.is_busy()
            || self.navigator.is_moving();
        let full_in = self.drawing.full_resolution_in().map(Duration::from_secs_f64);
        let repaint_after = match needs_frames {
            true => Duration::ZERO,
            false => self.panels.repaint_after().min(full_in.unwrap_or(Duration::MAX)),
        };
        let trouble = self.renderer.recovery().frozen_message();
        let (is_drawn, is_current) = (false, false);
        FrameOutput { platform, repaint_after, is_drawn, is_current, trouble }
    }

    /// Keeps the panels of a frame for the next one; returns what they ask of the platform.
    fn keep_panels(&mut self, panels: PanelFrame) -> Option<PlatformOutput> {
        let PanelFrame { egui, is_kept, primitives } = panels;
        self.drawing.keep_panels(primitives);
        (!is_kept).then_some(egui.platform_output)
    }

    /// Returns the last frame of a view without a window as a picture.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn read_picture(&mut self) -> Result<Picture, ViewError> {
        let no_textures = egui::TexturesDelta::default();
        let (view, background) = (self.view(), self.background());
        let Self { scene, overlays, drawing, renderer, target, .. } = self;
        let panels = EguiFrame {
            textures_delta: &no_textures,
            primitives: drawing.primitives(),
            pixels_per_point: target.pixels_per_point,
        };
        let frame = drawing.frame(view, background, overlays.highlights().of_nodes(), Some(panels));
        let (outlined, polylines) = (overlays.outlined(), overlays.polylines());
        let frame = Frame { outlined, polylines, ..frame };
        let has_drawn = self.statistics.frames() > 0;
        let read = renderer.run(scene, |renderer| {
            match renderer.read_picture() {
                // On a device that was made since.
                Err(RenderError::NoPicture) if has_drawn => {
                    renderer.draw(&frame)?;
                    renderer.read_picture()
                }
                read => read,
            }
        });
        read?.ok_or(ViewError::Render(RenderError::NoPicture))
    }

    /// Reports whether the last frame had panels, labels or other content over the scene. Such
    /// content takes a few frames to settle.
    pub fn has_content_over_scene(&self) -> bool {
        !self.drawing.primitives().is_empty()
    }

    /// Returns the camera view of the present frame.
    pub(super) fn view(&self) -> CameraView {
        self.drawing.view(self.navigator.camera(), &self.target, self.scene.graph.bounds())
    }

    /// Returns the background of the present frame, linear light.
    pub(super) fn background(&self) -> [f32; 3] {
        background(&self.scene.config.view, self.panels.is_dark())
    }
}
