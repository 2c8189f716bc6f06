//! A recording in memory, read from end to end: for fuzzing, and for tests of what
//! may be in a file.

use std::io::Cursor;
use std::path::PathBuf;

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, Sample, SampleFlags, TagSpec};

use crate::address::Points;
use crate::comtrade::{Cff, Cfg};
use crate::oscillogram::{Oscillogram, Parts};
use crate::player::{Player, Progress};
use crate::recording::Recording;
use crate::remarks::Remarks;
use crate::settings::{Config, Format, Settings};
use crate::table::Table;

/// Bytes of a recording.
pub enum Bytes {
    /// A configuration and its data.
    Comtrade(Vec<u8>, Vec<u8>),
    /// A single file of 2013.
    Cff(Vec<u8>),
    /// Bytes of a table.
    Csv(Vec<u8>),
}

/// Plays a recording as fast as possible, and hands every batch of samples to `take`.
/// Times are those of the recording from its start, in source times from 1970 on.
///
/// # Errors
/// What the plugin would say.
pub fn play(
    settings: Settings,
    tags: &[TagSpec],
    bytes: Bytes,
    mut take: impl FnMut(&[Sample]),
) -> Result<(), Error> {
    let mut config = settings.parse()?;
    config.format = if matches!(bytes, Bytes::Csv(_)) { Format::Csv } else { Format::Comtrade };
    let points = Points::parse(tags, &config)?;
    let mut remarks = Remarks::new(host(), String::new());
    let recording = open(&config, &points, bytes, &mut remarks)?;
    let is_discrete = points.0.iter().map(|point| point.is_discrete()).collect();
    let interval = config.max_updates_per_second.map(|most| (1e9 / most) as i64);
    let failed = |fault: crate::recording::Fault| Error::failed(fault.to_string());
    let player = Player::new(recording, is_discrete, interval, 0, i64::MAX);
    let (mut player, mut batch) = (player.map_err(failed)?, Vec::new());
    loop {
        let progress = player.advance(i64::MAX, &mut batch, &mut remarks).map_err(failed)?;
        let samples: Vec<_> = batch
            .drain(..)
            .map(|update| Sample {
                tag: points.0[update.point].tag,
                value: update.value,
                quality: update.quality,
                source_time: crate::instant::system_time(update.nanos),
                flags: SampleFlags::LIVE,
            })
            .collect();
        take(&samples);
        if let Progress::Ended(_) = progress {
            return Ok(());
        }
    }
}

fn open(
    config: &Config,
    points: &Points,
    bytes: Bytes,
    remarks: &mut Remarks,
) -> Result<Box<dyn Recording>, Error> {
    let failed = |fault: &dyn std::fmt::Display| Error::failed(fault.to_string());
    let path = PathBuf::new();
    let (cfg, parts) = match bytes {
        Bytes::Csv(bytes) => {
            let table = Table::new(config, Cursor::new(bytes), points, remarks);
            return Ok(Box::new(table.map_err(|fault| failed(&fault))?));
        }
        Bytes::Comtrade(cfg, data) => {
            let file = Cursor::new(data);
            (cfg, Parts { path, file, offset: 0, line: 1, bytes: None })
        }
        Bytes::Cff(bytes) => {
            let Cff { cfg, data_offset, data_line, data_bytes } =
                Cff::find(Cursor::new(&bytes)).map_err(|fault| failed(&fault))?;
            let file = Cursor::new(bytes);
            (cfg, Parts { path, file, offset: data_offset, line: data_line, bytes: data_bytes })
        }
    };
    let cfg = Cfg::parse_encoded(&cfg, config.encoding).map_err(|fault| failed(&fault))?;
    let oscillogram = Oscillogram::new(config, cfg, parts, points, remarks);
    Ok(Box::new(oscillogram.map_err(|fault| failed(&fault))?))
}
