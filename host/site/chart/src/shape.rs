//! Geometry of a chart in its own space: x to the right, y up, z towards the viewer, metres.

mod axes;
mod lines;

pub use axes::date;

use busbar_types::Pattern;

use crate::ParallelCoordinates;

/// Line segment of the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Position of the start, metres.
    pub from: [f32; 3],
    /// Position of the end, metres.
    pub to: [f32; 3],
    /// Width of the line, points.
    pub width: f32,
    /// Color of the line in sRGB.
    pub color: [u8; 3],
    /// Opacity, 0 to 1.
    pub cover: f32,
    /// Pattern of the line, besides its color.
    pub pattern: Pattern,
    /// The record whose line it is part of; [`NO_RECORD`] for none.
    pub record: u32,
}

/// Marks geometry that belongs to no record.
pub const NO_RECORD: u32 = u32::MAX;

/// A surface with four corners, one after the other around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Corners in order around the face, metres.
    pub corners: [[f32; 3]; 4],
    /// Color of the face in sRGB.
    pub color: [u8; 3],
    /// Opacity, 0 to 1.
    pub cover: f32,
}

/// Words at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// Position of the text, metres.
    pub at: [f32; 3],
    /// Text of the label.
    pub text: String,
    /// Kind of the text.
    pub kind: TextKind,
}

/// Kinds of labels in a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextKind {
    /// The name of an axis, over its head.
    Axis,
    /// A value of an axis, on the left of it.
    Tick,
    /// A limit of an axis, on the right of it.
    Limit,
    /// Label of the lane of records without a value, under the foot of an axis.
    Missing,
    /// A time, beside the chart.
    Time,
}

/// Geometry of a chart, in the order of drawing, the farthest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Faces, drawn behind all strokes.
    pub faces: Vec<Face>,
    /// Strokes of lines and axes.
    pub strokes: Vec<Stroke>,
    /// Labels of the chart.
    pub texts: Vec<Text>,
    /// Foot and head of each axis shown.
    pub axes: Vec<[[f32; 3]; 2]>,
}

pub(crate) const INK: [u8; 3] = [40, 42, 46];
pub(crate) const GREY: [u8; 3] = [96, 100, 106];
pub(crate) const PAPER: [u8; 3] = [244, 245, 246];
pub(crate) const SELECTION: [u8; 3] = [30, 90, 170];

impl ParallelCoordinates {
    /// Builds the geometry of the chart, `now` in nanoseconds since 1970-01-01 UTC.
    pub fn shape(&self, now: i64) -> Shape {
        let mut shape = Shape::default();
        axes::add(self, &mut shape);
        lines::add(self, now, &mut shape);
        shape
    }
}
