//! Parallel coordinates: records on axes, brushes over them, and what that looks like in
//! space.
//!
//! [`Description`] and [`Records`] are what a plugin gives, checked. A [`ParallelCoordinates`] is one
//! chart as an operator has arranged it: order of axes, layout, brushes, playhead. It does
//! what an [`Action`] says, tells which records are brushed, and gives a [`Shape`]: strokes,
//! faces and texts in metres, for whoever draws.
//!
//! Invariant: no I/O, no clock, no drawing; the same actions give the same shape.
#![doc = include_str!("../DESIGN.md")]

mod action;
mod axis;
mod brush;
mod cluster;
mod density;
mod description;
mod explanation;
mod export;
mod layout;
mod nearest;
mod parallel_coordinates;
mod records;
mod shape;

pub use action::Action;
pub use axis::{AxisView, Tick, short};
pub use brush::{Brush, BrushOperator, Brushes, MAX_BRUSHES, MAX_RANGES};
pub use density::{BINS, DensityRequest, MISSING_BIN, bin_edges, bin_index, bin_pairs};
pub use description::{Axis, Band, ChartError, Description, MAX_AXES, State};
pub use explanation::{Diagram, DiagramZone, Evidence, Explanation, Table, TableRow};
pub use layout::{Layout, Size};
pub use nearest::nearest;
pub use parallel_coordinates::{ChartSelection, MAX_STROKED_RECORDS, ParallelCoordinates};
pub use records::{MAX_RECORDS, Record, Records};
pub use shape::{Face, NO_RECORD, Shape, Stroke, Text, TextKind, date};
