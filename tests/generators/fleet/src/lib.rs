//! A fleet of transformers with seeded gas histories: normal ageing, and each class of
//! fault developing. Made by this project; no measured data.

mod configuration;
mod history;

use std::fmt::Write as _;

use time::Date;

pub use configuration::{FOLDER, SAMPLES, configuration, text};
pub use history::{TransformerFault, histories, monitored, one_by_one};

/// Number of transformers, the first two in the yard, the others in a row before it.
pub const TRANSFORMERS: usize = 12;

/// Returns the equipment id of a transformer, from 0 on.
pub fn equipment(transformer: usize) -> String {
    format!("=S12T{}-TA1", transformer + 1)
}

/// Returns the position of a transformer: x and z, metres.
pub fn place(transformer: usize) -> [f64; 2] {
    match transformer {
        0 => [-28.0, 0.0],
        1 => [28.0, 0.0],
        other => [(other as f64 - 2.0) * 14.0 - 63.0, 64.0],
    }
}

/// Sample of one transformer.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index of the transformer.
    pub transformer: usize,
    /// Day of the sample.
    pub day: Date,
    /// Seconds since the beginning of that day.
    pub second: u32,
    /// Concentrations of H2, CH4, C2H6, C2H4, C2H2, CO, CO2, O2, N2, ppm; `None` where not
    /// measured.
    pub ppm: [Option<f64>; 9],
    /// Temperature of the top oil in °C.
    pub top_oil: f64,
    /// Load in per unit.
    pub load: f64,
}

/// Formats rows as CSV, as `busbar dga` and the chart read them.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from("equipment,time,H2,CH4,C2H6,C2H4,C2H2,CO,CO2,O2,N2,top_oil,load\n");
    for row in rows {
        // Writing into a string does not fail.
        let _ = write!(text, "{},{}", equipment(row.transformer), row.day);
        if row.second > 0 {
            let [minute, hour] = [row.second / 60 % 60, row.second / 3600];
            let _ = write!(text, "T{hour:02}:{minute:02}:{:02}Z", row.second % 60);
        }
        for ppm in row.ppm {
            text.push(',');
            if let Some(ppm) = ppm {
                let _ = write!(text, "{ppm:.1}");
            }
        }
        let _ = writeln!(text, ",{:.0},{:.2}", row.top_oil, row.load);
    }
    text
}
