//! Voltages of instrument transformers and voltage indicators, by phase. They support the
//! topology and never replace it: alone they make nothing energised and nothing dead.
//!
//! The bands are those of voltage detecting and indicating systems (IEC 62271-213:2021):
//! present from 45 % of the nominal voltage, no indication below 10 %. That nothing is
//! indicated proves no absence: a coupling, a fuse or the indicator may be at fault.

use busbar_plugin_sdk::{DoublePoint, Quality, TagValue, Value};

use crate::measured_unit::MeasuredUnit;

/// Share of the nominal voltage from which voltage is present.
pub const PRESENT_FROM: f64 = 0.45;
/// Share below which voltage that was present is present no longer.
pub const PRESENT_UNTIL: f64 = 0.43;
/// Share below which there is no voltage.
pub const ABSENT_BELOW: f64 = 0.10;
/// Share below which there is none again, after it rose above that.
pub const ABSENT_AGAIN_BELOW: f64 = 0.08;
/// Share above which a voltage is implausible: an earth fault gives 1.73.
pub const MAX_PLAUSIBLE: f64 = 2.0;

/// Band of a voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoltageBand {
    /// At least 45 % of nominal.
    Present,
    /// At least 10, below 45 %.
    Between,
    /// Less than 10 % of nominal.
    Low,
}

/// Hysteresis of one voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VoltageMemory {
    last: Option<VoltageBand>,
    /// Reports whether it was low, and left that band upwards since.
    has_left_low: bool,
}

impl VoltageMemory {
    /// Finds the band of a share of the nominal voltage; `None` for what is implausible,
    /// which changes nothing.
    pub fn classify(&mut self, share: f64) -> Option<VoltageBand> {
        if !(0.0..=MAX_PLAUSIBLE).contains(&share) {
            return None;
        }
        let was_present = self.last == Some(VoltageBand::Present);
        let present = if was_present { PRESENT_UNTIL } else { PRESENT_FROM };
        let low = if self.has_left_low { ABSENT_AGAIN_BELOW } else { ABSENT_BELOW };
        let band = match share {
            share if share >= present => VoltageBand::Present,
            share if share < low => VoltageBand::Low,
            _ => VoltageBand::Between,
        };
        self.has_left_low = match band {
            VoltageBand::Low | VoltageBand::Present => false,
            VoltageBand::Between => self.has_left_low || self.last == Some(VoltageBand::Low),
        };
        self.last = Some(band);
        Some(band)
    }

    /// The band that the last plausible value was in.
    pub fn last(&self) -> Option<VoltageBand> {
        self.last
    }
}

/// Phase, or pair of phases, of a voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Phase that is not told.
    Any,
    /// Phase to earth: 1 to 3.
    Earth(u8),
    /// Voltage between phases: 12, 23 or 31.
    Between(u8),
}

/// Roles of voltages, with their phases.
pub(crate) const VOLTAGES: [(&str, Phase); 7] = [
    ("voltage", Phase::Any),
    ("voltage_l1", Phase::Earth(1)),
    ("voltage_l2", Phase::Earth(2)),
    ("voltage_l3", Phase::Earth(3)),
    ("voltage_l12", Phase::Between(12)),
    ("voltage_l23", Phase::Between(23)),
    ("voltage_l31", Phase::Between(31)),
];
/// Roles of tags that are true where an instrument transformer is cut off.
pub(crate) const VOLTAGE_FAULTS: [&str; 2] = ["fuse_fault", "mcb_tripped"];

impl Phase {
    /// The name that it has in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Any => "voltage",
            Self::Earth(1) => "L1",
            Self::Earth(2) => "L2",
            Self::Earth(_) => "L3",
            Self::Between(12) => "L1-L2",
            Self::Between(23) => "L2-L3",
            Self::Between(_) => "L3-L1",
        }
    }

    /// Share of the voltage between phases that is nominal here. A voltage of no phase
    /// counts as one between phases, and so is the less easily taken for present.
    fn nominal(self) -> f64 {
        match self {
            Self::Earth(_) => 1.0 / 3_f64.sqrt(),
            Self::Any | Self::Between(_) => 1.0,
        }
    }
}

/// Instrument transformer, or voltage indicator, at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoltageWiring {
    /// Name of the equipment.
    pub equipment: String,
    /// The node that it measures at.
    pub node: usize,
    /// Nominal voltage between phases, kV.
    pub nominal_kv: Option<f64>,
    /// Tags of its voltages.
    pub phases: Vec<PhaseTag>,
    /// Tags that are true where it is cut off.
    pub faults: Vec<usize>,
}

/// Tag of a voltage, and its hysteresis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseTag {
    /// Index of the binding.
    pub binding: usize,
    /// Phase that it measures.
    pub phase: Phase,
    /// Unit of its numbers.
    pub unit: MeasuredUnit,
    /// Hysteresis of its band.
    pub memory: VoltageMemory,
}

/// Voltage at a node, as one instrument transformer has it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VoltageEvidence {
    /// The binding of a phase that has voltage.
    pub present: Option<usize>,
    /// The binding of a phase that had voltage when its last good value came.
    pub was_present: Option<usize>,
    /// Tells of phases that are below what is present; it is a doubt in what is energised.
    pub doubt: Option<String>,
}

impl VoltageWiring {
    /// Reads all phases of one frame.
    pub fn read(&mut self, values: &[TagValue]) -> VoltageEvidence {
        let nominal_kv = self.nominal_kv;
        let bands: Vec<_> =
            self.phases.iter_mut().map(|tag| (tag.read(values, nominal_kv), *tag)).collect();
        let in_band = |wanted: Option<VoltageBand>| {
            bands.iter().filter(move |(band, _)| *band == wanted).map(|(_, tag)| tag)
        };
        let had_voltage = |tag: &&PhaseTag| tag.memory.last() == Some(VoltageBand::Present);
        VoltageEvidence {
            present: in_band(Some(VoltageBand::Present)).next().map(|tag| tag.binding),
            was_present: in_band(None).find(had_voltage).map(|tag| tag.binding),
            doubt: self.doubt(values, &bands),
        }
    }

    fn doubt(
        &self,
        values: &[TagValue],
        bands: &[(Option<VoltageBand>, PhaseTag)],
    ) -> Option<String> {
        let id = &self.equipment;
        let find = |wanted| bands.iter().find(|(band, _)| *band == Some(wanted));
        if let Some((_, tag)) = find(VoltageBand::Between) {
            let name = tag.phase.name();
            return Some(format!("{id}: {name} is between 10 and 45 % of nominal"));
        }
        let (_, low) = find(VoltageBand::Low)?;
        if self.faults.iter().any(|&fault| is_fault(&values[fault])) {
            return None;
        }
        Some(match self.is_absent(bands) {
            true => format!("{id} measures no voltage in any phase"),
            false => format!("{id} measures no voltage: {}", low.phase.name()),
        })
    }

    /// Reports whether all phases are measured, and none has voltage.
    fn is_absent(&self, bands: &[(Option<VoltageBand>, PhaseTag)]) -> bool {
        let is_low = |phase| {
            bands.iter().any(|(band, tag)| tag.phase == phase && *band == Some(VoltageBand::Low))
        };
        let all_low = bands.iter().all(|(band, _)| *band == Some(VoltageBand::Low));
        let earth = [1, 2, 3].map(Phase::Earth);
        let between = [12, 23, 31].map(Phase::Between);
        all_low && (earth.into_iter().all(is_low) || between.into_iter().all(is_low))
    }
}

impl PhaseTag {
    /// The band of a good value; none of one that is missing or implausible.
    fn read(&mut self, values: &[TagValue], nominal_kv: Option<f64>) -> Option<VoltageBand> {
        let number = values[self.binding].good_number()?;
        let share = match self.unit {
            MeasuredUnit::Voltage(factor) => number * factor / (nominal_kv? * self.phase.nominal()),
            MeasuredUnit::None => number / (nominal_kv? * self.phase.nominal()),
            MeasuredUnit::Share(factor) => number * factor,
            MeasuredUnit::Power(_) | MeasuredUnit::Current(_) | MeasuredUnit::Other => return None,
        };
        self.memory.classify(share)
    }
}

/// Reports whether an instrument transformer is cut off, or may be.
fn is_fault(tag: &TagValue) -> bool {
    let is_off =
        matches!(tag.value, Some(Value::Bool(false) | Value::DoublePoint(DoublePoint::Off)));
    !(is_off && tag.quality == Quality::Good)
}
