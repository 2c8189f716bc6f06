//! What is selected, hovered and measured.

use super::*;

impl Viewer {
    /// Selects and names what is at a pixel: its equipment id. Waits for the device.
    ///
    /// # Errors
    /// The device's.
    pub fn pick(&mut self, pixel: [u32; 2]) -> Result<Option<String>, ViewError> {
        self.update_drawn();
        let frame = self.picture_of(self.view(), self.drawn.list(), &[], None);
        let pick = |renderer: &mut Renderer| renderer.pick(&frame, pixel);
        if let Some(object) = self.recovery.run(&mut self.renderer, &self.scene, pick)? {
            self.select(node_of(object));
            self.note_picked(node_of(object));
        }
        let selected = self.selection.first();
        Ok(selected.map(|node| self.scene.graph.node(*node).id()))
    }

    /// Names what the last frame shows at each of many pixels, from one picture
    /// of ids, and selects nothing.
    ///
    /// # Errors
    /// The device's, or a pixel outside the picture.
    pub fn pick_many(&mut self, pixels: &[[u32; 2]]) -> Result<Vec<Option<String>>, ViewError> {
        let size = self.renderer.picked_size();
        self.update_drawn();
        let frame = self.picture_of(self.view(), self.drawn.list(), &[], None);
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

    /// Equipment id of what is under the pointer, as far as the device has told.
    pub fn hovered(&self) -> Option<String> {
        self.hovered.map(|node| self.scene.graph.node(node).id())
    }

    /// Whether frames must go on without input: an answer is to come, or the camera moves.
    pub(super) fn is_restless(&self) -> bool {
        self.picker.is_busy() || self.navigator.is_moving() || !self.moving.just_moved().is_empty()
    }

    /// Selects the equipment whose line of a chart is at a place; asks what is there in the
    /// scene where there is none.
    pub(super) fn pick_line_or_ask(&mut self, at: Pos2) {
        let projection = self.shown.map(|view| Projection::new(&view, self.screen));
        let node = projection.and_then(|by| self.chart.as_ref()?.node_at(at, by));
        match node {
            Some(node) => {
                self.select([node]);
                self.note_picked(Some(node));
            }
            None => self.ask_at(Purpose::Select, at),
        }
    }

    /// Asks what is at a place of the picture that is on the screen.
    pub(super) fn ask_at(&mut self, purpose: Purpose, at: Pos2) {
        let picture = self.renderer.picked_size();
        self.ask(purpose, PixelArea::pixel(self.pixel(at), picture));
    }

    /// Asks what shows in a part of it.
    pub(super) fn ask_in(&mut self, purpose: Purpose, area: Rect) {
        let picture = self.renderer.picked_size();
        let origin = self.pixel(area.min);
        let end = [area.max.x, area.max.y].map(|points| (points * self.pixels_per_point).ceil());
        let size =
            [0, 1].map(|axis| (end[axis] as u32).min(picture[axis]).saturating_sub(origin[axis]));
        self.ask(purpose, PixelArea { origin, size, picture });
    }

    fn ask(&mut self, purpose: Purpose, area: PixelArea) {
        if let Some(view) = self.shown {
            self.picker.ask(Question { purpose, area, view }, self.drawn.list());
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
            self.picker.forget_hover();
        }
    }

    /// Takes an answer, and asks the next question; waits for neither.
    pub(super) fn step_picks(&mut self) -> Result<(), ViewError> {
        if self.navigator.is_moving() {
            // What was under the pointer is somewhere else.
            self.hovered = None;
            self.picker.forget_hover();
        }
        if let Some(question) = self.picker.under_way() {
            let take = |renderer: &mut Renderer| renderer.take_pick();
            match self.recovery.run(&mut self.renderer, &self.scene, take)? {
                Some(PickState::Pending) => return Ok(()),
                Some(PickState::Done(objects)) => {
                    self.picker.end();
                    self.take_answer(question, &objects);
                }
                // The device was lost meanwhile: the operator clicks again.
                Some(PickState::None) | None => self.picker.end(),
            }
        }
        if let Some((question, shown)) = self.picker.next() {
            return self.begin(question, Some(&shown));
        }
        match self.idle_question().filter(|_| !self.navigator.is_moving()) {
            Some(question) => self.begin(question, None),
            None => Ok(()),
        }
    }

    /// What is asked where the operator asks nothing.
    fn idle_question(&self) -> Option<Question> {
        let (view, picture) = (self.shown?, self.renderer.picked_size());
        let hover = self.pointer.map(|pointer| {
            let area = PixelArea::pixel(self.pixel(pointer), picture);
            Question { purpose: Purpose::Hover, area, view }
        });
        // Labels fade once the camera rests: they are calm while it moves. A picture
        // without a window must not depend on when the answer comes.
        let fades = self.rests && !self.settles && !self.labelled.is_empty();
        let area = PixelArea::whole(picture);
        let labels = fades.then_some(Question { purpose: Purpose::Labels, area, view });
        [hover, labels].into_iter().flatten().find(|question| self.picker.is_new(question))
    }

    /// Asks about a picture that showed this, or the last one.
    fn begin(&mut self, question: Question, shown: Option<&DrawList>) -> Result<(), ViewError> {
        let shown = shown.unwrap_or(self.drawn.list());
        let frame = self.picture_of(question.view, shown, &[], None);
        let begin = |renderer: &mut Renderer| renderer.begin_pick(&frame, &question.area);
        match self.recovery.run(&mut self.renderer, &self.scene, begin) {
            Ok(Some(())) => self.picker.begin(question),
            Ok(None) => {}
            // The window shrank since.
            Err(ViewError::Render(RenderError::OutsidePicture { .. })) => {
                self.take_answer(question, &[]);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn take_answer(&mut self, question: Question, objects: &[Option<u32>]) {
        let first = objects.first().and_then(|object| node_of(*object));
        match question.purpose {
            Purpose::Select => {
                self.select(first);
                self.note_picked(first);
            }
            Purpose::SelectAll => {
                let nodes: BTreeSet<NodeIndex> =
                    objects.iter().filter_map(|object| node_of(*object)).collect();
                self.select(nodes);
            }
            Purpose::Hover => self.hovered = first.filter(|_| self.pointer.is_some()),
            Purpose::Measure => self.measure_to(first, &question),
            Purpose::Labels => {
                let ids = occlusion::Ids { objects, question: &question };
                let hidden = occlusion::hidden(&self.surfaces(), &self.labelled, &ids);
                self.hidden_labels = hidden;
            }
        }
    }

    /// Measures to where the line of sight through a pixel's middle meets a node.
    fn measure_to(&mut self, node: Option<NodeIndex>, question: &Question) {
        let Some(node) = node else { return };
        let PixelArea { origin, picture, .. } = question.area;
        let middle = origin.map(|pixel| f64::from(pixel) + 0.5);
        let ray = ray::Ray::through(&question.view, middle, picture);
        let point = ray::surface_point(&self.surfaces(), node, &ray);
        if let (Some(measuring), Some(point)) = (&mut self.measuring, point) {
            measuring.add(point);
        }
    }

    /// What lines of sight end at.
    fn surfaces(&self) -> ray::Surfaces<'_> {
        let LoadedScene { graph, models, .. } = &self.scene;
        ray::Surfaces { graph, models, section: self.section }
    }
}
