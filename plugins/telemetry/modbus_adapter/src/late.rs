//! Late answers of a serial line, which must not be mistaken for the answer to a later request.
//!
//! Modbus RTU has no transaction numbers: an answer that comes too late looks like
//! that to a later request of the same function and length, whatever cells that one
//! asked for. What is relied on here is that a device answers its requests in order.
//! So an answer of another length, that is, to a request which could not be mixed up
//! with those before, shows that nothing older is to come.

use std::collections::{BTreeMap, VecDeque};

use crate::address::Table;
use crate::plan::{Block, MAX_BITS, MAX_REGISTERS};

/// Most unanswered requests of a unit that are remembered. A device that left so many unanswered
/// has long lost the first.
const MAX_OPEN: usize = 8;

/// Shape by which answers are distinguished: function and number of data bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    table: Table,
    pub(crate) bytes: u16,
}

impl Shape {
    pub(crate) fn from_block(block: &Block) -> Self {
        let count = block.count;
        let bytes = if block.table.is_bits() { count.div_ceil(8) } else { 2 * count };
        Self { table: block.table, bytes }
    }
}

/// Requests that were not answered, by unit, the oldest first.
#[derive(Debug, Default)]
pub(crate) struct LateAnswers(BTreeMap<u8, VecDeque<Shape>>);

impl LateAnswers {
    /// Returns the block to request: itself, or one with another count of cells while a late answer
    /// could have its shape.
    pub(crate) fn unmistakable(&self, block: &Block) -> Block {
        let Some(open) = self.0.get(&block.unit) else { return block.clone() };
        let is_free = |block: &Block| !open.contains(&Shape::from_block(block));
        if is_free(block) {
            return block.clone();
        }
        // One more try than shapes are open, so that one of them is free.
        let mut others = (1..=MAX_OPEN as u16 + 1).map(|step| of_other_length(block, step));
        others.find(is_free).unwrap_or_else(|| block.clone())
    }

    /// Notes a request that goes out.
    pub(crate) fn note_request(&mut self, block: &Block) {
        let open = self.0.entry(block.unit).or_default();
        if open.len() == MAX_OPEN {
            open.pop_front();
        }
        open.push_back(Shape::from_block(block));
    }

    /// Notes the answer to a block, after which no older one is to come.
    pub(crate) fn note_answer(&mut self, block: &Block) {
        let shape = Shape::from_block(block);
        self.close(block.unit, |open| *open == shape);
    }

    /// Notes an exception as that of the oldest request of its table, since it names its
    /// function alone.
    pub(crate) fn note_exception(&mut self, block: &Block) {
        self.close(block.unit, |open| open.table == block.table);
    }

    /// Forgets the requests up to the first that fits.
    fn close(&mut self, unit: u8, fits: impl FnMut(&Shape) -> bool) {
        let Some(open) = self.0.get_mut(&unit) else { return };
        let answered = open.iter().position(fits);
        open.drain(..answered.map_or(0, |index| index + 1));
        if open.is_empty() {
            self.0.remove(&unit);
        }
    }
}

/// Returns a block around the cells whose answer is `step` units shorter, or longer where there are
/// too few cells.
fn of_other_length(block: &Block, step: u16) -> Block {
    let (unit, max) = if block.table.is_bits() { (8, MAX_BITS) } else { (1, MAX_REGISTERS) };
    let mut other = block.clone();
    other.count = match block.count.checked_sub(step * unit) {
        Some(count @ 1..) => count,
        // Blocks that are too short for fewer are short enough for more.
        _ => (block.count + step * unit).min(max),
    };
    let beyond = (u32::from(other.first) + u32::from(other.count)).saturating_sub(1 << 16);
    other.first -= beyond as u16;
    other
}

#[cfg(test)]
#[path = "late_tests.rs"]
mod tests;
