//! Picking: selection, hovering and measuring through the renderer's id picture.

use super::*;

impl Viewer {
    /// Selects the equipment at a pixel and returns its id. Waits for the device.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn pick(&mut self, pixel: [u32; 2]) -> Result<Option<String>, ViewError> {
        self.update_draw_list();
        let frame = self.frame_of(self.view(), self.scene_draw_list.list(), &[], None);
        let pick = |renderer: &mut Renderer| renderer.pick(&frame, pixel);
        if let Some(object) = self.recovery.run(&mut self.renderer, &self.scene, pick)? {
            self.select(node_of(object));
            self.note_host_pick(node_of(object));
        }
        let selected = self.selection.first();
        Ok(selected.map(|node| self.scene.graph.node(*node).id()))
    }

    /// Names what the last frame shows at each of many pixels, from one picture
    /// of ids, and selects nothing.
    ///
    /// # Errors
    /// Errors of the graphics device, or a pixel outside the picture.
    pub fn pick_many(&mut self, pixels: &[[u32; 2]]) -> Result<Vec<Option<String>>, ViewError> {
        let size = self.renderer.picked_size();
        self.update_draw_list();
        let frame = self.frame_of(self.view(), self.scene_draw_list.list(), &[], None);
        let objects = self.recovery.run(&mut self.renderer, &self.scene, |r| r.pick_all(&frame))?;
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

    /// Returns the equipment id under the pointer, as last picked.
    pub fn hovered(&self) -> Option<String> {
        self.hovered.map(|node| self.scene.graph.node(node).id())
    }

    /// Reports whether frames must continue without input: a pick is pending, or something moves.
    pub(super) fn needs_frames(&self) -> bool {
        self.pick_queue.is_busy()
            || self.navigator.is_moving()
            || !self.moving_parts.just_moved().is_empty()
    }

    /// Selects the equipment of the chart line at a position, or else picks in the scene.
    pub(super) fn pick_line_or_scene(&mut self, at: Pos2) {
        let projection = self.last_view.map(|view| Projection::new(&view, self.screen));
        let node = projection.and_then(|by| self.chart.as_ref()?.node_at(at, by));
        match node {
            Some(node) => {
                self.select([node]);
                self.note_host_pick(Some(node));
            }
            None => self.pick_at(PickPurpose::Select, at),
        }
    }

    /// Requests a pick at a position of the displayed picture.
    pub(super) fn pick_at(&mut self, purpose: PickPurpose, at: Pos2) {
        let picture = self.renderer.picked_size();
        self.enqueue(purpose, PixelArea::pixel(self.pixel(at), picture));
    }

    /// Asks what shows in a part of it.
    pub(super) fn pick_in(&mut self, purpose: PickPurpose, area: Rect) {
        let picture = self.renderer.picked_size();
        let origin = self.pixel(area.min);
        let end = [area.max.x, area.max.y].map(|points| (points * self.pixels_per_point).ceil());
        let size =
            [0, 1].map(|axis| (end[axis] as u32).min(picture[axis]).saturating_sub(origin[axis]));
        self.enqueue(purpose, PixelArea { origin, size, picture });
    }

    fn enqueue(&mut self, purpose: PickPurpose, area: PixelArea) {
        if let Some(view) = self.last_view {
            self.pick_queue
                .enqueue(PickRequest { purpose, area, view }, self.scene_draw_list.list());
        }
    }

    fn pixel(&self, at: Pos2) -> [u32; 2] {
        [at.x, at.y].map(|points| (points * self.pixels_per_point) as u32)
    }

    /// Notes where the pointer is.
    pub(super) fn point_at(&mut self, position: Option<Pos2>) {
        self.pointer = position;
        if position.is_none() {
            self.hovered = None;
            self.pick_queue.forget_hover();
        }
    }

    /// Takes an answer, and asks the next question; waits for neither.
    pub(super) fn step_pick_queue(&mut self) -> Result<(), ViewError> {
        if self.navigator.is_moving() {
            // What was under the pointer is somewhere else.
            self.hovered = None;
            self.pick_queue.forget_hover();
        }
        if let Some(request) = self.pick_queue.in_progress() {
            let take = |renderer: &mut Renderer| renderer.take_pick();
            match self.recovery.run(&mut self.renderer, &self.scene, take)? {
                Some(PickState::Pending) => return Ok(()),
                Some(PickState::Done(objects)) => {
                    self.pick_queue.end();
                    self.apply_result(request, &objects);
                }
                // The device was lost meanwhile: the operator clicks again.
                Some(PickState::None) | None => self.pick_queue.end(),
            }
        }
        if let Some((request, shown)) = self.pick_queue.next() {
            return self.begin_pick(request, Some(&shown));
        }
        match self.idle_request().filter(|_| !self.navigator.is_moving()) {
            Some(request) => self.begin_pick(request, None),
            None => Ok(()),
        }
    }

    /// Returns the hover or label request that is due while the operator requests nothing.
    fn idle_request(&self) -> Option<PickRequest> {
        let (view, picture) = (self.last_view?, self.renderer.picked_size());
        let hover = self.pointer.map(|pointer| {
            let area = PixelArea::pixel(self.pixel(pointer), picture);
            PickRequest { purpose: PickPurpose::Hover, area, view }
        });
        // Labels fade once the camera rests: they are calm while it moves. A picture
        // without a window must not depend on when the answer comes.
        let fades = self.camera_rests && !self.settles && !self.labelled.is_empty();
        let area = PixelArea::whole(picture);
        let labels = fades.then_some(PickRequest { purpose: PickPurpose::Labels, area, view });
        [hover, labels].into_iter().flatten().find(|request| self.pick_queue.is_new(request))
    }

    /// Asks about a picture that showed this, or the last one.
    fn begin_pick(
        &mut self,
        request: PickRequest,
        shown: Option<&DrawList>,
    ) -> Result<(), ViewError> {
        let shown = shown.unwrap_or(self.scene_draw_list.list());
        let frame = self.frame_of(request.view, shown, &[], None);
        let begin = |renderer: &mut Renderer| renderer.begin_pick(&frame, &request.area);
        match self.recovery.run(&mut self.renderer, &self.scene, begin) {
            Ok(Some(())) => self.pick_queue.begin(request),
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
                self.note_host_pick(first);
            }
            PickPurpose::SelectAll => {
                let nodes: BTreeSet<NodeIndex> =
                    objects.iter().filter_map(|object| node_of(*object)).collect();
                self.select(nodes);
            }
            PickPurpose::Hover => self.hovered = first.filter(|_| self.pointer.is_some()),
            PickPurpose::Measure => self.measure_to(first, &request),
            PickPurpose::Labels => {
                let picture = hidden_labels::IdPicture { objects, request: &request };
                let hidden =
                    hidden_labels::find_hidden_labels(&self.surfaces(), &self.labelled, &picture);
                self.hidden_labels = hidden;
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
        if let (Some(measuring), Some(point)) = (&mut self.measuring, point) {
            measuring.add(point);
        }
    }

    /// Returns the surfaces for ray casts.
    fn surfaces(&self) -> ray_casting::SceneSurfaces<'_> {
        let LoadedScene { graph, models, .. } = &self.scene;
        ray_casting::SceneSurfaces { graph, models, section: self.section }
    }
}
