//! Results of a sample as cells.

use std::io::{self, BufWriter, Write};

use dga::pentagon::{self, PENTAGON_1, PENTAGON_2};
use dga::uncertainty::Uncertainty;
use dga::{
    Sample, c57_104, dlt722, doernenburg, iec60599, key_gas, rogers, triangle_1, triangle_4,
    triangle_5,
};

use crate::columns::Columns;
use crate::history::{self, Trend};
use crate::odds;
use crate::row::Cells;
use crate::settings::Settings;

/// Columns of results, after those of the sample.
pub(crate) const RESULTS: [&str; 15] = [
    "iec",
    "rogers",
    "doernenburg",
    "keygas",
    "dlt722",
    "tri1",
    "tri4",
    "tri5",
    "tri4_applicable",
    "tri5_applicable",
    "pent1",
    "pent2",
    "pent_x",
    "pent_y",
    "c57_status",
];
/// Bytes of output that go to the host at once.
const PIECE_BYTES: usize = 1 << 16;
/// Cell of a result that there is not.
const NONE: &str = "NA";

/// Writes rows of results.
pub(crate) struct Report<'a, W: Write> {
    writer: csv::Writer<BufWriter<W>>,
    settings: &'a Settings,
    uncertainty: Option<Uncertainty>,
    text: String,
}

impl<'a, W: Write> Report<'a, W> {
    /// Writes the header of results.
    ///
    /// # Errors
    /// I/O errors of the output.
    pub(crate) fn begin(
        output: W,
        columns: &Columns,
        settings: &'a Settings,
        uncertainty: Option<Uncertainty>,
    ) -> io::Result<Self> {
        let mut writer = csv::Writer::from_writer(BufWriter::with_capacity(PIECE_BYTES, output));
        let identifying = columns.identifying.iter().map(|(name, _)| *name);
        let gases = columns.gases.iter().map(|(gas, _)| gas.formula());
        let odds = uncertainty.iter().flat_map(|_| odds::COLUMNS);
        let history = settings.history.then_some(history::COLUMNS);
        let history = history.into_iter().flatten();
        let names = identifying.chain(gases).chain(RESULTS).chain(history).chain(odds);
        writer.write_record(names).map_err(io::Error::from)?;
        Ok(Self { writer, settings, uncertainty, text: String::new() })
    }

    /// Writes the results of a sample whose row has these cells.
    ///
    /// # Errors
    /// I/O errors of the output.
    pub(crate) fn add(
        &mut self,
        columns: &Columns,
        cells: &Cells,
        sample: &Sample,
        trend: Option<&Trend>,
    ) -> io::Result<()> {
        let identifying = columns.identifying.iter().map(|(_, index)| *index);
        for index in identifying.chain(columns.gases.iter().map(|(_, index)| *index)) {
            self.cell(cells.get(index))?;
        }
        let settings = self.settings;
        self.text.clear();
        for zone in iec60599::zones(sample, settings.equipment.into()) {
            if !self.text.is_empty() {
                self.text.push('|');
            }
            self.text.push_str(zone.name());
        }
        self.writer.write_field(&self.text).map_err(io::Error::from)?;
        let yes = |is: bool| if is { "true" } else { "false" };
        for cell in [
            rogers::zone(sample).name(),
            doernenburg::zone(sample).name(),
            key_gas::zone(sample).name(),
            dlt722::zone(sample).name(),
            triangle_1::zone(sample).name(),
            triangle_4::zone(sample).name(),
            triangle_5::zone(sample).name(),
            yes(triangle_4::is_applicable(sample)),
            yes(triangle_5::is_applicable(sample)),
            PENTAGON_1.zone(sample).name(),
            PENTAGON_2.zone(sample).name(),
        ] {
            self.cell(cell)?;
        }
        match pentagon::point(sample) {
            Some(point) => {
                for percent in point {
                    self.cell(&number(percent))?;
                }
            }
            None => {
                self.cell(NONE)?;
                self.cell(NONE)?;
            }
        }
        match c57_104::status(sample, settings.age.into()) {
            Some(status) => self.cell(&status.to_string())?,
            None => self.cell(NONE)?,
        }
        if let Some(trend) = trend {
            let status = c57_104::status_with(sample, settings.age.into(), &trend.history);
            self.cell(&status.map_or(NONE.to_owned(), |status| status.to_string()))?;
            for rate in trend.rates {
                self.cell(&rate.map_or(NONE.to_owned(), |rate| format!("{rate:.3}")))?;
            }
        }
        if let Some(uncertainty) = self.uncertainty {
            for cell in odds::cells(sample, uncertainty, settings.equipment.into()) {
                self.cell(&cell)?;
            }
        }
        // An empty record ends the row.
        self.writer.write_record(None::<&[u8]>).map_err(io::Error::from)?;
        // What takes long shows that it goes on: a host ends a command that does not.
        if self.uncertainty.is_some() { self.writer.flush() } else { Ok(()) }
    }

    fn cell(&mut self, text: &str) -> io::Result<()> {
        self.writer.write_field(text).map_err(io::Error::from)
    }

    /// Hands over what is left.
    ///
    /// # Errors
    /// I/O errors of the output.
    pub(crate) fn end(mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// With six digits, and no sign of nothing.
fn number(percent: f64) -> String {
    let text = format!("{percent:.6}");
    if text == "-0.000000" { "0.000000".into() } else { text }
}
