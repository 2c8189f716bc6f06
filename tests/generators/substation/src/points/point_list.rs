//! Points, and the list that they are added to.

/// Kind of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointKind {
    /// Analog value that is measured.
    Analog,
    /// Double point: a switch position in two bits.
    Double,
    /// Single point: a status or alarm.
    Single,
    /// Command; Busbar shows it and never sends it.
    Control,
    /// Value of condition monitoring.
    Monitoring,
}

impl PointKind {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Analog => "analog",
            Self::Double => "double_point",
            Self::Single => "single_point",
            Self::Control => "control",
            Self::Monitoring => "monitoring",
        }
    }

    /// Returns the logical device that has such points.
    fn logical_device(self) -> &'static str {
        match self {
            Self::Analog => "MEAS",
            Self::Monitoring => "MON",
            Self::Double | Self::Control => "CTRL",
            Self::Single => "PROT",
        }
    }
}

/// Gateway through which bays are read; each bay is a unit behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gateway {
    /// Gateway of the 220 kV yard.
    Yard220,
    /// Gateway of the 110 kV yard.
    Yard110,
    /// Gateway of the main transformers.
    Transformers,
    /// Gateway of the 35 kV switch house.
    House35,
    /// Gateway of points of the whole station.
    Station,
}

impl Gateway {
    /// All gateways in order of their ports.
    pub const ALL: [Self; 5] =
        [Self::Yard220, Self::Yard110, Self::Transformers, Self::House35, Self::Station];

    /// Returns the gateway's name in a configuration.
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

/// Course of a value in normal operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalValue {
    /// Constant value without change.
    Constant(f64),
    /// Random walk about a value, with its greatest deviation.
    Walk(f64, f64),
    /// Counter from a start value, with the seconds for each step.
    Counter(f64, f64),
}

/// Point of the list: one value of one device.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Unique reference in the style of IEC 61850.
    pub id: String,
    /// Equipment (IEC 81346) that the point belongs to.
    pub equipment: String,
    /// Name of the point for people.
    pub name: String,
    /// Kind of the point.
    pub kind: PointKind,
    /// Unit; empty for states.
    pub unit: &'static str,
    /// Lower end of the plausible range.
    pub low: f64,
    /// Upper end of the plausible range.
    pub high: f64,
    /// Longest time between two values, milliseconds.
    pub scan_millis: u32,
    /// Role of the point for its equipment.
    pub role: &'static str,
    /// Limits of the band of normal operation; `None` where it is open.
    pub limits: [Option<f64>; 2],
    /// Course in normal operation.
    pub usual: NormalValue,
    /// Gateway, and unit behind it, that the point is read through.
    pub read_by: (Gateway, u8),
}

/// Quantity: reference, name, unit, least and greatest plausible value, scan period in
/// milliseconds.
pub(crate) type Quantity = (&'static str, &'static str, &'static str, f64, f64, u32);

/// Builder of the point list.
pub(crate) struct PointListBuilder {
    pub(crate) points: Vec<Point>,
    /// Gateway and unit of the points added next.
    pub(crate) read_by: (Gateway, u8),
}

/// Place of a point: bay, equipment, node and role.
pub(crate) struct PointContext<'a> {
    /// Designation of the bay, such as `=S12D1Q1`.
    pub(crate) bay: &'a str,
    /// Designation of the equipment, such as `=S12D1Q1-BC1`.
    pub(crate) equipment: String,
    /// Number of the logical node.
    pub(crate) node: usize,
    /// Role of the point for the equipment.
    pub(crate) role: &'static str,
}

impl PointListBuilder {
    pub(crate) fn add(
        &mut self,
        kind: PointKind,
        (reference, name, unit, low, high, scan_millis): Quantity,
        place: PointContext<'_>,
        usual: NormalValue,
    ) -> &mut Point {
        let index = self.points.len();
        let PointContext { bay, equipment, node, role } = place;
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
