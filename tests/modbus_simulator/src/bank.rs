//! Registers and bits with the points in them, and what clients wrote.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use tokio_modbus::ExceptionCode;

use crate::model::{Bay, Quantity};
use crate::points::{Point, Source};

/// Writing this bit releases all pinned points; it reads as whether any is.
pub(crate) const RELEASE_BIT: u16 = 9999;
/// Registers of one request (Modbus Application Protocol V1.1b3, 6.3).
const MAX_REGISTERS: usize = 125;
/// Bits of one request (6.1).
const MAX_BITS: usize = 2000;

/// One space of registers and one of bits, as many devices have: holding and
/// input registers are the same, and so are coils and discrete inputs.
#[derive(Debug)]
pub(crate) struct Bank {
    points: Vec<Point>,
    pinned: Vec<bool>,
    registers: BTreeMap<u16, Cell>,
    bits: BTreeMap<u16, Cell>,
    bay: Bay,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    value: u16,
    point: usize,
}

impl Bank {
    /// Lays out the points.
    pub(crate) fn new(points: Vec<Point>, seed: u64) -> Result<Self> {
        let mut bank = Self {
            pinned: vec![false; points.len()],
            registers: BTreeMap::new(),
            bits: BTreeMap::new(),
            bay: Bay::new(seed),
            points: Vec::new(),
        };
        for (index, point) in points.iter().enumerate() {
            let (first, count) = point.place.cells();
            for cell in (first..=u16::MAX).take(count) {
                let is_bits = point.place.is_bits();
                let table = if is_bits { &mut bank.bits } else { &mut bank.registers };
                let taken = table.insert(cell, Cell { value: 0, point: index });
                ensure!(
                    taken.is_none() && !(is_bits && cell == RELEASE_BIT),
                    "point '{}': cell {cell} is taken: move one of the points",
                    point.name
                );
            }
        }
        bank.points = points;
        bank.refresh();
        Ok(bank)
    }

    /// Goes on by one step of the model; pinned points stay.
    pub(crate) fn step(&mut self) {
        let closed = self.breaker_closed();
        self.bay.step(closed);
        self.refresh();
    }

    fn refresh(&mut self) {
        for (index, point) in self.points.iter().enumerate() {
            if self.pinned[index] {
                continue;
            }
            let value = match point.source {
                Source::Model(quantity) => self.bay.read(quantity),
                Source::Constant(value) => value,
                Source::Sine { mean, amplitude, period_seconds } => {
                    let turns = self.bay.seconds() / period_seconds;
                    mean + amplitude * (std::f64::consts::TAU * turns).sin()
                }
            };
            let table = if point.place.is_bits() { &mut self.bits } else { &mut self.registers };
            let (first, _) = point.place.cells();
            for (cell, value) in (first..=u16::MAX).zip(point.place.encode(value)) {
                table.insert(cell, Cell { value, point: index });
            }
        }
    }

    /// As the bits say, where a client pinned them: open it, and the load goes.
    fn breaker_closed(&self) -> bool {
        let breaker = self.points.iter().enumerate().find(|(_, point)| {
            point.place.is_bits()
                && matches!(point.source, Source::Model(Quantity::BreakerPosition))
        });
        let Some((index, point)) = breaker.filter(|(index, _)| self.pinned[*index]) else {
            return true;
        };
        let (first, count) = point.place.cells();
        let last = u16::try_from(usize::from(first) + count - 1).ok();
        let closed = last.and_then(|cell| self.bits.get(&cell));
        closed.is_some_and(|cell| cell.point == index && cell.value != 0)
    }

    pub(crate) fn read_registers(&self, first: u16, count: u16) -> Result<Vec<u16>, ExceptionCode> {
        read(&self.registers, first, count.into(), MAX_REGISTERS)
    }

    pub(crate) fn read_bits(&self, first: u16, count: u16) -> Result<Vec<bool>, ExceptionCode> {
        if (first, count) == (RELEASE_BIT, 1) {
            return Ok(vec![self.pinned.contains(&true)]);
        }
        let cells = read(&self.bits, first, count.into(), MAX_BITS)?;
        Ok(cells.into_iter().map(|value| value != 0).collect())
    }

    pub(crate) fn write_registers(
        &mut self,
        first: u16,
        values: &[u16],
    ) -> Result<(), ExceptionCode> {
        write(&mut self.registers, &mut self.pinned, first, values)
    }

    pub(crate) fn write_bits(&mut self, first: u16, values: &[bool]) -> Result<(), ExceptionCode> {
        if first == RELEASE_BIT && values.len() == 1 {
            self.pinned.fill(false);
            self.refresh();
            return Ok(());
        }
        let values: Vec<_> = values.iter().map(|&bit| u16::from(bit)).collect();
        write(&mut self.bits, &mut self.pinned, first, &values)
    }
}

fn read(
    table: &BTreeMap<u16, Cell>,
    first: u16,
    count: usize,
    most: usize,
) -> Result<Vec<u16>, ExceptionCode> {
    if count == 0 || count > most {
        return Err(ExceptionCode::IllegalDataValue);
    }
    let cells = table.range(first..).map(|(&cell, content)| (cell, content));
    let values: Vec<_> = (first..=u16::MAX)
        .take(count)
        .zip(cells)
        .take_while(|(wanted, (cell, _))| wanted == cell)
        .map(|(_, (_, content))| content.value)
        .collect();
    if values.len() < count {
        return Err(ExceptionCode::IllegalDataAddress);
    }
    Ok(values)
}

/// All or nothing; the points written to stay as they are from now on.
fn write(
    table: &mut BTreeMap<u16, Cell>,
    pinned: &mut [bool],
    first: u16,
    values: &[u16],
) -> Result<(), ExceptionCode> {
    read(table, first, values.len(), MAX_BITS)?;
    for (cell, &value) in (first..=u16::MAX).zip(values) {
        if let Some(content) = table.get_mut(&cell) {
            content.value = value;
            pinned[content.point] = true;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{DEMO, parse};

    fn demo() -> Bank {
        Bank::new(parse(DEMO).unwrap(), 1).unwrap()
    }

    #[test]
    fn only_cells_of_points_can_be_read() {
        let bank = demo();
        assert_eq!(bank.read_registers(0, 20).unwrap().len(), 20);
        assert_eq!(bank.read_bits(0, 7).unwrap().len(), 7);
        let illegal = ExceptionCode::IllegalDataAddress;
        assert_eq!(bank.read_registers(0, 21), Err(illegal));
        assert_eq!(bank.read_registers(50, 1), Err(illegal));
        assert_eq!(bank.read_registers(65535, 2), Err(illegal));
        assert_eq!(bank.read_bits(7, 1), Err(illegal));
        let value = ExceptionCode::IllegalDataValue;
        assert_eq!(bank.read_registers(0, 0), Err(value));
        assert_eq!(bank.read_registers(0, 126), Err(value));
    }

    #[test]
    fn a_written_point_is_pinned_until_released() {
        let mut bank = demo();
        bank.write_registers(0, &[0x4366]).unwrap();
        bank.write_registers(100, &[0xFF9C]).unwrap();
        let before = bank.read_registers(0, 2).unwrap();
        for _ in 0..50 {
            bank.step();
        }
        assert_eq!(bank.read_registers(0, 2).unwrap(), before, "both halves");
        assert_eq!(bank.read_registers(100, 1).unwrap(), [0xFF9C]);
        assert_eq!(bank.read_bits(RELEASE_BIT, 1).unwrap(), [true]);
        bank.write_bits(RELEASE_BIT, &[true]).unwrap();
        assert_ne!(bank.read_registers(100, 1).unwrap(), [0xFF9C]);
        assert_eq!(bank.read_bits(RELEASE_BIT, 1).unwrap(), [false]);
    }

    #[test]
    fn a_write_beyond_the_points_changes_nothing() {
        let mut bank = demo();
        let before = bank.read_registers(107, 1).unwrap();
        let result = bank.write_registers(107, &[1, 2]);
        assert_eq!(result, Err(ExceptionCode::IllegalDataAddress));
        assert_eq!(bank.read_registers(107, 1).unwrap(), before);
    }

    #[test]
    fn opening_the_breaker_takes_the_load_away() {
        let mut bank = demo();
        assert_eq!(bank.read_bits(0, 2).unwrap(), [false, true]);
        bank.write_bits(0, &[true, false]).unwrap();
        bank.step();
        assert_eq!(bank.read_registers(6, 6).unwrap(), [0; 6], "currents");
        bank.write_bits(RELEASE_BIT, &[true]).unwrap();
        bank.step();
        assert_ne!(bank.read_registers(6, 6).unwrap(), [0; 6]);
        assert_eq!(bank.read_bits(0, 2).unwrap(), [false, true]);
    }

    #[test]
    fn points_may_not_overlap() {
        let json = r#"{"points": [
            {"name": "a", "register": 0, "type": "f32", "source": {"constant": 1}},
            {"name": "b", "register": 1, "type": "u16", "source": {"constant": 1}}]}"#;
        let error = Bank::new(parse(json).unwrap(), 1).unwrap_err().to_string();
        assert!(error.contains("'b': cell 1 is taken"), "{error}");
    }
}
