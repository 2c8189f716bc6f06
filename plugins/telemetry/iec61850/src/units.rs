//! Units of measured values: the attribute `units` of their common data class, with `SIUnit` and
//! `multiplier` (IEC 61850-7-3:2010+A1:2020, 6.5 and tables of the enumerations SIUnitKind and
//! MultiplierKind).

use iec61850_rs::proto::data::{Typed, Value};
use source_units::{TagUnit, UnitAgreement, UnreadableUnit};

use crate::service::Name;

/// Attributes of the common data classes whose value is in `units`.
const MEASURED: [&str; 7] = ["mag", "instMag", "cVal", "instCVal", "mxVal", "setMag", "subMag"];
/// Attribute of a vector that is an angle, and so not in `units`.
const ANGLE: &str = "ang";
/// Attribute of an analogue value that is in `units`; `i` is a count to be scaled.
const FLOATING: &str = "f";
/// Constraints of data objects with measured values, and of set points.
const CONSTRAINTS: [&str; 5] = ["MX", "SP", "SG", "SE", "SV"];
/// Constraint of the attribute `units`.
const CONFIGURATION: &str = "CF";

/// SIUnitKind by its number: the symbol, or the name where the symbol means another unit elsewhere.
const SI_UNITS: &[(i64, &str)] = &[
    (1, "dimensionless"),
    (2, "m"),
    (3, "kg"),
    (4, "s"),
    (5, "A"),
    (6, "K"),
    (7, "mol"),
    (8, "cd"),
    (9, "°"),
    (10, "rad"),
    (11, "sr"),
    (21, "Gy"),
    (22, "Bq"),
    (23, "°C"),
    (24, "Sv"),
    (25, "farad"),
    (26, "coulomb"),
    (27, "S"),
    (28, "H"),
    (29, "V"),
    (30, "Ω"),
    (31, "J"),
    (32, "N"),
    (33, "Hz"),
    (34, "lx"),
    (35, "lm"),
    (36, "Wb"),
    (37, "tesla"),
    (38, "W"),
    (39, "Pa"),
    (41, "m²"),
    (42, "m³"),
    (43, "m/s"),
    (44, "m/s²"),
    (45, "m³/s"),
    (46, "m/m³"),
    (47, "M"),
    (48, "kg/m³"),
    (49, "m²/s"),
    (50, "W/m K"),
    (51, "J/K"),
    (52, "ppm"),
    (53, "1/s"),
    (54, "rad/s"),
    (55, "W/m²"),
    (56, "J/m²"),
    (57, "S/m"),
    (58, "K/s"),
    (59, "Pa/s"),
    (60, "J/kg K"),
    (61, "VA"),
    (62, "W"),
    (63, "var"),
    (64, "phi"),
    (65, "cos(phi)"),
    (66, "Vs"),
    (67, "V²"),
    (68, "As"),
    (69, "A²"),
    (70, "A²t"),
    (71, "VAh"),
    (72, "Wh"),
    (73, "varh"),
    (74, "V/Hz"),
    (75, "Hz/s"),
    (76, "char"),
    (77, "char/s"),
    (78, "kgm²"),
    (79, "dB"),
    (80, "J/Wh"),
    (81, "W/s"),
    (82, "l/s"),
    (83, "dBm"),
    (84, "h"),
    (85, "min"),
    (86, "Ω/m"),
    (87, "percent/s"),
];

/// MultiplierKind by its power of ten.
const PREFIXES: &[(i64, &str)] = &[
    (-12, "p"),
    (-9, "n"),
    (-6, "µ"),
    (-3, "m"),
    (-2, "c"),
    (-1, "d"),
    (0, ""),
    (1, "da"),
    (2, "h"),
    (3, "k"),
    (6, "M"),
    (9, "G"),
    (12, "T"),
];

/// Units by multiplier and SIUnitKind that have a name of their own.
const NAMED: &[(i64, i64, &str)] = &[(5, 39, "bar"), (3, 3, "t")];

/// Unit of a measured value, as its server states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StatedUnit {
    si_unit: i64,
    multiplier: i64,
}

impl StatedUnit {
    /// Reads the attribute `units`; none where it states nothing, as with the number 0.
    ///
    /// # Errors
    /// Parts that are no integers.
    pub(crate) fn from_value(value: &Value) -> Result<Option<Self>, UnreadableUnit> {
        let part = |index: usize| {
            let number = |part: &Value| {
                part.as_i64().or_else(|| part.as_u64().and_then(|number| number.try_into().ok()))
            };
            value.member(index).map(|part| number(part).ok_or(UnreadableUnit)).transpose()
        };
        let si_unit = part(0)?.ok_or(UnreadableUnit)?;
        let multiplier = part(1)?.unwrap_or(0);
        Ok((si_unit != 0).then_some(Self { si_unit, multiplier }))
    }

    /// Describes the unit by its symbol, or by its numbers.
    pub(crate) fn in_words(self) -> String {
        let Self { si_unit, multiplier } = self;
        let named = NAMED.iter().find(|(power, unit, _)| (*power, *unit) == (multiplier, si_unit));
        if let Some((.., symbol)) = named {
            return (*symbol).to_owned();
        }
        let base = self.base();
        match PREFIXES.iter().find(|(power, _)| *power == multiplier) {
            Some((_, prefix)) => format!("{prefix}{base}"),
            None => format!("10^{multiplier} {base}"),
        }
    }

    fn base(self) -> String {
        let found = SI_UNITS.iter().find(|(number, _)| *number == self.si_unit);
        found.map_or_else(|| format!("SIUnit {}", self.si_unit), |(_, symbol)| (*symbol).to_owned())
    }

    /// Compares the unit with that of a tag. A power of ten more or less is another unit, also
    /// where its symbol is not usual.
    pub(crate) fn compare(self, unit: &TagUnit) -> UnitAgreement {
        let whole = self.in_words();
        match unit.compare([whole.as_str()]) {
            UnitAgreement::Unknown if self.multiplier != 0 => match unit.compare([&*self.base()]) {
                UnitAgreement::Agrees | UnitAgreement::Conflicts => UnitAgreement::Conflicts,
                agreement => agreement,
            },
            agreement => agreement,
        }
    }
}

/// Returns the variable that has the unit of a value; none where its class has no `units`.
/// `names` lead from the data object to the value.
pub(crate) fn variable_of_unit(object: &Name, names: &[String]) -> Option<Name> {
    let mut parts = object.item.split('$');
    let (node, constraint) = (parts.next()?, parts.next()?);
    let (holders, value) =
        names.split_at(names.iter().position(|name| MEASURED.contains(&name.as_str()))?);
    let is_angle = value.iter().any(|name| name == ANGLE);
    let is_floating = value.last().is_some_and(|name| name == FLOATING);
    if is_angle || !is_floating || !CONSTRAINTS.contains(&constraint) {
        return None;
    }
    let path = parts.chain(holders.iter().map(String::as_str)).chain(["units"]);
    let item = path.fold(format!("{node}${CONFIGURATION}"), |item, part| format!("{item}${part}"));
    Some(Name { domain: object.domain.clone(), item })
}

#[cfg(test)]
#[path = "units_tests.rs"]
mod tests;
