//! Results of methods, with their rules and margins.

use std::fmt;

use crate::Gas;

/// Result of a method. Names ([`Zone::name`]) are those of the methods' sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Zone {
    /// Normal state of Rogers ratios.
    Normal,
    /// No fault: the gases are too little for the method (Doernenburg).
    NoFault,
    /// Partial discharges of corona type.
    PartialDischarge,
    /// Discharges of any kind (Doernenburg).
    Discharge,
    /// Discharges of low energy.
    LowEnergy,
    /// Discharges of low energy and overheating (DL/T 722).
    LowEnergyThermal,
    /// Discharges of high energy.
    HighEnergy,
    /// Discharges of high energy and overheating (DL/T 722).
    HighEnergyThermal,
    /// Discharges and overheating (triangle 1).
    DischargeThermal,
    /// Overheating of any kind (Doernenburg).
    Thermal,
    /// Overheating below 150 °C (DL/T 722).
    Thermal0,
    /// Overheating below 300 °C.
    Thermal1,
    /// Overheating from 300 °C to 700 °C.
    Thermal2,
    /// Overheating above 700 °C.
    Thermal3,
    /// Overheating above 700 °C in oil alone (pentagon 2).
    Thermal3Oil,
    /// Paper may be carbonised.
    Carbonisation,
    /// Overheating of oil below 250 °C.
    Overheating,
    /// Stray gassing of oil.
    StrayGassing,
    /// No zone of the method fits.
    NotDetermined,
    /// The method has no input, or does not apply.
    NotApplicable,
}

impl Zone {
    /// All results of all methods.
    pub const ALL: [Self; 20] = [
        Self::Normal,
        Self::NoFault,
        Self::PartialDischarge,
        Self::Discharge,
        Self::LowEnergy,
        Self::LowEnergyThermal,
        Self::HighEnergy,
        Self::HighEnergyThermal,
        Self::DischargeThermal,
        Self::Thermal,
        Self::Thermal0,
        Self::Thermal1,
        Self::Thermal2,
        Self::Thermal3,
        Self::Thermal3Oil,
        Self::Carbonisation,
        Self::Overheating,
        Self::StrayGassing,
        Self::NotDetermined,
        Self::NotApplicable,
    ];

    /// Returns the short name of the zone.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "N",
            Self::NoFault => "NF",
            Self::PartialDischarge => "PD",
            Self::Discharge => "D",
            Self::LowEnergy => "D1",
            Self::LowEnergyThermal => "D1T",
            Self::HighEnergy => "D2",
            Self::HighEnergyThermal => "D2T",
            Self::DischargeThermal => "DT",
            Self::Thermal => "T",
            Self::Thermal0 => "T0",
            Self::Thermal1 => "T1",
            Self::Thermal2 => "T2",
            Self::Thermal3 => "T3",
            Self::Thermal3Oil => "T3H",
            Self::Carbonisation => "C",
            Self::Overheating => "O",
            Self::StrayGassing => "S",
            Self::NotDetermined => "ND",
            Self::NotApplicable => "NA",
        }
    }
}

impl fmt::Display for Zone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Margin of a sample to another result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Margin {
    /// Least factor (at least 1) by which one gas alone must grow or shrink.
    Factor {
        /// Gas that must change.
        gas: Gas,
        /// Factor of the change; 1.15 is the usual error of laboratories.
        factor: f64,
    },
    /// Distance to the nearest border of a zone, in the plane of a triangle with sides of 100, or
    /// of a pentagon with axes in percent.
    Distance(f64),
}

/// Result of a method with its reasons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Zone of the sample.
    pub zone: Zone,
    /// Rule that gave the result, in words and symbols.
    pub rule: &'static str,
    /// Margin to another result; `None` where no change of one gas leads there, or the method does
    /// not apply.
    pub margin: Option<Margin>,
    /// Source of the rule.
    pub source: &'static str,
}

/// Rule of a method whose gases are absent or all 0.
pub(crate) const NO_INPUT: &str = "a gas of this method is absent, or all of them are 0";
