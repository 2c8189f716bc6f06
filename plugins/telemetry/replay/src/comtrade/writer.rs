//! Writes recordings of all revisions and types, for tests. An independent reader
//! agrees with it (`tests/peer.rs`).

use super::{DataType, Revision};

/// Sampling rate, samples a second.
pub(crate) const HERTZ: u64 = 4800;
/// Raw values that the first channel may have.
pub(crate) const RANGE: i32 = 30_000;

/// Properties of a recording to be written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recipe {
    pub(crate) revision: Revision,
    pub(crate) data: DataType,
    pub(crate) samples: u64,
    /// Writes time stamps into records, and no rates.
    pub(crate) has_timestamps: bool,
    /// Writes times in nanoseconds.
    pub(crate) is_nano: bool,
}

impl Recipe {
    pub(crate) fn new(revision: Revision, data: DataType) -> Self {
        Self { revision, data, samples: 1000, has_timestamps: false, is_nano: false }
    }

    /// The configuration: IA (primary A, 600:5), UA (secondary V, 100:1), skewed, and
    /// 18 digital channels, D1 to D18.
    pub(crate) fn cfg(&self) -> String {
        let is_1991 = self.revision == Revision::Of1991;
        let year = match self.revision {
            Revision::Of1991 => "",
            Revision::Of1999 => ",1999",
            Revision::Of2013 => ",2013",
        };
        let mut lines = vec![format!("Nord,REC 7{year}"), "20,2A,18D".to_owned()];
        let ratios = |text: &str| if is_1991 { String::new() } else { format!(",{text}") };
        lines.push(format!("1,IA,A,,A,0.5,-3,0,{},{RANGE}{}", -RANGE, ratios("600,5,P")));
        lines.push(format!(
            "2,UA,A,,V,0.001953125,0,125.5,{},{RANGE}{}",
            -RANGE,
            ratios("100,1,S")
        ));
        let named = if is_1991 { "" } else { ",," };
        lines.extend((1..=18).map(|n| format!("{n},D{n}{named},0")));
        lines.push("50".to_owned());
        let half = self.samples / 2;
        if self.has_timestamps {
            lines.extend(["0".to_owned(), format!("0,{}", self.samples)]);
        } else {
            let rates = [format!("{HERTZ},{half}"), format!("{},{}", HERTZ / 4, self.samples)];
            lines.push("2".to_owned());
            lines.extend(rates);
        }
        let date = if is_1991 { "02/29/24" } else { "29/02/2024" };
        let fraction = if self.is_nano { "250000000" } else { "250000" };
        lines.push(format!("{date},13:14:15.{fraction}"));
        lines.push(format!("{date},13:14:15.{fraction}"));
        let data = match self.data {
            DataType::Ascii => "ASCII",
            DataType::Binary => "BINARY",
            DataType::Binary32 => "BINARY32",
            DataType::Float32 => "FLOAT32",
        };
        lines.push(data.to_owned());
        if !is_1991 {
            lines.push("1".to_owned());
        }
        if self.revision == Revision::Of2013 {
            lines.extend(["+1,+1".to_owned(), "0,0".to_owned()]);
        }
        lines.join("\r\n") + "\r\n"
    }

    /// Raw values of the analogue channels; nothing where one is missing.
    pub(crate) fn analogs(&self, sample: u64) -> [Option<f64>; 2] {
        let angle = sample as f64 / (HERTZ / 50) as f64 * std::f64::consts::TAU;
        let current = (angle.sin() * 20_000.0).round();
        let voltage = (angle.cos() * 15_000.0).round() + self.fraction();
        // The marks of 1991 depend on the range: they have tests of their own.
        let has_mark = self.revision != Revision::Of1991 || self.data == DataType::Ascii;
        let is_missing = has_mark && sample.is_multiple_of(97);
        [Some(current), Some(voltage).filter(|_| !is_missing)]
    }

    fn fraction(&self) -> f64 {
        if self.data == DataType::Float32 { 0.25 } else { 0.0 }
    }

    /// The states of the digital channels: D1 changes with every record, D2 with
    /// every second, and so on.
    pub(crate) fn digital(sample: u64, channel: u64) -> bool {
        sample >> channel & 1 == 1
    }

    /// The time stamp of a record in its unit: 100 microseconds a sample.
    pub(crate) fn timestamp(&self, sample: u64) -> u32 {
        let micros = (sample - 1) * 100;
        (if self.is_nano { micros * 1000 } else { micros }) as u32
    }

    /// Returns the bytes of the data file.
    pub(crate) fn dat(&self) -> Vec<u8> {
        (1..=self.samples).flat_map(|sample| self.record(sample)).collect()
    }

    /// Returns the bytes of one record.
    pub(crate) fn record(&self, sample: u64) -> Vec<u8> {
        let digitals = (0..18).map(|channel| Self::digital(sample, channel));
        if self.data == DataType::Ascii {
            let mark = if self.revision == Revision::Of1991 { "" } else { "99999" };
            let analogs = self.analogs(sample);
            let analogs =
                analogs.map(|value| value.map_or(mark.to_owned(), |value| value.to_string()));
            let digitals: Vec<_> = digitals.map(|is_on| u8::from(is_on).to_string()).collect();
            let time = self.timestamp(sample);
            return format!("{sample},{time},{},{}\r\n", analogs.join(","), digitals.join(","))
                .into_bytes();
        }
        let mut record =
            [(sample as u32).to_le_bytes(), self.timestamp(sample).to_le_bytes()].concat();
        for value in self.analogs(sample) {
            match self.data {
                DataType::Binary => {
                    record.extend(value.map_or(i16::MIN, |v| v as i16).to_le_bytes())
                }
                DataType::Binary32 => {
                    record.extend(value.map_or(i32::MIN, |v| v as i32).to_le_bytes())
                }
                _ => record.extend(value.map_or(f32::MIN, |v| v as f32).to_le_bytes()),
            }
        }
        let mut words = [0_u16; 2];
        for (channel, is_on) in digitals.enumerate() {
            words[channel / 16] |= u16::from(is_on) << (channel % 16);
        }
        record.extend(words.into_iter().flat_map(u16::to_le_bytes));
        record
    }

    /// The single file of 2013.
    pub(crate) fn cff(&self) -> Vec<u8> {
        let data = self.dat();
        let kind = match self.data {
            DataType::Ascii => "ASCII".to_owned(),
            _ => format!("BINARY: {}", data.len()),
        };
        let head = format!(
            "--- file type: CFG ---\r\n{}--- file type: INF ---\r\n--- file type: HDR ---\r\nAny text\r\n--- file type: DAT {kind} ---\r\n",
            self.cfg()
        );
        [head.as_bytes(), &data].concat()
    }

    /// The time of a sample, seconds from the first.
    pub(crate) fn seconds(&self, sample: u64) -> f64 {
        if self.has_timestamps {
            return (sample - 1) as f64 * 1e-4;
        }
        let half = self.samples / 2;
        let fast = sample.min(half) - 1;
        fast as f64 / HERTZ as f64 + sample.saturating_sub(half) as f64 / (HERTZ / 4) as f64
    }
}
