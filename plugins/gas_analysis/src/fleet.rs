//! The samples of a fleet of transformers, as records of a chart.

use std::collections::BTreeMap;
use std::time::SystemTime;

use busbar_plugin_sdk::{
    ChartAxis, ChartBand, ChartDescription, ChartRecord, ChartRecords, ChartState, Error, Host,
    LogLevel, Pattern,
};
use dga::c57_104::{self, Age};
use dga::{Gas, Sample};

use crate::Settings;
use crate::history::{Book, Trend, day_of};
use crate::source::{self, FleetSettings, Reading};
use crate::verdict::{self, Judgement};

const SECONDS_PER_DAY: f64 = 86_400.0;
/// Julian day number of 1970-01-01, as dates are counted here.
const EPOCH_DAY: f64 = 2_440_588.0;
/// Gases with an axis of their own: upper end and detection limit (IEC 60567), ppm.
const GAS_AXES: [(Gas, f32, f32); 6] = [
    (Gas::H2, 1e5, 2.0),
    (Gas::Ch4, 1e5, 0.1),
    (Gas::C2h6, 1e5, 0.1),
    (Gas::C2h4, 1e5, 0.1),
    (Gas::C2h2, 1e5, 0.1),
    (Gas::Co, 1e4, 5.0),
];
/// Lower end of all axes of gases, ppm.
const GAS_LOW: f32 = 0.1;
/// Ratios of IEC 60599, table 1: their gases, and the limit that is drawn.
const RATIO_AXES: [(&str, [Gas; 2], f32); 3] = [
    ("C2H2/C2H4", [Gas::C2h2, Gas::C2h4], 1.0),
    ("CH4/H2", [Gas::Ch4, Gas::H2], 1.0),
    ("C2H4/C2H6", [Gas::C2h4, Gas::C2h6], 4.0),
];
/// Ends of axes of ratios: what is beyond, infinity too, is at an end.
const RATIO_ENDS: [f32; 2] = [0.01, 100.0];
const AXES: usize = GAS_AXES.len() + RATIO_AXES.len() + source::EXTRAS.len();

/// A sample with what it means.
pub(crate) struct Judged {
    pub(crate) unix_nanos: i64,
    pub(crate) sample: Sample,
    pub(crate) trend: Trend,
    pub(crate) judgement: Judgement,
    pub(crate) status: Option<c57_104::Status>,
    pub(crate) state: u32,
    extras: [f32; source::EXTRAS.len()],
}

/// Samples of all transformers.
pub(crate) struct Fleet {
    host: Host,
    settings: Settings,
    /// What the file was when it was read.
    version: Option<(SystemTime, u64)>,
    revision: u64,
    equipment: Vec<String>,
    histories: Vec<Vec<Judged>>,
    records: Vec<ChartRecord>,
    values: Vec<f32>,
}

impl Fleet {
    /// Nothing is read yet.
    pub(crate) fn of(settings: &Settings, host: Host) -> Result<Self, Error> {
        if let Some(fleet) = settings.fleet.as_ref().filter(|fleet| !fleet.file.is_absolute()) {
            let path = fleet.file.display();
            return Err(Error::settings(format!("fleet.file: '{path}' is no absolute path")));
        }
        Ok(Self {
            host,
            settings: settings.clone(),
            version: None,
            revision: 0,
            equipment: Vec::new(),
            histories: Vec::new(),
            records: Vec::new(),
            values: Vec::new(),
        })
    }

    /// Reads the file if it is another one than before. One that cannot be read leaves the
    /// samples as they were, and is told.
    pub(crate) fn read_again(&mut self) {
        let Some(fleet) = self.settings.fleet.clone() else { return };
        let version = source::version(&fleet.file);
        if self.revision > 0 && version == self.version {
            return;
        }
        self.version = version;
        // Also after a fault: it is told once.
        self.revision += 1;
        match source::read(&fleet) {
            Err(fault) => self.host.log(LogLevel::Error, &fault),
            Ok(readings) => {
                for fault in &readings.faults {
                    let place = fleet.file.display();
                    self.host.log(LogLevel::Warning, &format!("{place}: {fault}"));
                }
                self.take(readings.all);
            }
        }
    }

    fn take(&mut self, readings: Vec<Reading>) {
        let mut by_equipment: BTreeMap<String, Vec<(i64, Reading)>> = BTreeMap::new();
        for reading in readings {
            match day_of(&reading.time) {
                Ok(day) => {
                    let seconds = ((day - EPOCH_DAY) * SECONDS_PER_DAY).round() as i64;
                    let entry = by_equipment.entry(reading.equipment.clone()).or_default();
                    entry.push((seconds.saturating_mul(1_000_000_000), reading));
                }
                Err(fault) => self.host.log(LogLevel::Warning, &fault),
            }
        }
        (self.equipment, self.histories) = (Vec::new(), Vec::new());
        for (equipment, mut own) in by_equipment {
            own.sort_by_key(|(time, _)| *time);
            let history = self.judge_all(own);
            self.equipment.push(equipment);
            self.histories.push(history);
        }
        self.list();
    }

    /// Judges the samples of one transformer, each by those before it.
    fn judge_all(&self, own: Vec<(i64, Reading)>) -> Vec<Judged> {
        let mut book = Book::default();
        let mut history = Vec::with_capacity(own.len());
        for (unix_nanos, Reading { equipment, time, sample, extras }) in own {
            let trend = match book.add(&equipment, &time, &sample) {
                Ok(trend) => trend,
                Err(fault) => {
                    self.host.log(LogLevel::Warning, &fault);
                    continue;
                }
            };
            let judgement = verdict::judge(&sample, &self.settings);
            let age: Age = self.settings.age.into();
            let status = c57_104::status_with(&sample, age, &trend.history);
            let state = verdict::state(status, &judgement);
            history.push(Judged { unix_nanos, sample, trend, judgement, status, state, extras });
        }
        history
    }

    fn list(&mut self) {
        (self.records, self.values) = (Vec::new(), Vec::new());
        for (equipment, history) in self.histories.iter().enumerate() {
            for judged in history {
                let Judged { unix_nanos, state, .. } = *judged;
                let equipment = equipment as u32;
                self.records.push(ChartRecord { unix_nanos, equipment, state });
                self.values.extend(values(judged));
            }
        }
    }

    /// What is read now.
    pub(crate) fn records(&self) -> ChartRecords<'_> {
        let Self { revision, records, values, .. } = self;
        ChartRecords { revision: *revision, records, values }
    }

    /// The samples of a transformer that are not after an instant.
    pub(crate) fn history_until(&self, equipment: &str, unix_nanos: i64) -> Option<&[Judged]> {
        let at = self.equipment.iter().position(|id| id == equipment)?;
        let history = &self.histories[at];
        Some(&history[..history.partition_point(|judged| judged.unix_nanos <= unix_nanos)])
    }

    /// Axes, legend and transformers.
    pub(crate) fn describe(&self) -> ChartDescription {
        let days =
            self.settings.fleet.as_ref().map_or(400, |fleet: &FleetSettings| fleet.valid_days);
        ChartDescription {
            name: "Dissolved gases".into(),
            axes: axes(self.settings.age.into()),
            legend: legend(),
            equipment: self.equipment.clone(),
            valid_seconds: u64::from(days) * 86_400,
        }
    }
}

fn values(judged: &Judged) -> [f32; AXES] {
    let mut values = [f32::NAN; AXES];
    let (gases, rest) = values.split_at_mut(GAS_AXES.len());
    for (value, (gas, _, _)) in gases.iter_mut().zip(GAS_AXES) {
        *value = judged.sample.ppm(gas).map_or(f32::NAN, |ppm| ppm as f32);
    }
    let (ratios, extras) = rest.split_at_mut(RATIO_AXES.len());
    for (value, (_, [above, below], _)) in ratios.iter_mut().zip(RATIO_AXES) {
        let ppm = judged.sample.ppm(above).zip(judged.sample.ppm(below));
        // x/0 is infinite, and 0/0 is no number.
        let ratio = ppm.map_or(f64::NAN, |(above, below)| above / below);
        *value = (ratio as f32).min(RATIO_ENDS[1]);
    }
    extras.copy_from_slice(&judged.extras);
    values
}

fn axes(age: Age) -> Vec<ChartAxis> {
    let limits = c57_104::limits(&Sample::new(), age);
    let band = |name: &str, from: Option<f32>, to: Option<f32>, is_abnormal| ChartBand {
        name: name.into(),
        from,
        to,
        is_abnormal,
    };
    let gas_axis = |(gas, high, detection): (Gas, f32, f32)| {
        let at = c57_104::GASES.iter().position(|one| *one == gas);
        let bands = at.map_or_else(Vec::new, |at| {
            let [typical, upper] = limits[at].map(|ppm| ppm as f32);
            vec![
                band("between C57.104-2019 tables 1 and 2", Some(typical), Some(upper), false),
                band("above C57.104-2019 table 2", Some(upper), None, true),
            ]
        });
        ChartAxis {
            name: gas.formula().into(),
            unit: "ppm".into(),
            log: true,
            low: GAS_LOW,
            high,
            detection_limit: Some(detection),
            bands,
        }
    };
    let ratio_axis = |(name, _, limit): (&str, [Gas; 2], f32)| ChartAxis {
        name: name.into(),
        unit: String::new(),
        log: true,
        low: RATIO_ENDS[0],
        high: RATIO_ENDS[1],
        detection_limit: None,
        bands: vec![band("limit of IEC 60599, table 1", Some(limit), None, false)],
    };
    let linear = |name: &str, unit: &str, high, limit| ChartAxis {
        name: name.into(),
        unit: unit.into(),
        log: false,
        low: 0.0,
        high,
        detection_limit: None,
        bands: vec![band("above the limit of IEC 60076-7, table 2", Some(limit), None, true)],
    };
    let mut axes: Vec<ChartAxis> = GAS_AXES.into_iter().map(gas_axis).collect();
    axes.extend(RATIO_AXES.map(ratio_axis));
    axes.push(linear("Top oil", "°C", 140.0, 105.0));
    axes.push(linear("Load", "p.u.", 1.5, 1.3));
    axes
}

fn legend() -> Vec<ChartState> {
    let state = |name: &str, color, pattern, is_abnormal| ChartState {
        name: name.into(),
        color,
        pattern,
        is_abnormal,
    };
    // In the order of `verdict`'s states.
    vec![
        state("normal (C57.104 status 1)", [150, 154, 160], Pattern::Solid, false),
        state("watch (status 2)", [176, 128, 0], Pattern::Dotted, true),
        state("overheating (status 3)", [214, 84, 16], Pattern::Striped, true),
        state("discharges or unclear (status 3)", [178, 16, 36], Pattern::Crossed, true),
    ]
}
