//! Feeding of sources, as their tags have it. A number at zero is no proof that a machine
//! does not feed: it may spin without load.

use busbar_plugin_sdk::{DoublePoint, Quality, TagValue, Value};

use smallvec::smallvec;

use crate::measured_unit::MeasuredUnit;
use crate::state::Position;
use crate::switch_reading::{BindingList, one};
use crate::voltage::{VoltageBand, VoltageMemory};

/// Share of the rating from which power is power.
pub const MIN_POWER_SHARE: f64 = 0.01;

/// Role of a tag that tells whether a source feeds.
pub(crate) const SOURCE: &str = "source";
/// Role of a tag that is the active power of a source.
pub(crate) const ACTIVE_POWER: &str = "active_power";
/// Role of a tag that is the reactive power of a source.
pub(crate) const REACTIVE_POWER: &str = "reactive_power";

/// Tags that tell whether a source feeds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceWiring {
    /// Reports whether it feeds without any tag.
    pub is_always_on: bool,
    /// Reports whether the settings say that no tag tells.
    pub is_untelemetered: bool,
    /// Tag in the role `source`.
    pub says: Option<SourceTag>,
    /// Tags of active and reactive power.
    pub powers: Vec<SourceTag>,
    /// Rated apparent power, MVA.
    pub rating_mva: Option<f64>,
    /// Nominal voltage between phases, kV.
    pub nominal_kv: Option<f64>,
}

/// Tag of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceTag {
    /// Index of the binding.
    pub binding: usize,
    /// Unit of its numbers.
    pub unit: MeasuredUnit,
}

/// Condition of a source, besides its feeding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceCondition {
    /// Told by a tag, or always on.
    Told,
    /// No tag tells anything of it.
    NoTag,
    /// No tag tells, as the settings say.
    Untelemetered,
    /// Tag whose value is not good.
    NotGood,
    /// A double point at neither of its ends.
    Undecided,
    /// A text, which is neither a state nor a number.
    IsText,
    /// Power below what counts: it may spin without load.
    NoPower,
    /// Voltage that is not surely present.
    NoVoltage,
    /// Said to be off, while power flows.
    PowerThoughOff,
}

/// Reading of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceReading {
    /// Feeding, as the position of a switch between the source and its node.
    pub position: Position,
    /// Condition that is told.
    pub condition: SourceCondition,
    /// Bindings that it rests on.
    pub basis: BindingList,
    /// Reports whether any power was taken for power, as no rating is given.
    pub is_assumed: bool,
}

/// Verdict of one tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Evidence {
    Feeds { is_assumed: bool },
    IsOff,
    Open(SourceCondition),
}

impl SourceWiring {
    /// Reads whether it feeds.
    pub fn read(&self, values: &[TagValue], memory: &mut VoltageMemory) -> SourceReading {
        let of = |position, condition, basis| SourceReading {
            position,
            condition,
            basis,
            is_assumed: false,
        };
        if self.is_always_on {
            return of(Position::Closed, SourceCondition::Told, BindingList::new());
        }
        let says = self.says.map(|tag| (tag, self.evidence(tag, &values[tag.binding], memory)));
        let mut powers = self.powers.iter();
        let flowing = powers.find_map(|&tag| {
            let number = values[tag.binding].good_number()?;
            let evidence = self.evidence_of_power(tag.unit, number.abs());
            matches!(evidence, Evidence::Feeds { .. }).then_some((tag, evidence))
        });
        match (says, flowing) {
            (Some((tag, Evidence::IsOff)), Some((power, _))) => {
                let basis = smallvec![tag.binding as u32, power.binding as u32];
                of(Position::Unknown, SourceCondition::PowerThoughOff, basis)
            }
            (Some((tag, Evidence::IsOff)), None) => {
                of(Position::Open, SourceCondition::Told, one(Some(tag.binding)))
            }
            (Some((tag, Evidence::Feeds { is_assumed })), _)
            | (_, Some((tag, Evidence::Feeds { is_assumed }))) => {
                let basis = one(Some(tag.binding));
                SourceReading { is_assumed, ..of(Position::Closed, SourceCondition::Told, basis) }
            }
            (Some((tag, Evidence::Open(condition))), _) => {
                of(Position::Unknown, condition, one(Some(tag.binding)))
            }
            (None, _) => {
                let basis: BindingList = self.powers.iter().map(|tag| tag.binding as u32).collect();
                let is_good = |binding: &u32| values[*binding as usize].good_number().is_some();
                let condition = match () {
                    () if basis.is_empty() && self.is_untelemetered => {
                        SourceCondition::Untelemetered
                    }
                    () if basis.is_empty() => SourceCondition::NoTag,
                    () if basis.iter().all(is_good) => SourceCondition::NoPower,
                    () => SourceCondition::NotGood,
                };
                of(Position::Unknown, condition, basis)
            }
        }
    }

    fn evidence(&self, tag: SourceTag, value: &TagValue, memory: &mut VoltageMemory) -> Evidence {
        if value.quality != Quality::Good {
            return Evidence::Open(SourceCondition::NotGood);
        }
        match &value.value {
            Some(Value::Bool(true) | Value::DoublePoint(DoublePoint::On)) => {
                Evidence::Feeds { is_assumed: false }
            }
            Some(Value::Bool(false) | Value::DoublePoint(DoublePoint::Off)) => Evidence::IsOff,
            Some(Value::DoublePoint(_)) => Evidence::Open(SourceCondition::Undecided),
            Some(Value::F64(_) | Value::I64(_)) => match value.good_number() {
                Some(number) => self.evidence_of_number(tag.unit, number, memory),
                None => Evidence::Open(SourceCondition::NotGood),
            },
            Some(Value::Text(_)) => Evidence::Open(SourceCondition::IsText),
            None => Evidence::Open(SourceCondition::NotGood),
        }
    }

    fn evidence_of_number(
        &self,
        unit: MeasuredUnit,
        number: f64,
        memory: &mut VoltageMemory,
    ) -> Evidence {
        let share = match unit {
            MeasuredUnit::Voltage(factor) => {
                self.nominal_kv.map(|nominal| number * factor / nominal)
            }
            MeasuredUnit::Share(factor) => Some(number * factor),
            MeasuredUnit::Power(_)
            | MeasuredUnit::Current(_)
            | MeasuredUnit::None
            | MeasuredUnit::Other => {
                return self.evidence_of_power(unit, number.abs());
            }
        };
        match share.and_then(|share| memory.classify(share)) {
            Some(VoltageBand::Present) => Evidence::Feeds { is_assumed: false },
            _ => Evidence::Open(SourceCondition::NoVoltage),
        }
    }

    /// Judges power by its magnitude: the sign tells of a convention, not of feeding.
    fn evidence_of_power(&self, unit: MeasuredUnit, magnitude: f64) -> Evidence {
        let mva = match (unit, self.nominal_kv) {
            (MeasuredUnit::Power(factor), _) => Some(magnitude * factor),
            (MeasuredUnit::Current(factor), Some(nominal)) => {
                Some(magnitude * factor * nominal * 3_f64.sqrt())
            }
            (MeasuredUnit::Share(factor), _) => {
                self.rating_mva.map(|rating| magnitude * factor * rating)
            }
            // Powers of stations are in megawatts, where nothing else is said.
            (MeasuredUnit::None, _) => Some(magnitude),
            _ => None,
        };
        let (is_power, is_assumed) = match self.rating_mva.zip(mva) {
            Some((rating, mva)) => (mva > rating * MIN_POWER_SHARE, unit == MeasuredUnit::None),
            None => (magnitude > 0.0, true),
        };
        match is_power {
            true => Evidence::Feeds { is_assumed },
            false => Evidence::Open(SourceCondition::NoPower),
        }
    }
}

impl SourceCondition {
    /// Tells people of it, with the name of the source; empty where there is nothing to
    /// tell.
    pub fn explain(self, id: &str) -> String {
        match self {
            Self::Told => String::new(),
            Self::NoTag => format!("nothing is known of the source {id}: it may feed"),
            Self::Untelemetered => {
                format!("no tag tells of the source {id}, by the settings: it may feed")
            }
            Self::NotGood => format!("the source {id} has no good value: it may feed"),
            Self::Undecided => format!("the source {id} is neither on nor off"),
            Self::IsText => {
                format!("the tag of the source {id} is a text, no state or number: it may feed")
            }
            Self::NoPower => format!("the source {id} is without power: it may feed all the same"),
            Self::NoVoltage => format!("the voltage of the source {id} is not surely present"),
            Self::PowerThoughOff => {
                format!("the source {id} is said to be off, and power flows")
            }
        }
    }
}
