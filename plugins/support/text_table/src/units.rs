//! Units that stand in cells or in a row of units, with their spellings.

/// Units by quantity: the spelling that stands for all, then the others. Case counts, as in
/// MW and mW.
const UNITS: &[&[&str]] = &[
    &["%", "percent", "pct"],
    &["‰"],
    &["°C", "ºC", "℃", "degC", "deg C", "DegC", "C", "grd C", "Grad C"],
    &["°F", "ºF", "℉", "degF", "deg F", "DegF", "F"],
    &["K", "Kelvin"],
    &["A", "Amp", "Amps"],
    &["mA"],
    &["kA"],
    &["V", "Volt", "Volts"],
    &["mV"],
    &["kV", "KV"],
    &["W"],
    &["kW", "KW"],
    &["MW"],
    &["GW"],
    &["var", "VAr", "VAR", "Var"],
    &["kvar", "kVAr", "kVAR", "kVar"],
    &["Mvar", "MVAr", "MVAR", "MVar"],
    &["VA"],
    &["kVA", "KVA"],
    &["MVA"],
    &["Wh"],
    &["kWh", "KWH"],
    &["MWh", "MWH"],
    &["GWh", "GWH"],
    &["kvarh", "kVArh"],
    &["Mvarh", "MVArh"],
    &["Hz"],
    &["kHz"],
    &["MHz"],
    &["Pa"],
    &["hPa"],
    &["kPa"],
    &["MPa"],
    &["mbar"],
    &["bar", "Bar"],
    &["psi", "PSI"],
    &["ppm", "PPM"],
    &["ppb"],
    &["µl/l", "μl/l", "ul/l", "µL/L", "μL/L", "uL/L"],
    &["ms"],
    &["s", "sec"],
    &["min"],
    &["h"],
    &["mm"],
    &["cm"],
    &["m"],
    &["km"],
    &["m/s"],
    &["l/min", "L/min"],
    &["m³/h", "m3/h"],
    &["l", "L"],
    &["kg"],
    &["t"],
    &["g/m³", "g/m3"],
    &["kg/m³", "kg/m3"],
    &["1/min", "rpm", "min-1"],
    &["°", "deg"],
    &["Ω", "\u{2126}", "Ohm", "ohm"],
    &["mΩ", "mOhm"],
    &["kΩ", "kOhm"],
    &["MΩ", "MOhm"],
    &["dB"],
    &["dBm"],
    &["p.u.", "pu", "PU"],
    &["pC"],
    &["nC"],
];

/// Finds the spelling that stands for all spellings of a unit.
pub fn find_unit(text: &str) -> Option<&'static str> {
    let text = text.trim();
    let spellings = UNITS.iter().find(|spellings| spellings.contains(&text))?;
    spellings.first().copied()
}

/// Reports two units that differ for certain: both are known, and not the same.
pub fn units_conflict(one: &str, other: &str) -> bool {
    one.trim() != other.trim()
        && matches!((find_unit(one), find_unit(other)), (Some(one), Some(other)) if one != other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_is_of_one_unit() {
        let all: Vec<&str> = UNITS.iter().flat_map(|spellings| spellings.iter().copied()).collect();
        for spelling in &all {
            assert_eq!(all.iter().filter(|other| *other == spelling).count(), 1, "{spelling}");
        }
    }

    #[test]
    fn units_conflict_where_both_are_known() {
        for (one, other, is_conflict) in [
            ("°C", "degC", false),
            ("°C", "°F", true),
            ("A", "kA", true),
            ("MW", "mW", false),
            ("°C", "apples", false),
            ("", "V", false),
        ] {
            assert_eq!(units_conflict(one, other), is_conflict, "{one} {other}");
        }
    }
}
