//! Target of a view: where its picture goes, how large it is, and whether frames wait for work.

use egui::{Pos2, RawInput, Rect};

/// Geometry of the picture, and the properties of the place where it is shown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewTarget {
    /// Extent of the whole picture, points.
    pub(crate) screen: Rect,
    /// Part of the picture that shows the scene, points.
    pub(crate) viewport: Rect,
    /// Pixels of the picture in one point.
    pub(crate) pixels_per_point: f32,
    /// True for a window of its own.
    pub(crate) in_window: bool,
    /// True if frames wait until all background work is done.
    pub(crate) settles: bool,
}

impl ViewTarget {
    /// Creates a target of `size` pixels with `scale` pixels a point.
    pub(crate) fn new(size: [u32; 2], scale: f32, in_window: bool, settles: bool) -> Self {
        let screen = screen_of(size, scale);
        Self { screen, viewport: screen, pixels_per_point: scale, in_window, settles }
    }

    /// Takes over the screen and the scale of a frame's input.
    pub(crate) fn update(&mut self, input: &RawInput, zoom: f32) {
        if let Some(screen) = input.screen_rect {
            self.screen = screen;
        }
        let native =
            input.viewports.get(&input.viewport_id).and_then(|v| v.native_pixels_per_point);
        self.pixels_per_point = native.unwrap_or(1.0) * zoom;
    }

    /// Changes the size of a target without a window, pixels.
    pub(crate) fn resize(&mut self, size: [u32; 2], scale: f32) {
        self.screen = screen_of(size, scale);
    }

    /// Changes the scale of a target without a window, and keeps its size in pixels.
    pub(crate) fn rescale(&mut self, before: f32, after: f32) {
        if !self.in_window {
            let pixels = self.screen.size() * before;
            self.screen = Rect::from_min_size(Pos2::ZERO, pixels / after);
        }
    }

    /// Returns the input for a frame of a target without a window.
    pub(crate) fn headless_input(&self, seconds: f64, scale: f32) -> RawInput {
        let mut input =
            RawInput { screen_rect: Some(self.screen), time: Some(seconds), ..RawInput::default() };
        input.viewports.entry(input.viewport_id).or_default().native_pixels_per_point = Some(scale);
        input
    }

    /// Returns the size of the whole picture, pixels.
    pub(crate) fn size_pixels(&self) -> [u32; 2] {
        let size = self.screen.size() * self.pixels_per_point;
        [size.x, size.y].map(|pixels| pixels.round() as u32)
    }

    /// Returns the pixel at a position in points.
    pub(crate) fn pixel(&self, at: Pos2) -> [u32; 2] {
        [at.x, at.y].map(|points| (points * self.pixels_per_point) as u32)
    }
}

fn screen_of(size: [u32; 2], scale: f32) -> Rect {
    Rect::from_min_size(Pos2::ZERO, size.map(|pixels| pixels as f32 / scale).into())
}
