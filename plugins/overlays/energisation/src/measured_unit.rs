//! Units of voltages and powers in the units that this overlay calculates in.

use busbar_plugin_sdk::units::{Quantity, UnitConversion};

/// Quantity of a unit, with the factor to the unit in which the overlay calculates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeasuredUnit {
    /// Voltage; the factor to kV.
    Voltage(f64),
    /// Share of the nominal value; the factor to 1.
    Share(f64),
    /// Active, reactive or apparent power; the factor to MW, Mvar or MVA.
    Power(f64),
    /// Current; the factor to kA.
    Current(f64),
    /// No unit is given.
    None,
    /// Unit of another quantity.
    Other,
}

impl MeasuredUnit {
    /// Finds a unit by its symbol, in the table that all overlays share.
    pub fn parse(symbol: &str) -> Self {
        let symbol = symbol.trim();
        if symbol.is_empty() {
            return Self::None;
        }
        let factor = |quantity, to| {
            UnitConversion::between(symbol, to, quantity).map(|conversion| conversion.apply(1.0))
        };
        let power = || {
            factor(Quantity::ActivePower, "MW")
                .or_else(|| factor(Quantity::ReactivePower, "Mvar"))
                .or_else(|| factor(Quantity::ApparentPower, "MVA"))
        };
        factor(Quantity::Voltage, "kV")
            .map(Self::Voltage)
            .or_else(|| factor(Quantity::Ratio, "1").map(Self::Share))
            .or_else(|| power().map(Self::Power))
            .or_else(|| factor(Quantity::Current, "kA").map(Self::Current))
            .unwrap_or(Self::Other)
    }
}
