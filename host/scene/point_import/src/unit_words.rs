//! Evidence of a row's unit: a measured quantity has one, a switch position has none.

/// Meaning of a unit cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UnitNature {
    /// A unit of measurement, such as `MW` or `m³/h`.
    Measurement,
    /// Names of states, such as `open/closed`.
    States,
    /// Unknown unit or text.
    Unknown,
}

/// Limit of a unit, bytes.
const MAX_UNIT_BYTES: usize = 32;
/// Names of states that lists have in the place of a unit.
const STATES: [&str; 24] = [
    "0/1",
    "0/1/2/3",
    "0..1",
    "0..3",
    "0-1",
    "0-3",
    "on/off",
    "off/on",
    "open/close",
    "open/closed",
    "close/open",
    "closed/open",
    "o/c",
    "c/o",
    "true/false",
    "false/true",
    "t/f",
    "yes/no",
    "y/n",
    "bool",
    "boolean",
    "state",
    "status",
    "ein/aus",
];
/// Words for no unit that would be units.
const NONE: [&str; 4] = ["n/a", "na", "n.a.", "n"];
/// Units that take a prefix of the SI.
const SYMBOLS: [&str; 39] = [
    "v", "a", "w", "va", "var", "vac", "vdc", "hz", "ω", "ohm", "ohms", "s", "f", "h", "j", "wh",
    "vah", "varh", "ah", "pa", "n", "nm", "m", "g", "l", "t", "bar", "mol", "cd", "lm", "lx", "c",
    "k", "db", "wb", "bit/s", "bps", "rad", "ws",
];
/// Units without a prefix.
const WHOLE: [&str; 44] = [
    "%",
    "‰",
    "ppm",
    "ppb",
    "pu",
    "p.u.",
    "p.u",
    "°",
    "°c",
    "°f",
    "°k",
    "℃",
    "℉",
    "degc",
    "degf",
    "deg c",
    "deg f",
    "deg",
    "degrees",
    "celsius",
    "fahrenheit",
    "kelvin",
    "psi",
    "psig",
    "psia",
    "atm",
    "torr",
    "mmhg",
    "mh2o",
    "rpm",
    "r",
    "min",
    "min.",
    "d",
    "day",
    "days",
    "hour",
    "hours",
    "sec",
    "cos φ",
    "cosφ",
    "%rh",
    "ft",
    "in",
];
/// The same in Cyrillic letters, with a prefix of the SI.
const CYRILLIC: [&str; 17] = [
    "в",
    "а",
    "вт",
    "ва",
    "вар",
    "гц",
    "ом",
    "па",
    "с",
    "ч",
    "м",
    "вт·ч",
    "вт*ч",
    "втч",
    "вар·ч",
    "г",
    "л",
];
const CYRILLIC_WHOLE: [&str; 6] = ["°с", "мин", "бар", "атм", "сут", "об"];
/// Words of units in full, and in Chinese.
const WORDS: [&str; 24] = [
    "volt",
    "volts",
    "ampere",
    "amperes",
    "amp",
    "amps",
    "watt",
    "watts",
    "hertz",
    "percent",
    "伏",
    "千伏",
    "安",
    "安培",
    "瓦",
    "千瓦",
    "兆瓦",
    "兆乏",
    "千乏",
    "赫兹",
    "摄氏度",
    "度",
    "欧姆",
    "千瓦时",
];
/// Prefixes of the SI, in small letters.
const PREFIXES: [&str; 14] =
    ["k", "m", "g", "t", "µ", "μ", "u", "n", "p", "h", "c", "d", "da", "к"];
const CYRILLIC_PREFIXES: [&str; 6] = ["к", "м", "г", "т", "мк", "да"];

/// Classifies a unit cell. Case is ignored: people write `KV` and `mw`.
pub(crate) fn nature_of(unit: &str) -> UnitNature {
    let unit = unit.trim().trim_matches(|c| "[]()".contains(c)).trim();
    if unit.is_empty() || unit.len() > MAX_UNIT_BYTES {
        return UnitNature::Unknown;
    }
    let plain = unit.to_lowercase().replace('\u{2126}', "ω");
    let spaceless: String = plain.chars().filter(|c| !c.is_whitespace()).collect();
    if NONE.contains(&spaceless.as_str()) {
        return UnitNature::Unknown;
    }
    if STATES.contains(&spaceless.as_str()) {
        return UnitNature::States;
    }
    // `m³/h`, `N·m`, `1/min`.
    let parts = || plain.split(['/', '·', '*', '⋅', ' ']).filter(|part| !part.is_empty());
    let is_compound =
        parts().all(|part| part == "1" || is_factor(part)) && parts().any(|part| part != "1");
    let is_unit = is_known(&plain) || is_known(&spaceless) || is_compound;
    if is_unit { UnitNature::Measurement } else { UnitNature::Unknown }
}

/// Reports whether a part of a compound unit is a unit, with an exponent or without: `cm²`.
fn is_factor(part: &str) -> bool {
    let base = part.trim_end_matches(|c: char| "²³⁴⁻¹^-".contains(c) || c.is_ascii_digit());
    is_known(base)
}

fn is_known(unit: &str) -> bool {
    let with_prefix = |prefixes: &[&str], symbols: &[&str]| {
        symbols.contains(&unit)
            || prefixes.iter().any(|prefix| {
                unit.strip_prefix(prefix).is_some_and(|symbol| symbols.contains(&symbol))
            })
    };
    [&WHOLE[..], &CYRILLIC_WHOLE, &WORDS].iter().any(|list| list.contains(&unit))
        || with_prefix(&PREFIXES, &SYMBOLS)
        || with_prefix(&CYRILLIC_PREFIXES, &CYRILLIC)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_measurement_are_known_whatever_their_case() {
        for unit in [
            "MW",
            "mw",
            "kV",
            "KV",
            "Mvar",
            "MVAr",
            "kA",
            "A",
            "V",
            "%",
            "°C",
            "℃",
            "Hz",
            "mΩ",
            "kohm",
            "m³/h",
            "m3/h",
            "kg/cm²",
            "l/min",
            "1/min",
            "µL/L",
            "ppm",
            "MΩ·m",
            "p.u.",
            "bar",
            "kPa",
            "psi",
            "dB",
            "rpm",
            "m/s",
            "m/s²",
            "[kV]",
            "(A)",
            "кВ",
            "МВт",
            "Гц",
            "кВт·ч",
            "°С",
            "兆瓦",
            "千伏",
            "kWh",
            "MWh",
            "mA",
            "Nm",
            "s",
            "ms",
            "h",
            "deg C",
            "N·m",
            "A s",
            "%RH",
        ] {
            assert_eq!(nature_of(unit), UnitNature::Measurement, "{unit}");
        }
    }

    #[test]
    fn states_and_other_texts_are_no_unit() {
        for unit in ["0/1", "On/Off", "open / closed", "T/F", "state", "Y/N"] {
            assert_eq!(nature_of(unit), UnitNature::States, "{unit}");
        }
        for unit in ["", "-", "n/a", "none", "steps", "0", "1", "1/1x", "x", "pos", "#", "/", "123"]
        {
            assert_eq!(nature_of(unit), UnitNature::Unknown, "{unit}");
        }
    }
}
