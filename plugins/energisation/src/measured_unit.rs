//! Units of voltages and powers, as far as this overlay needs them.

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
    /// Finds a unit by its symbol. A prefix decides by its case.
    pub fn parse(symbol: &str) -> Self {
        match symbol.trim() {
            "" => Self::None,
            "V" => Self::Voltage(1e-3),
            "kV" | "KV" | "kv" => Self::Voltage(1.0),
            "MV" => Self::Voltage(1e3),
            "mV" => Self::Voltage(1e-6),
            "p.u." | "pu" | "1" | "per unit" => Self::Share(1.0),
            "%" | "percent" | "pct" => Self::Share(1e-2),
            "W" | "var" | "VAr" | "VA" => Self::Power(1e-6),
            "kW" | "kvar" | "kVAr" | "kVA" => Self::Power(1e-3),
            "MW" | "Mvar" | "MVAr" | "MVA" => Self::Power(1.0),
            "GW" | "Gvar" | "GVAr" | "GVA" => Self::Power(1e3),
            "A" => Self::Current(1e-3),
            "kA" | "KA" => Self::Current(1.0),
            "mA" => Self::Current(1e-6),
            _ => Self::Other,
        }
    }
}
