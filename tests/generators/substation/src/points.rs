//! Point list: the values that the station's devices report, as of a control centre, with their
//! course in normal operation.

mod bays;
mod loads;
mod measured;
mod monitoring;
mod point_list;
mod states;

use std::fmt::Write;

pub(crate) use loads::{Load, MAIN_TRANSFORMERS, bay_loads};
pub(crate) use monitoring::{SF6_ALARM, SF6_FILLING, SF6_LOCK_OUT};
pub use point_list::{Gateway, NormalValue, Point, PointKind};
pub(crate) use states::EARTHED;

use point_list::PointListBuilder;

/// Generates the whole point list.
pub fn points() -> Vec<Point> {
    let mut list = PointListBuilder { points: Vec::new(), read_by: (Gateway::Station, 1) };
    bays::add_all(&mut list);
    list.points
}

/// Formats the list as CSV.
pub fn csv(points: &[Point]) -> String {
    let mut csv = "id,equipment,name,type,unit,low,high,scan_millis\n".to_owned();
    for p in points {
        // Writing to a string does not fail.
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{},{}",
            p.id,
            p.equipment,
            p.name,
            p.kind.word(),
            p.unit,
            p.low,
            p.high,
            p.scan_millis
        );
    }
    csv
}
