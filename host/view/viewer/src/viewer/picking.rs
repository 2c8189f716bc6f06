//! Picking: selection, hovering and measuring through the renderer's id picture.

use std::collections::BTreeSet;

use busbar_renderer::{DrawList, PickState, PixelArea, RenderError, Renderer};
use busbar_scene::NodeIndex;
use egui::{Pos2, Rect};

use super::Viewer;
use crate::ViewError;
use crate::camera::Projection;
use crate::interaction::PickedPicture;
use crate::labels::hidden_labels;
use crate::object_numbers::node_of;
use crate::pick_queue::{PickPurpose, PickRequest};
use crate::ray_casting;
use busbar_scene_loader::LoadedScene;

impl Viewer {
    /// Selects the equipment at a pixel and returns its id. Waits for the device.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn pick(&mut self, pixel: [u32; 2]) -> Result<Option<String>, ViewError> {
        if let Some(object) =
            self.pick_with_present_frame(|renderer, frame| renderer.pick(frame, pixel))?
        {
            self.select(node_of(object));
            self.host.note_pick(node_of(object));
        }
        let selected = self.interaction.selection().first();
        Ok(selected.map(|node| self.scene.graph.node(*node).id()))
    }

    /// Names what the last frame shows at each of many pixels, from one picture
    /// of ids, and selects nothing.
    ///
    /// # Errors
    /// Errors of the graphics device, or a pixel outside the picture.
    pub fn pick_many(&mut self, pixels: &[[u32; 2]]) -> Result<Vec<Option<String>>, ViewError> {
        let size = self.renderer.get().picked_size();
        let objects = self.pick_with_present_frame(|renderer, frame| renderer.pick_all(frame))?;
        let objects = objects.ok_or(ViewError::Render(RenderError::NoPicture))?;
        let id_at = |&pixel: &[u32; 2]| {
            if pixel[0] >= size[0] || pixel[1] >= size[1] {
                return Err(RenderError::OutsidePicture { pixel, size }.into());
            }
            let index = pixel[1] as usize * size[0] as usize + pixel[0] as usize;
            Ok(node_of(objects[index]).map(|node| self.scene.graph.node(node).id()))
        };
        pixels.iter().map(id_at).collect()
    }

    /// Picks in a picture of the present camera, with all changes since the last frame.
    fn pick_with_present_frame<T>(
        &mut self,
        mut pick: impl FnMut(&mut Renderer, &busbar_renderer::Frame<'_>) -> Result<T, RenderError>,
    ) -> Result<Option<T>, ViewError> {
        let (view, background) = (self.view(), self.background());
        let Self { scene, overlays, detail, drawing, renderer, .. } = self;
        drawing.update_draw_list(scene, detail, overlays.highlights());
        let frame = drawing.pick_frame(view, background, drawing.draw_list());
        renderer.run(scene, |renderer| pick(renderer, &frame))
    }

    /// Returns the equipment id under the pointer, as last picked.
    pub fn hovered(&self) -> Option<String> {
        self.interaction.hovered.map(|node| self.scene.graph.node(node).id())
    }

    /// Selects the equipment of the chart line at a position, or else picks in the scene.
    pub(super) fn pick_line_or_scene(&mut self, at: Pos2) {
        let screen = self.target.screen;
        let projection = self.drawing.last_view().map(|view| Projection::new(&view, screen));
        let node = projection.and_then(|by| self.overlays.chart()?.node_at(at, by));
        match node {
            Some(node) => {
                self.select([node]);
                self.host.note_pick(Some(node));
            }
            None => self.pick_at(PickPurpose::Select, at),
        }
    }

    /// Requests a pick at a position of the displayed picture.
    pub(super) fn pick_at(&mut self, purpose: PickPurpose, at: Pos2) {
        let Self { interaction, drawing, renderer, target, .. } = self;
        let shown = PickedPicture {
            size: renderer.get().picked_size(),
            view: drawing.last_view(),
            instances: drawing.draw_list(),
        };
        interaction.pick_at(purpose, at, target, shown);
    }

    /// Requests a pick in a part of the displayed picture.
    pub(super) fn pick_in(&mut self, purpose: PickPurpose, area: Rect) {
        let Self { interaction, drawing, renderer, target, .. } = self;
        let shown = PickedPicture {
            size: renderer.get().picked_size(),
            view: drawing.last_view(),
            instances: drawing.draw_list(),
        };
        interaction.pick_in(purpose, area, target, shown);
    }

    /// Takes the result of a pick, and begins the next; waits for neither.
    pub(super) fn step_picks(&mut self) -> Result<(), ViewError> {
        if self.navigator.is_moving() {
            // What was under the pointer is somewhere else.
            self.interaction.forget_hover();
        }
        if let Some(request) = self.interaction.picks.in_progress() {
            let take = |renderer: &mut Renderer| renderer.take_pick();
            match self.renderer.run(&self.scene, take)? {
                Some(PickState::Pending) => return Ok(()),
                Some(PickState::Done(objects)) => {
                    self.interaction.picks.end();
                    self.apply_result(request, &objects);
                }
                // The device was lost meanwhile: the operator clicks again.
                Some(PickState::None) | None => self.interaction.picks.end(),
            }
        }
        if let Some((request, shown)) = self.interaction.picks.next() {
            return self.begin_pick(request, Some(&shown));
        }
        match self.idle_request().filter(|_| !self.navigator.is_moving()) {
            Some(request) => self.begin_pick(request, None),
            None => Ok(()),
        }
    }

    /// Returns the hover or label request that is due while the operator requests nothing.
    fn idle_request(&self) -> Option<PickRequest> {
        let (view, picture) = (self.drawing.last_view()?, self.renderer.get().picked_size());
        let hover = self.interaction.pointer().map(|pointer| {
            let area = PixelArea::pixel(self.target.pixel(pointer), picture);
            PickRequest { purpose: PickPurpose::Hover, area, view }
        });
        // Labels fade once the camera rests: they are calm while it moves. A picture
        // without a window must not depend on when the answer comes.
        let is_calm = self.drawing.camera_rests() && !self.target.settles;
        let fades = is_calm && !self.overlays.labelled().is_empty();
        let area = PixelArea::whole(picture);
        let labels = fades.then_some(PickRequest { purpose: PickPurpose::Labels, area, view });
        let picks = &self.interaction.picks;
        [hover, labels].into_iter().flatten().find(|request| picks.is_new(request))
    }

    /// Begins a pick in a picture that showed these instances, or else in the last one.
    fn begin_pick(
        &mut self,
        request: PickRequest,
        shown: Option<&DrawList>,
    ) -> Result<(), ViewError> {
        let background = self.background();
        let Self { scene, drawing, renderer, interaction, .. } = self;
        let instances = shown.unwrap_or(drawing.draw_list());
        let frame = drawing.pick_frame(request.view, background, instances);
        let begin = |renderer: &mut Renderer| renderer.begin_pick(&frame, &request.area);
        match renderer.run(scene, begin) {
            Ok(Some(())) => interaction.picks.begin(request),
            Ok(None) => {}
            // The window shrank since.
            Err(ViewError::Render(RenderError::OutsidePicture { .. })) => {
                self.apply_result(request, &[]);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn apply_result(&mut self, request: PickRequest, objects: &[Option<u32>]) {
        let first = objects.first().and_then(|object| node_of(*object));
        match request.purpose {
            PickPurpose::Select => {
                self.select(first);
                self.host.note_pick(first);
            }
            PickPurpose::SelectAll => {
                let nodes: BTreeSet<NodeIndex> =
                    objects.iter().filter_map(|object| node_of(*object)).collect();
                self.select(nodes);
            }
            PickPurpose::Hover => {
                let is_over_scene = self.interaction.pointer().is_some();
                self.interaction.hovered = first.filter(|_| is_over_scene);
            }
            PickPurpose::Measure => self.measure_to(first, &request),
            PickPurpose::Labels => {
                let picture = hidden_labels::IdPicture { objects, request: &request };
                let labelled = self.overlays.labelled();
                let hidden =
                    hidden_labels::find_hidden_labels(&self.surfaces(), labelled, &picture);
                self.overlays.set_hidden_labels(hidden);
            }
        }
    }

    /// Measures to where the line of sight through a pixel's middle meets a node.
    fn measure_to(&mut self, node: Option<NodeIndex>, request: &PickRequest) {
        let Some(node) = node else { return };
        let PixelArea { origin, picture, .. } = request.area;
        let middle = origin.map(|pixel| f64::from(pixel) + 0.5);
        let ray = ray_casting::Ray::through_pixel(&request.view, middle, picture);
        let point = ray_casting::surface_point(&self.surfaces(), node, &ray);
        if let (Some(measuring), Some(point)) = (&mut self.interaction.measuring, point) {
            measuring.add(point);
        }
    }

    /// Returns the surfaces for ray casts.
    fn surfaces(&self) -> ray_casting::SceneSurfaces<'_> {
        let LoadedScene { graph, models, .. } = &self.scene;
        ray_casting::SceneSurfaces { graph, models, section: self.drawing.section }
    }
}
