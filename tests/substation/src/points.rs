//! The point list: what the station's devices report, as a control centre would list it,
//! and how each value stands in normal operation.

mod bays;
mod loads;
mod measured;
mod monitoring;
mod states;

use std::fmt::Write;

pub(crate) use loads::{Load, MAIN_TRANSFORMERS, bay_loads};
pub(crate) use monitoring::{SF6_ALARM, SF6_FILLING, SF6_LOCK_OUT};
pub(crate) use states::EARTHED;

/// What a point carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointKind {
    /// A measured value.
    Analog,
    /// A switch position in two bits.
    Double,
    /// A status or alarm.
    Single,
    /// A command; Busbar shows it and never sends it.
    Control,
    /// A value of condition monitoring.
    Monitoring,
}

impl PointKind {
    fn word(self) -> &'static str {
        match self {
            Self::Analog => "analog",
            Self::Double => "double_point",
            Self::Single => "single_point",
            Self::Control => "control",
            Self::Monitoring => "monitoring",
        }
    }

    /// The logical device that has such points.
    fn logical_device(self) -> &'static str {
        match self {
            Self::Analog => "MEAS",
            Self::Monitoring => "MON",
            Self::Double | Self::Control => "CTRL",
            Self::Single => "PROT",
        }
    }
}

/// The gateway that bays are read through; each bay is a unit behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gateway {
    /// 220 kV yard.
    Yard220,
    /// 110 kV yard.
    Yard110,
    /// Main transformers.
    Transformers,
    /// 35 kV switch house.
    House35,
    /// What the station has as a whole.
    Station,
}

impl Gateway {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Yard220, Self::Yard110, Self::Transformers, Self::House35, Self::Station];

    /// Its name in a configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Yard220 => "yard_220",
            Self::Yard110 => "yard_110",
            Self::Transformers => "transformers",
            Self::House35 => "house_35",
            Self::Station => "station",
        }
    }
}

/// How a value stands in normal operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalValue {
    /// It stays.
    Constant(f64),
    /// It wanders about a value by so much.
    Walk(f64, f64),
    /// It counts on from a value, one in so many seconds.
    Counter(f64, f64),
}

/// One point.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Reference in the style of IEC 61850, unique.
    pub id: String,
    /// The equipment (IEC 81346) that it belongs to.
    pub equipment: String,
    /// What people call it.
    pub name: String,
    /// What it carries.
    pub kind: PointKind,
    /// Unit; empty for states.
    pub unit: &'static str,
    /// Least plausible value.
    pub low: f64,
    /// Greatest plausible value.
    pub high: f64,
    /// Milliseconds between two values at most.
    pub scan_millis: u32,
    /// What it means to its equipment.
    pub role: &'static str,
    /// The band of normal operation, open where it is none.
    pub limits: [Option<f64>; 2],
    /// How it stands in normal operation.
    pub usual: NormalValue,
    /// Through which gateway, and as which unit behind it, it is read.
    pub read_by: (Gateway, u8),
}

/// A quantity: reference, name, unit, least and greatest plausible value, milliseconds.
pub(crate) type Quantity = (&'static str, &'static str, &'static str, f64, f64, u32);

/// A list that grows.
pub(crate) struct List {
    pub(crate) points: Vec<Point>,
    /// That of the points that are added.
    pub(crate) read_by: (Gateway, u8),
}

/// What a point has besides its quantity.
pub(crate) struct Place<'a> {
    /// Such as `=S12D1Q1`.
    pub(crate) bay: &'a str,
    /// Such as `=S12D1Q1-BC1`.
    pub(crate) equipment: String,
    /// Number of the logical node.
    pub(crate) node: usize,
    /// What the point means to the equipment.
    pub(crate) role: &'static str,
}

impl List {
    pub(crate) fn add(
        &mut self,
        kind: PointKind,
        (reference, name, unit, low, high, scan_millis): Quantity,
        place: Place<'_>,
        usual: NormalValue,
    ) -> &mut Point {
        let index = self.points.len();
        let Place { bay, equipment, node, role } = place;
        let (class, data) = reference.split_once('.').unwrap_or((reference, ""));
        let bay = bay.trim_start_matches('=');
        self.points.push(Point {
            id: format!("{bay}{}/{class}{node}.{data}", kind.logical_device()),
            equipment,
            name: if node > 1 { format!("{name} {node}") } else { name.to_owned() },
            kind,
            unit,
            low,
            high,
            scan_millis,
            role,
            limits: [None; 2],
            usual,
            read_by: self.read_by,
        });
        &mut self.points[index]
    }
}

/// The point list.
pub fn points() -> Vec<Point> {
    let mut list = List { points: Vec::new(), read_by: (Gateway::Station, 1) };
    bays::add_all(&mut list);
    list.points
}

/// The list as CSV.
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
