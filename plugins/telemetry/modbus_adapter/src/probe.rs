//! The protocol's values without a device: for fuzzing.

use std::time::SystemTime;

use busbar_plugin_sdk::{Error, Reason, Sample, Simulation, TagSpec};

use crate::address;
use crate::connection::Reply;
use crate::late::LateAnswers;
use crate::plan::{Block, plan};
use crate::session::samples;
use crate::settings::Settings;
use crate::simulator::{Bank, bank};

/// A request for cells of one table of one unit.
#[derive(Debug)]
pub struct Request(Block);

/// Cells that a device gave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Cells of holding or input registers.
    Registers(Vec<u16>),
    /// Cells of coils or discrete inputs.
    Bits(Vec<bool>),
}

impl Request {
    /// Reports whether the cells are single bits.
    pub fn is_bits(&self) -> bool {
        self.0.table.is_bits()
    }

    /// Returns the address of the first cell.
    pub fn first(&self) -> u16 {
        self.0.first
    }

    /// Returns the count of cells.
    pub fn count(&self) -> u16 {
        self.0.count
    }

    /// Returns the request that is made instead while answers to `unanswered` may still come.
    pub fn unmistakable(&self, unanswered: &[Self]) -> Self {
        let mut late = LateAnswers::default();
        unanswered.iter().for_each(|request| late.note_request(&request.0));
        Self(late.unmistakable(&self.0))
    }
}

/// Polls all tags once; a block that `answer` refuses is split and requested in halves.
///
/// # Errors
/// Faults of the settings and addresses.
pub fn poll(
    settings: Settings,
    tags: &[TagSpec],
    mut answer: impl FnMut(&Request) -> Option<Cells>,
) -> Result<Vec<Sample>, Error> {
    let config = settings.parse()?;
    let points = address::parse(tags, &config)?;
    let groups = 0..config.group_periods.len();
    let mut blocks: Vec<_> = groups.flat_map(|group| plan(&points, group)).collect();
    let mut taken = Vec::new();
    while let Some(block) = blocks.pop() {
        let request = Request(block);
        let cells = answer(&request);
        let Request(block) = request;
        match (cells, block.split(&points)) {
            (Some(Cells::Registers(registers)), _) => {
                taken.extend(samples(&points, &block, &Reply::Registers(registers)));
            }
            (Some(Cells::Bits(bits)), _) => {
                taken.extend(samples(&points, &block, &Reply::Bits(bits)));
            }
            (None, Some((left, right))) => blocks.extend([left, right]),
            (None, None) => {
                let bad = |&index: &usize| Sample::bad(points[index].tag, Reason::Configuration);
                taken.extend(block.points.iter().map(bad));
            }
        }
    }
    Ok(taken)
}

/// Simulated device that answers reads.
pub struct Device(Bank);

impl Device {
    /// Creates a device with the tags of a simulation.
    ///
    /// # Errors
    /// Faults of the settings, addresses and signals.
    pub fn new(settings: Settings, simulation: &Simulation) -> Result<Self, Error> {
        bank(&settings.parse()?, simulation).map(|(bank, _)| Self(bank))
    }

    /// Returns the cells that the device answers at an instant; `None` for an exception.
    pub fn read(&self, request: &Request, time: SystemTime) -> Option<Cells> {
        let Request(Block { unit, table, first, count, .. }) = request;
        let cells = self.0.read(*unit, *table, *first, *count, time).ok()?;
        Some(if request.is_bits() {
            Cells::Bits(cells.into_iter().map(|cell| cell != 0).collect())
        } else {
            Cells::Registers(cells)
        })
    }
}

/// Marks the transaction numbers of a TCP stream that comes in pieces of this many bytes,
/// or takes the mark off.
pub fn mark(bytes: &mut [u8], key: u16, piece: usize) {
    crate::marked::mark(bytes.chunks_mut(piece.max(1)), key);
}
