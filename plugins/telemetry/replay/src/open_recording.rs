//! Choice of the reader of a recording by its format.

use crate::address::Points;
use crate::oscillogram::Oscillogram;
use crate::recording::{Fault, Recording};
use crate::remarks::Remarks;
use crate::settings::{Config, Format};
use crate::table::Table;

/// Opens the recording that the settings name, and finds the channels of the tags.
///
/// # Errors
/// What is wrong with the file, its configuration, or the addresses.
pub(crate) fn open_recording(
    config: &Config,
    points: &Points,
    remarks: &mut Remarks,
) -> Result<Box<dyn Recording>, Fault> {
    Ok(match config.format {
        Format::Comtrade => Box::new(Oscillogram::open(config, points, remarks)?),
        Format::Csv => Box::new(Table::open(config, points, remarks)?),
    })
}
