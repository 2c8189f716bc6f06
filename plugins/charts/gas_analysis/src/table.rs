//! A table of samples in, a table of results out, row by row.

use std::io;

use busbar_plugin_sdk::{CommandExit, LogLevel, Streams};
use dga::uncertainty::Uncertainty;
use dga::{Gas, Sample};

use crate::columns::Columns;
use crate::history::Book;
use crate::lines::{Line, Lines, MAX_LINE_BYTES};
use crate::report::Report;
use crate::row::{self, Cells};
use crate::settings::Settings;

/// Reads samples and writes their results. A row that is no sample is a diagnostic, and
/// those after it go on; without a header, or without any sample, the input is at fault.
///
/// # Errors
/// I/O errors of the streams.
pub(crate) fn analyse(
    streams: &Streams<'_>,
    settings: &Settings,
    uncertainty: Option<Uncertainty>,
) -> io::Result<CommandExit> {
    let mut lines = Lines::open(streams.input())?;
    let mut cells = Cells::new();
    let columns = match header(&mut lines, &mut cells)? {
        Ok(columns) => columns,
        Err((line, fault)) => {
            streams.diagnose(LogLevel::Error, line, &fault);
            return Ok(CommandExit::InputAtFault);
        }
    };
    if let Some(warning) = &columns.warning {
        streams.diagnose(LogLevel::Warning, Some(lines.number), warning);
    }
    let mut book = match settings.history.then(|| identity(&columns)) {
        None => None,
        Some(Some(places)) => Some((Book::default(), places)),
        Some(None) => {
            let text = "the history of transformers needs columns equipment and time";
            streams.diagnose(LogLevel::Error, Some(lines.number), text);
            return Ok(CommandExit::InputAtFault);
        }
    };
    let mut report = Report::begin(streams.output(), &columns, settings, uncertainty)?;
    let (mut good, mut bad) = (0_u64, 0_u64);
    loop {
        let read = lines.read()?;
        if read == Line::End {
            break;
        }
        if read == Line::Whole && lines.text.trim_ascii().is_empty() {
            continue;
        }
        let sample = sample(read, &lines.text, &columns, &mut cells);
        let placed = sample.and_then(|sample| {
            let trend = book.as_mut().map(|(book, [equipment, time])| {
                book.add(cells.get(*equipment), cells.get(*time), &sample)
            });
            Ok((sample, trend.transpose()?))
        });
        match placed {
            Ok((sample, trend)) => {
                good += 1;
                report.add(&columns, &cells, &sample, trend.as_ref())?;
            }
            Err(fault) => {
                bad += 1;
                streams.diagnose(LogLevel::Error, Some(lines.number), &fault);
            }
        }
    }
    report.end()?;
    if good == 0 {
        let text = match bad {
            0 => "there is no row below the header".to_owned(),
            bad => format!("none of {bad} rows is a sample"),
        };
        streams.diagnose(LogLevel::Error, None, &text);
        return Ok(CommandExit::InputAtFault);
    }
    if bad > 0 {
        let text = format!("{good} samples analysed, {bad} rows left out");
        streams.diagnose(LogLevel::Info, None, &text);
    }
    Ok(CommandExit::Done)
}

/// Returns the columns of equipment and time, if both are there.
pub(crate) fn identity(columns: &Columns) -> Option<[usize; 2]> {
    match columns.identifying.as_slice() {
        [(_, equipment), (_, time)] => Some([*equipment, *time]),
        _ => None,
    }
}

/// The first line that is not empty; or the fault, with its line.
pub(crate) type Header = Result<Columns, (Option<u64>, String)>;

pub(crate) fn header(lines: &mut Lines<impl io::Read>, cells: &mut Cells) -> io::Result<Header> {
    loop {
        let read = lines.read()?;
        let line = Some(lines.number);
        match read {
            Line::End => return Ok(Err((None, "the file is empty".into()))),
            Line::TooLong => return Ok(Err((line, too_long()))),
            Line::Whole if lines.text.trim_ascii().is_empty() => {}
            Line::Whole => {
                let columns = cells.cut(&lines.text).and_then(|()| Columns::from_cells(cells));
                return Ok(columns.map_err(|fault| (line, fault)));
            }
        }
    }
}

fn too_long() -> String {
    format!("the line has more than {MAX_LINE_BYTES} bytes; is this CSV?")
}

/// The sample of a row.
pub(crate) fn sample(
    read: Line,
    line: &[u8],
    columns: &Columns,
    cells: &mut Cells,
) -> Result<Sample, String> {
    if read == Line::TooLong {
        return Err(too_long());
    }
    cells.cut(line)?;
    if cells.len() != columns.count {
        return Err(format!("{} cells, where the header has {}", cells.len(), columns.count));
    }
    let mut sample = Sample::new();
    for &(gas, index) in &columns.gases {
        let cell = cells.get(index);
        sample = row::add(sample, gas, cell).map_err(|f| format!("{}: {f}", gas.formula()))?;
    }
    if Gas::FIVE.iter().all(|&gas| sample.ppm(gas).is_none()) {
        return Err("none of H2, CH4, C2H6, C2H4 and C2H2 is given".into());
    }
    Ok(sample)
}
