//! Load, ambient temperature and cooling of one frame, each between bounds.

use std::ops::Range;

use busbar_plugin_sdk::TagValue;

use crate::inputs::{Inputs, LoadSource, Source};
use crate::interval::Interval;
use crate::settings::{MAX_PLAUSIBLE_LOAD, PLAUSIBLE_AMBIENT, TransformerSettings};

/// Voltage over the rated one where its measurement is not good: IEC 60038 leaves 10 % to
/// both sides, and as much again is left here.
const UNSEEN_VOLTAGE: Interval = Interval::new(0.8, 1.2);
/// Voltage over the rated one that a value may give where the transformer is energized.
const PLAUSIBLE_VOLTAGE: Interval = Interval::new(0.5, 1.5);
/// Measured oil and winding temperatures that a value may give, degrees Celsius.
const PLAUSIBLE_TEMPERATURE: Interval = Interval::new(-60.0, 300.0);

/// Difference of two ways of the load that is no inaccuracy of them, per unit.
const LOAD_DISAGREEMENT: f64 = 0.1;

/// Inputs that nobody saw lie within these bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plausible {
    /// Load, per unit of the rated one.
    pub(crate) load: Interval,
    /// Ambient temperature, degrees Celsius.
    pub(crate) ambient: Interval,
    /// Ambient temperature without a tag, degrees Celsius.
    pub(crate) fixed_ambient: f64,
}

/// State of the coolers as their fault contact tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CoolerFault {
    /// No tag tells faults.
    NotWatched,
    None,
    Reported,
    Unknown,
}

/// Inputs of one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OperatingPoint {
    /// Load, per unit of the rated one.
    pub(crate) load: Interval,
    /// Reports whether the load was measured, between bounds or exactly.
    pub(crate) is_load_measured: bool,
    /// Ambient temperature, degrees Celsius.
    pub(crate) ambient: Interval,
    /// Indices of the stages of cooling that may run.
    pub(crate) stages: Range<usize>,
    /// Measured top oil, degrees Celsius.
    pub(crate) top_oil: Option<f64>,
    /// Measured hot spot, degrees Celsius.
    pub(crate) hot_spot: Option<f64>,
    pub(crate) cooler_fault: CoolerFault,
    /// Bindings whose good values were used.
    pub(crate) used: Vec<usize>,
    /// Words for each input that is not known.
    pub(crate) doubts: Vec<String>,
}

impl OperatingPoint {
    /// Binding that lines rest on: that of a load or an ambient temperature that is not
    /// known, else one of those used. `load` is the binding of the first way of the load.
    pub(crate) fn weakest_binding(&self, inputs: &Inputs, load: usize) -> usize {
        let ambient = inputs.ambient.as_ref().map(|source| source.binding);
        let doubtful_ambient = ambient.filter(|binding| !self.used.contains(binding));
        match (self.is_load_measured, doubtful_ambient) {
            (false, _) => load,
            (true, Some(ambient)) => ambient,
            (true, None) => self.used.first().copied().unwrap_or(load),
        }
    }

    /// Bounds of load, ambient temperature and stages in the step that ends here: those of
    /// this frame, and where one was not known in the frame before, those of that one too.
    pub(crate) fn since(&self, before: Option<&Self>) -> (Interval, Interval, Range<usize>) {
        let Some(before) = before else {
            return (self.load, self.ambient, self.stages.clone());
        };
        let bounds = |now: Interval, before: Interval| match before.is_point() {
            true => now,
            false => now.hull(before),
        };
        let stages = match before.stages.len() > 1 {
            true => before.stages.clone(),
            false => self.stages.clone(),
        };
        (bounds(self.load, before.load), bounds(self.ambient, before.ambient), stages)
    }
}

/// Values of one frame, read into an operating point.
pub(crate) struct Reader<'a> {
    pub(crate) settings: &'a TransformerSettings,
    pub(crate) inputs: &'a Inputs,
    pub(crate) values: &'a [TagValue],
    pub(crate) plausible: Plausible,
}

/// Bindings used, and words for what is not known.
#[derive(Default)]
struct Remarks {
    used: Vec<usize>,
    doubts: Vec<String>,
}

impl Remarks {
    /// Number of a source within a range, if it is good.
    fn number(&mut self, source: &Source, values: &[TagValue], plausible: Interval) -> Option<f64> {
        let number = source.number(values).and_then(|number| {
            match (plausible.low..=plausible.high).contains(&number) {
                true => Ok(number),
                false => Err(source.doubt(&format!("implausible at {number:.1}"))),
            }
        });
        match number {
            Ok(number) => {
                self.used.push(source.binding);
                Some(number)
            }
            Err(doubt) => {
                self.doubts.push(doubt);
                None
            }
        }
    }
}

/// Load as one of its ways tells it.
enum MeasuredLoad {
    Between(Interval),
    AtLeast(f64),
    Unknown,
}

impl Reader<'_> {
    /// Reads the inputs; `last_load` is the last one that was known.
    pub(crate) fn read(&self, last_load: Option<f64>) -> OperatingPoint {
        let mut remarks = Remarks::default();
        let (load, is_load_measured) = self.load(last_load, &mut remarks);
        let mut optional = |source: &Option<Source>, plausible| {
            source.as_ref().and_then(|source| remarks.number(source, self.values, plausible))
        };
        let ambient = match &self.inputs.ambient {
            None => Interval::point(self.plausible.fixed_ambient),
            source => {
                optional(source, PLAUSIBLE_AMBIENT).map_or(self.plausible.ambient, Interval::point)
            }
        };
        let top_oil = optional(&self.inputs.top_oil, PLAUSIBLE_TEMPERATURE);
        let hot_spot = optional(&self.inputs.hot_spot, PLAUSIBLE_TEMPERATURE);
        let (stages, cooler_fault) = self.stages(&mut remarks);
        let Remarks { used, doubts } = remarks;
        OperatingPoint {
            load,
            is_load_measured,
            ambient,
            stages,
            top_oil,
            hot_spot,
            cooler_fault,
            used,
            doubts,
        }
    }

    fn load(&self, last_load: Option<f64>, remarks: &mut Remarks) -> (Interval, bool) {
        let mut least = self.plausible.load.low;
        for (index, source) in self.inputs.loads.iter().enumerate() {
            let used = remarks.used.len();
            match self.load_by(source, remarks) {
                MeasuredLoad::Between(load) if load.low <= MAX_PLAUSIBLE_LOAD => {
                    let others = self.inputs.loads.get(index + 1..).unwrap_or_default();
                    return (self.with_other_ways(load, others, remarks), true);
                }
                MeasuredLoad::AtLeast(load) if load <= MAX_PLAUSIBLE_LOAD => {
                    least = least.max(load);
                }
                MeasuredLoad::Between(Interval { low: load, .. }) | MeasuredLoad::AtLeast(load) => {
                    remarks.used.truncate(used);
                    remarks.doubts.push(format!("load is implausible at {load:.2} p.u."));
                }
                MeasuredLoad::Unknown => remarks.used.truncate(used),
            }
        }
        if self.inputs.loads.is_empty() {
            remarks.doubts.push("no tag tells the load".to_owned());
        }
        let greatest = self.plausible.load.high.max(last_load.unwrap_or(0.0)).max(least);
        (Interval::new(least, greatest), false)
    }

    fn load_by(&self, source: &LoadSource, remarks: &mut Remarks) -> MeasuredLoad {
        match source {
            LoadSource::Ratio { source, rated } => {
                self.ratio(source, *rated, remarks).map(Interval::point).into()
            }
            LoadSource::Current(phases) => self.current(phases, remarks),
            LoadSource::ApparentPower { source, rated } => {
                let power = self.power_number(source, *rated, remarks);
                power.map(|power| self.per_voltage(power, remarks)).into()
            }
            LoadSource::Power { active, reactive, rated } => {
                self.power(active, reactive.as_ref(), *rated, remarks)
            }
        }
    }

    /// Bounds of a load with the other ways that are good and surely tell another one: a current
    /// of 0 beside a power is a fault of one of them, and which one is not known.
    fn with_other_ways(
        &self,
        first: Interval,
        others: &[LoadSource],
        remarks: &mut Remarks,
    ) -> Interval {
        let mut all = first;
        for source in others {
            let mut of_source = Remarks::default();
            let (other, is_apart) = match self.load_by(source, &mut of_source) {
                MeasuredLoad::Between(load) if load.low <= MAX_PLAUSIBLE_LOAD => {
                    let is_below = load.high < first.low - LOAD_DISAGREEMENT;
                    (load, is_below || load.low > first.high + LOAD_DISAGREEMENT)
                }
                MeasuredLoad::AtLeast(least) if least <= MAX_PLAUSIBLE_LOAD => {
                    (Interval::point(least), least > first.high + LOAD_DISAGREEMENT)
                }
                _ => continue,
            };
            if is_apart {
                remarks.used.append(&mut of_source.used);
                remarks.doubts.push(format!(
                    "two ways tell the load: {:.2} and {:.2} p.u.",
                    first.middle(),
                    other.middle()
                ));
                all = all.hull(other);
            }
        }
        all
    }

    fn ratio(&self, source: &Source, rated: f64, remarks: &mut Remarks) -> Option<f64> {
        let plausible = Interval::new(0.0, MAX_PLAUSIBLE_LOAD * rated);
        remarks.number(source, self.values, plausible).map(|load| load / rated)
    }

    /// Load of the phase with the greatest current.
    fn current(&self, phases: &[Source], remarks: &mut Remarks) -> MeasuredLoad {
        let rated = self.rated_current(remarks);
        let plausible = Interval::new(0.0, MAX_PLAUSIBLE_LOAD * rated.high);
        let currents: Vec<_> = phases
            .iter()
            .filter_map(|phase| remarks.number(phase, self.values, plausible))
            .collect();
        let Some(greatest) = currents.iter().copied().reduce(f64::max) else {
            return MeasuredLoad::Unknown;
        };
        match currents.len() == phases.len() {
            true => {
                MeasuredLoad::Between(Interval::new(greatest / rated.high, greatest / rated.low))
            }
            false => MeasuredLoad::AtLeast(greatest / rated.high),
        }
    }

    /// Rated current at the tap, A; between those of all taps where the tap is not known.
    fn rated_current(&self, remarks: &mut Remarks) -> Interval {
        let taps = &self.settings.taps;
        let all = taps.iter().map(|of| Interval::point(of.rated_current)).reduce(Interval::hull);
        let Some(all) = all else {
            return Interval::point(self.settings.any_rated_current().unwrap_or(f64::NAN));
        };
        let Some(source) = &self.inputs.tap else {
            remarks.doubts.push("no tag tells the tap".to_owned());
            return all;
        };
        let everything = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        let Some(number) = remarks.number(source, self.values, everything) else { return all };
        match taps.iter().find(|of| (of.tap as f64 - number).abs() < 0.25) {
            Some(tap) => Interval::point(tap.rated_current),
            None => {
                remarks.doubts.push(source.doubt(&format!("{number}, which no tap is")));
                all
            }
        }
    }

    /// Power over the rated one; its sign is the direction and does not count.
    fn power_number(&self, source: &Source, rated: f64, remarks: &mut Remarks) -> Option<f64> {
        let most = MAX_PLAUSIBLE_LOAD * UNSEEN_VOLTAGE.high * rated;
        let number = remarks.number(source, self.values, Interval::new(-most, most))?;
        Some(number.abs() / rated)
    }

    /// Current over the rated one that goes with an apparent power over the rated one.
    fn per_voltage(&self, power: f64, remarks: &mut Remarks) -> Interval {
        let voltage = match (&self.inputs.voltage, self.settings.rated_voltage) {
            (Some(source), Some(rated)) => {
                let plausible = PLAUSIBLE_VOLTAGE.map(|of| of * rated);
                let voltage = remarks.number(source, self.values, plausible);
                voltage.map_or(UNSEEN_VOLTAGE, |voltage| Interval::point(voltage / rated))
            }
            (Some(_), None) => UNSEEN_VOLTAGE,
            (None, _) => Interval::point(1.0),
        };
        Interval::new(power / voltage.high, power / voltage.low)
    }

    fn power(
        &self,
        active: &Source,
        reactive: Option<&Source>,
        rated: f64,
        remarks: &mut Remarks,
    ) -> MeasuredLoad {
        let Some(active) = self.power_number(active, rated, remarks) else {
            return MeasuredLoad::Unknown;
        };
        let reactive = reactive.and_then(|source| self.power_number(source, rated, remarks));
        let power = self.per_voltage(active.hypot(reactive.unwrap_or(0.0)), remarks);
        match reactive {
            Some(_) => MeasuredLoad::Between(power),
            None => MeasuredLoad::AtLeast(power.low),
        }
    }

    /// Stages that may run, and the state of the coolers.
    fn stages(&self, remarks: &mut Remarks) -> (Range<usize>, CoolerFault) {
        let all = 0..self.settings.stages.len().max(1);
        let everything = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        let fault = match &self.inputs.cooler_fault {
            None => CoolerFault::NotWatched,
            Some(source) => match remarks.number(source, self.values, everything) {
                None => CoolerFault::Unknown,
                Some(0.0) => CoolerFault::None,
                Some(_) => CoolerFault::Reported,
            },
        };
        let is_doubtful = matches!(fault, CoolerFault::Reported | CoolerFault::Unknown);
        let Some(source) = self.inputs.cooler_stage.as_ref() else {
            if !self.settings.stages.is_empty() {
                remarks.doubts.push("no tag tells the stage of cooling".to_owned());
            }
            return (all, fault);
        };
        let Some(number) = remarks.number(source, self.values, everything) else {
            return (all, fault);
        };
        let is_it = |stage: i64| (stage as f64 - number).abs() < 0.25;
        match self.settings.stages.iter().position(|of| is_it(of.stage)) {
            Some(stage) if !is_doubtful => (stage..stage + 1, fault),
            Some(_) => (all, fault),
            None => {
                remarks.doubts.push(source.doubt(&format!("{number}, which no stage is")));
                (all, fault)
            }
        }
    }
}

impl From<Option<Interval>> for MeasuredLoad {
    fn from(load: Option<Interval>) -> Self {
        load.map_or(Self::Unknown, Self::Between)
    }
}

#[cfg(test)]
#[path = "operating_point_tests.rs"]
mod tests;
