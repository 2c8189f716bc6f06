//! All cells of a simulated device, worked out when they are read.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

use busbar_plugin_sdk::simulation::{Behavior, Signal, SignalShape};
use busbar_plugin_sdk::{Error, Value, ValueKind};
use tokio_modbus::ExceptionCode;

use super::encode::encode;
use crate::address::{Decoding, Point, Table};
use crate::plan::{MAX_BITS, MAX_REGISTERS};

/// Tags that one message names.
const MAX_TAGS_IN_MESSAGE: usize = 5;

/// The cells of a device by unit and table.
#[derive(Debug)]
pub(crate) struct Bank {
    spaces: BTreeMap<(u8, Table), Space>,
}

/// One table of a unit. Cells between points are there and 0, those beyond are not.
#[derive(Debug)]
struct Space {
    /// In order of the first cell; no two have a bit in common.
    points: Vec<(Point, Signal)>,
    first: u32,
    end: u32,
}

impl Bank {
    /// Lays out points, and remarks on those whose cells are another's already.
    ///
    /// # Errors
    /// [`Error::settings`] with every point that cannot hold its signal's values.
    pub(super) fn new(points: Vec<(Point, Signal)>) -> Result<(Self, Option<String>), Error> {
        let faults: Vec<_> = points.iter().filter_map(|(p, signal)| misfit(p, signal)).collect();
        if !faults.is_empty() {
            return Err(Error::settings(faults.join("; ")));
        }
        let mut taken: BTreeMap<(u8, Table, u32), u16> = BTreeMap::new();
        let mut shared = Vec::new();
        let mut bank = Self { spaces: BTreeMap::new() };
        for (point, signal) in points {
            let (cells, bits) = (u32::from(point.first)..point.end(), bits_of(&point.decoding));
            let mut masks: Vec<_> =
                cells.map(|cell| ((point.unit, point.table, cell), bits)).collect();
            let space = bank.spaces.entry((point.unit, point.table)).or_insert_with(Space::new);
            // Those that share cells are read too.
            space.widen(&point);
            if masks.iter().any(|(cell, bits)| taken.get(cell).is_some_and(|t| t & bits != 0)) {
                shared.push(point.id);
                continue;
            }
            masks.drain(..).for_each(|(cell, bits)| *taken.entry(cell).or_default() |= bits);
            space.points.push((point, signal));
        }
        for space in bank.spaces.values_mut() {
            space.points.sort_by_key(|(point, _)| point.first);
        }
        Ok((bank, remark(&shared)))
    }

    /// Cells at an instant; bits as 0 and 1.
    ///
    /// # Errors
    /// [`ExceptionCode`] for cells or units that the device does not have.
    pub(crate) fn read(
        &self,
        unit: u8,
        table: Table,
        first: u16,
        count: u16,
        now: SystemTime,
    ) -> Result<Vec<u16>, ExceptionCode> {
        let most = if table.is_bits() { MAX_BITS } else { MAX_REGISTERS };
        if !(1..=most).contains(&count) {
            return Err(ExceptionCode::IllegalDataValue);
        }
        let Some(space) = self.spaces.get(&(unit, table)) else {
            let knows_unit = self.spaces.keys().any(|(known, _)| *known == unit);
            return Err(match knows_unit {
                true => ExceptionCode::IllegalDataAddress,
                false => ExceptionCode::GatewayTargetDevice,
            });
        };
        let (first, end) = (u32::from(first), u32::from(first) + u32::from(count));
        if first < space.first || end > space.end {
            return Err(ExceptionCode::IllegalDataAddress);
        }
        let mut cells = vec![0; usize::from(count)];
        for (point, signal) in space.of_cells(first, end) {
            let Some(values) = encode(&point.decoding, &signal.at(now)) else { continue };
            for (cell, value) in (u32::from(point.first)..point.end()).zip(values) {
                let index = cell.checked_sub(first).and_then(|index| usize::try_from(index).ok());
                if let Some(place) = index.and_then(|index| cells.get_mut(index)) {
                    *place |= value;
                }
            }
        }
        Ok(cells)
    }
}

impl Space {
    fn new() -> Self {
        Self { points: Vec::new(), first: u32::MAX, end: 0 }
    }

    /// Has the cells of a point.
    fn widen(&mut self, point: &Point) {
        self.first = self.first.min(point.first.into());
        self.end = self.end.max(point.end());
    }

    /// Returns the points with a cell from `first` to before `end`.
    fn of_cells(&self, first: u32, end: u32) -> impl Iterator<Item = &(Point, Signal)> {
        // One request reads every point.
        let reach = u32::from(MAX_REGISTERS);
        let begin = self.points.partition_point(|(p, _)| u32::from(p.first) + reach <= first);
        let points = self.points.get(begin..).unwrap_or_default().iter();
        let points = points.take_while(move |(point, _)| u32::from(point.first) < end);
        points.filter(move |(point, _)| point.end() > first)
    }
}

/// Returns an error text where a point cannot hold all values of its signal.
fn misfit(point: &Point, signal: &Signal) -> Option<String> {
    let (low, high) = signal.range();
    let value = |number: f64| match signal.kind() {
        ValueKind::F64 => Some(Value::F64(number)),
        ValueKind::I64 => Some(Value::I64(number as i64)),
        ValueKind::Text => text_at(number),
        // Their bits always fit.
        ValueKind::Bool | ValueKind::DoublePoint => Some(signal.at(SystemTime::UNIX_EPOCH)),
    };
    let fits = |&end: &f64| value(end).and_then(|value| encode(&point.decoding, &value)).is_some();
    let fields = if signal.kind() == ValueKind::Text { "length" } else { "type and scale" };
    (![low, high].iter().all(fits)).then(|| {
        format!(
            "tag '{}': its simulated values from {low} to {high} do not fit its {fields}: \
             change that, or give the tag a \"simulate\" with another base and amplitude",
            point.id
        )
    })
}

/// Returns the text of a simulated tag whose signal has this number: the longest texts of a signal
/// lie at the ends of its range.
fn text_at(number: f64) -> Option<Value> {
    let behavior =
        Behavior::new(SignalShape::Constant, number, 0.0, Duration::from_secs(1)).ok()?;
    let signal = Signal::new(0, "", ValueKind::Text, behavior).ok()?;
    Some(signal.at(SystemTime::UNIX_EPOCH))
}

/// Returns the mask of the bits that a point occupies in each of its cells.
fn bits_of(decoding: &Decoding) -> u16 {
    match decoding {
        Decoding::Number { .. } | Decoding::Integer { .. } | Decoding::Text { .. } => u16::MAX,
        Decoding::RegisterBit(bit) => 1 << bit,
        Decoding::RegisterBitPair(first) => 0b11 << first,
        Decoding::Bit | Decoding::BitPair => 1,
    }
}

fn remark(shared: &[String]) -> Option<String> {
    let named: Vec<_> = shared.iter().take(MAX_TAGS_IN_MESSAGE).map(String::as_str).collect();
    (!shared.is_empty()).then(|| {
        format!(
            "{} tags lie where another tag lies and show what that one makes of the cells: {}{}",
            shared.len(),
            named.join(", "),
            if shared.len() > named.len() { ", ..." } else { "" }
        )
    })
}

#[cfg(test)]
#[path = "bank_tests.rs"]
mod tests;
