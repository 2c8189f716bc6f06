//! What a chart looks like in its own space: x to the right, y up, z towards who looks,
//! metres.

mod axes;
mod lines;

pub use axes::date;

use crate::{Layout, ParallelCoordinates};

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// From where.
    pub from: [f32; 3],
    /// To where.
    pub to: [f32; 3],
    /// How wide, points.
    pub width: f32,
    /// sRGB.
    pub color: [u8; 3],
    /// How much it covers, 0 to 1.
    pub cover: f32,
    /// What it looks like besides its colour.
    pub pattern: crate::Pattern,
    /// The record whose line it is part of; [`NO_RECORD`] for none.
    pub record: u32,
}

/// No record's.
pub const NO_RECORD: u32 = u32::MAX;

/// A surface with four corners, one after the other around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// The corners.
    pub corners: [[f32; 3]; 4],
    /// sRGB.
    pub color: [u8; 3],
    /// How much it covers, 0 to 1.
    pub cover: f32,
}

/// Words at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// Where.
    pub at: [f32; 3],
    /// What.
    pub text: String,
    /// Why.
    pub kind: TextKind,
}

/// Why there are words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextKind {
    /// The name of an axis, over its head.
    Axis,
    /// A value of an axis, on the left of it.
    Tick,
    /// A limit of an axis, on the right of it.
    Limit,
    /// Under the foot of an axis: the lane of records without a value.
    Missing,
    /// A time, beside the chart.
    Time,
}

/// All that is drawn, what lies behind first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Behind all strokes.
    pub faces: Vec<Face>,
    /// Lines.
    pub strokes: Vec<Stroke>,
    /// Words.
    pub texts: Vec<Text>,
    /// Foot and head of each axis shown.
    pub axes: Vec<[[f32; 3]; 2]>,
}

/// Where records without a value are, by position: below the feet of axes.
pub(crate) const MISSING_LANE: f32 = -8.5 / crate::BINS as f32;
/// Below this a brush takes them in.
pub(crate) const MISSING_EDGE: f32 = MISSING_LANE / 2.0;

pub(crate) const INK: [u8; 3] = [40, 42, 46];
pub(crate) const GREY: [u8; 3] = [96, 100, 106];
pub(crate) const PAPER: [u8; 3] = [244, 245, 246];
pub(crate) const SELECTION: [u8; 3] = [30, 90, 170];

/// Builds it, `now` in nanoseconds since 1970-01-01 UTC.
pub(crate) fn build(board: &ParallelCoordinates, now: i64) -> Shape {
    let mut shape = Shape::default();
    axes::add(board, &mut shape);
    lines::add(board, now, &mut shape);
    shape
}

/// How far in the depth the picture of a density stands, metres: that of the instant shown
/// where time goes into the depth, and just behind the lines elsewhere.
pub(crate) fn density_depth(board: &ParallelCoordinates) -> f32 {
    const BEHIND: f32 = 0.01;
    match (board.layout, board.records.span()) {
        (Layout::Time, Some(span)) => {
            axes::depth_of(board.playhead.unwrap_or(span[1]), span, board.size.depth)
        }
        _ => -BEHIND,
    }
}
