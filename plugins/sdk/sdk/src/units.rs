//! Units of measured values: one table for all overlays, and conversion within a quantity.
//!
//! Symbols are those of ISO 80000 and of devices' point lists. A prefix decides by its case
//! (`mA`, `MA`), so letters of the other case are taken only where no prefix is in doubt.

use crate::Binding;

/// Physical quantity of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Temperature on a scale; base unit °C.
    Temperature,
    /// Pressure; base unit Pa.
    Pressure,
    /// Electric current; base unit A.
    Current,
    /// Voltage; base unit V.
    Voltage,
    /// Active power; base unit W.
    ActivePower,
    /// Reactive power; base unit var.
    ReactivePower,
    /// Apparent power; base unit VA.
    ApparentPower,
    /// Ratio of two like quantities; base unit 1.
    Ratio,
    /// Volume of a gas in a volume of oil or gas; base unit ppm (µL/L).
    Concentration,
    /// Mass by volume; base unit kg/m3.
    Density,
}

/// Zero of a pressure scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressureReference {
    /// Zero of the scale at vacuum.
    Absolute,
    /// Zero of the scale at the pressure of the surrounding air.
    Gauge,
}

/// Row of the unit table: base = value · factor + offset.
struct Unit {
    quantity: Quantity,
    symbols: &'static [&'static str],
    factor: f64,
    offset: f64,
}

const fn unit(quantity: Quantity, factor: f64, symbols: &'static [&'static str]) -> Unit {
    Unit { quantity, symbols, factor, offset: 0.0 }
}

static UNITS: &[Unit] = &[
    unit(Quantity::Temperature, 1.0, &["°C", "℃", "degC", "deg C", "C", "Cel", "ºC"]),
    Unit {
        quantity: Quantity::Temperature,
        symbols: &["°F", "℉", "degF", "deg F", "F", "ºF"],
        factor: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
    Unit { quantity: Quantity::Temperature, symbols: &["K"], factor: 1.0, offset: -273.15 },
    unit(Quantity::Pressure, 1.0, &["Pa"]),
    unit(Quantity::Pressure, 100.0, &["hPa", "mbar"]),
    unit(Quantity::Pressure, 1e3, &["kPa"]),
    unit(Quantity::Pressure, 1e5, &["bar"]),
    unit(Quantity::Pressure, 1e6, &["MPa"]),
    unit(Quantity::Pressure, 98_066.5, &["kgf/cm2", "kgf/cm²", "kg/cm2", "kg/cm²", "at"]),
    unit(Quantity::Pressure, 101_325.0, &["atm"]),
    // Pound-force by square inch: 0.45359237 kg · 9.80665 m/s2 / (25.4 mm)2.
    unit(Quantity::Pressure, 6_894.757_293_168, &["psi", "lbf/in2", "lbf/in²"]),
    unit(Quantity::Current, 1.0, &["A", "Amp", "Amps", "ampere"]),
    unit(Quantity::Current, 1e-6, &["µA", "μA", "uA"]),
    unit(Quantity::Current, 1e-3, &["mA"]),
    unit(Quantity::Current, 1e3, &["kA"]),
    unit(Quantity::Voltage, 1.0, &["V", "Volt", "Volts"]),
    unit(Quantity::Voltage, 1e-3, &["mV"]),
    unit(Quantity::Voltage, 1e3, &["kV"]),
    unit(Quantity::Voltage, 1e6, &["MV"]),
    unit(Quantity::ActivePower, 1.0, &["W", "Watt", "Watts"]),
    unit(Quantity::ActivePower, 1e3, &["kW"]),
    unit(Quantity::ActivePower, 1e6, &["MW"]),
    unit(Quantity::ActivePower, 1e9, &["GW"]),
    unit(Quantity::ReactivePower, 1.0, &["var"]),
    unit(Quantity::ReactivePower, 1e3, &["kvar"]),
    unit(Quantity::ReactivePower, 1e6, &["Mvar"]),
    unit(Quantity::ReactivePower, 1e9, &["Gvar"]),
    unit(Quantity::ApparentPower, 1.0, &["VA"]),
    unit(Quantity::ApparentPower, 1e3, &["kVA"]),
    unit(Quantity::ApparentPower, 1e6, &["MVA"]),
    unit(Quantity::ApparentPower, 1e9, &["GVA"]),
    unit(Quantity::Ratio, 1.0, &["1", "p.u.", "pu", "per unit"]),
    unit(Quantity::Ratio, 1e-2, &["%", "percent", "pct"]),
    unit(Quantity::Ratio, 1e-3, &["‰"]),
    unit(Quantity::Concentration, 1.0, &["ppm", "µL/L", "μL/L", "uL/L", "ul/l", "ppmv"]),
    unit(Quantity::Concentration, 1e4, &["%", "vol%", "% vol"]),
    unit(Quantity::Density, 1.0, &["kg/m3", "kg/m³", "g/l", "g/L"]),
];

/// Quantities that a unit of a setting is looked for in: a symbol such as `%` has several.
const QUANTITIES: [Quantity; 10] = [
    Quantity::Ratio,
    Quantity::Concentration,
    Quantity::Temperature,
    Quantity::Pressure,
    Quantity::Current,
    Quantity::Voltage,
    Quantity::ActivePower,
    Quantity::ReactivePower,
    Quantity::ApparentPower,
    Quantity::Density,
];

/// Longest list of units that a fault names.
const MAX_NAMED_UNITS: usize = 8;

/// Linear conversion of a value from one unit to another of the same quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitConversion {
    factor: f64,
    offset: f64,
    /// Zero of the pressure scale that the unit itself names, as `bar(g)` does.
    pub reference: Option<PressureReference>,
    /// Reports whether the unit was missing and the one wanted was assumed.
    pub is_assumed: bool,
}

impl UnitConversion {
    /// Conversion that leaves values as they are.
    pub const IDENTITY: Self =
        Self { factor: 1.0, offset: 0.0, reference: None, is_assumed: false };

    /// Finds the conversion from a unit to another; `None` where one of them is none of the
    /// quantity.
    pub fn between(from: &str, to: &str, quantity: Quantity) -> Option<Self> {
        let (from, reference) = find(from, quantity)?;
        let (to, _) = find(to, quantity)?;
        Some(Self {
            factor: from.factor / to.factor,
            offset: (from.offset - to.offset) / to.factor,
            reference,
            is_assumed: false,
        })
    }

    /// Finds the conversion of a binding's values to a unit. A binding without a unit is assumed to
    /// have the one wanted.
    ///
    /// # Errors
    /// The finding for [`crate::Description::findings`]: tag, place, unit, and those that
    /// are taken.
    pub fn for_binding(binding: &Binding, quantity: Quantity, to: &str) -> Result<Self, String> {
        if binding.unit.trim().is_empty() {
            return Ok(Self { is_assumed: true, ..Self::IDENTITY });
        }
        Self::between(&binding.unit, to, quantity).ok_or_else(|| {
            format!(
                "the tag '{}' in the role '{}' at '{}' has the unit '{}', which is no unit of {}; \
                 give the tag one of {}, as its source has it",
                binding.tag_id,
                binding.role,
                binding.node_id,
                binding.unit,
                quantity.name(),
                quantity.symbols(),
            )
        })
    }

    /// Converts a value to the unit wanted.
    pub fn apply(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }
}

impl UnitConversion {
    /// Returns the conversion of a binding's values to the unit of a setting, whatever its
    /// quantity. A binding without a unit is assumed to have the one wanted. A unit that no
    /// table knows must be the same.
    ///
    /// # Errors
    /// The finding for [`crate::Description::findings`]: tag, place, both units, and a
    /// remedy.
    pub fn of_binding_to(binding: &Binding, to: &str) -> Result<Self, String> {
        let (from, to) = (binding.unit.trim(), to.trim());
        if from == to {
            return Ok(Self::IDENTITY);
        }
        if from.is_empty() {
            return Ok(Self { is_assumed: true, ..Self::IDENTITY });
        }
        let found = QUANTITIES.into_iter().find_map(|quantity| {
            let there = Self::between(from, to, quantity)?;
            let back = Self::between(to, from, quantity)?;
            Some((there, back.reference))
        });
        match found {
            Some((there, to)) if there.reference == to => Ok(there),
            // Absolute or gauge: one of them does not say.
            Some((there, to)) if there.reference.is_none() || to.is_none() => {
                Ok(Self { is_assumed: true, ..there })
            }
            _ => Err(format!(
                "the tag '{}' in the role '{}' at '{}' has the unit '{from}', which cannot be \
                 converted to '{to}'; give the tag or the settings the unit of its values",
                binding.tag_id, binding.role, binding.node_id,
            )),
        }
    }
}

impl Quantity {
    /// Returns the name of the quantity, for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Temperature => "temperature",
            Self::Pressure => "pressure",
            Self::Current => "current",
            Self::Voltage => "voltage",
            Self::ActivePower => "active power",
            Self::ReactivePower => "reactive power",
            Self::ApparentPower => "apparent power",
            Self::Ratio => "a ratio",
            Self::Concentration => "concentration",
            Self::Density => "density",
        }
    }

    /// Finds the quantity of a unit; the first in the table where several have it.
    pub fn from_unit(unit: &str) -> Option<Self> {
        let unit = unit.trim();
        let has = |row: &&Unit| find(unit, row.quantity).is_some();
        UNITS.iter().find(has).map(|row| row.quantity)
    }

    /// Lists the units of the quantity, for messages.
    fn symbols(self) -> String {
        let rows = UNITS.iter().filter(|row| row.quantity == self);
        let symbols: Vec<&str> = rows.take(MAX_NAMED_UNITS).map(|row| row.symbols[0]).collect();
        symbols.join(", ")
    }
}

fn find(text: &str, quantity: Quantity) -> Option<(&'static Unit, Option<PressureReference>)> {
    let text = text.trim();
    if let Some(unit) = find_symbol(text, quantity) {
        return Some((unit, None));
    }
    if quantity != Quantity::Pressure {
        return None;
    }
    // "at" is a unit of its own and was found above: what is left of these is a suffix.
    let lower = text.to_lowercase();
    let references = [
        (PressureReference::Gauge, &["(gauge)", "gauge", "(rel)", "rel", "(g)", "g"][..]),
        (PressureReference::Absolute, &["(abs)", "abs", "(a)", "a"][..]),
    ];
    references.into_iter().find_map(|(reference, suffixes)| {
        suffixes.iter().find_map(|suffix| {
            let rest = lower.strip_suffix(suffix)?;
            let unit =
                find_symbol(text.get(..rest.len())?.trim_end_matches(['.', ' ', '_']), quantity)?;
            Some((unit, Some(reference)))
        })
    })
}

fn find_symbol(text: &str, quantity: Quantity) -> Option<&'static Unit> {
    let of_quantity = || UNITS.iter().filter(move |row| row.quantity == quantity);
    let exact = of_quantity().find(|row| row.symbols.contains(&text));
    exact.or_else(|| {
        let is_alike = |symbol: &&str| {
            let is_same = symbol.to_lowercase() == text.to_lowercase();
            is_same && starts_with_m(symbol) == starts_with_m(text)
        };
        of_quantity().find(|row| row.symbols.iter().any(is_alike))
    })
}

/// Returns the first letter, where it may be milli or mega.
fn starts_with_m(symbol: &str) -> Option<char> {
    symbol.chars().next().filter(|first| matches!(first, 'm' | 'M'))
}

#[cfg(test)]
#[path = "units_tests.rs"]
mod tests;
