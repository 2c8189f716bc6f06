//! Points -> requests: neighbours are read together.
//!
//! Limits of a request are those of the Modbus Application Protocol
//! Specification V1.1b3, 6.1 to 6.4.

use crate::address::{Point, Table};

/// Registers of one request.
pub(crate) const MAX_REGISTERS: u16 = 125;
/// Bits of one request.
pub(crate) const MAX_BITS: u16 = 2000;
/// Longest gap of unused registers that is read to save a request. Its 32 bytes cost about as much
/// as a request and the head of its answer.
pub(crate) const MAX_GAP_REGISTERS: u16 = 16;
/// The same for bits.
pub(crate) const MAX_GAP_BITS: u16 = 256;

/// One request, and the points that its answer holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Block {
    /// Unit id of the device.
    pub(crate) unit: u8,
    /// Table that is read.
    pub(crate) table: Table,
    /// Address of the first cell.
    pub(crate) first: u16,
    /// Count of cells to read.
    pub(crate) count: u16,
    /// Indices of the points, in order of their first cell; never empty.
    pub(crate) points: Vec<usize>,
}

/// Plans the requests that read all points of a poll group.
pub(crate) fn plan(points: &[Point], group: usize) -> Vec<Block> {
    plan_of(points, (0..points.len()).filter(|&i| points[i].group == group).collect())
}

/// Plans the requests that read some points of one poll group.
pub(crate) fn plan_of(points: &[Point], mut wanted: Vec<usize>) -> Vec<Block> {
    wanted.sort_by_key(|&i| key(&points[i]));
    let mut blocks: Vec<Block> = Vec::new();
    for index in wanted {
        let point = &points[index];
        match blocks.last_mut() {
            Some(block) if block.takes(point) => block.add(index, point),
            _ => blocks.push(Block::new(index, point)),
        }
    }
    blocks
}

fn key(point: &Point) -> (u8, Table, u16, u16) {
    (point.unit, point.table, point.first, point.count)
}

impl Block {
    fn new(index: usize, point: &Point) -> Self {
        Self {
            unit: point.unit,
            table: point.table,
            first: point.first,
            count: point.count,
            points: vec![index],
        }
    }

    fn end(&self) -> u32 {
        u32::from(self.first) + u32::from(self.count)
    }

    fn takes(&self, point: &Point) -> bool {
        let (max_count, max_gap) = if self.table.is_bits() {
            (MAX_BITS, MAX_GAP_BITS)
        } else {
            (MAX_REGISTERS, MAX_GAP_REGISTERS)
        };
        (self.unit, self.table) == (point.unit, point.table)
            && u32::from(point.first) <= self.end() + u32::from(max_gap)
            && point.end() - u32::from(self.first) <= u32::from(max_count)
    }

    /// Adds a point that starts no earlier than those it has.
    fn add(&mut self, index: usize, point: &Point) {
        let end = self.end().max(point.end());
        self.count = (end - u32::from(self.first)) as u16;
        self.points.push(index);
    }

    /// Splits a refused block at its widest gap, or else in the middle; `None` if all points need
    /// the same cells.
    pub(crate) fn split(&self, points: &[Point]) -> Option<(Self, Self)> {
        let at = self.cut(points)?;
        let (left, right) = self.points.split_at(at);
        Some((Self::join(points, left)?, Self::join(points, right)?))
    }

    fn cut(&self, points: &[Point]) -> Option<usize> {
        let mut end = 0;
        let mut best = None;
        let middle = self.points.len() / 2;
        for (at, pair) in (1_usize..).zip(self.points.windows(2)) {
            let (before, after) = (&points[pair[0]], &points[pair[1]]);
            end = before.end().max(end);
            if key(before) == key(after) {
                continue;
            }
            let gap = u32::from(after.first).saturating_sub(end);
            let rank = (gap, std::cmp::Reverse(at.abs_diff(middle)));
            if best.is_none_or(|(best, _)| rank > best) {
                best = Some((rank, at));
            }
        }
        best.map(|(_, at)| at)
    }

    /// Returns the part of this block that holds points of another; `None` where it has none.
    pub(crate) fn within(&self, other: &Self, points: &[Point]) -> Option<Self> {
        let has = |index: &usize| other.points.contains(index);
        let members: Vec<_> = self.points.iter().copied().filter(has).collect();
        Self::join(points, &members)
    }

    fn join(points: &[Point], members: &[usize]) -> Option<Self> {
        let (&first, rest) = members.split_first()?;
        let mut block = Self::new(first, &points[first]);
        for &index in rest {
            block.add(index, &points[index]);
        }
        Some(block)
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
