//! Conversion of a tag's values to the unit of a setting, whatever its quantity.

use busbar_plugin_sdk::Binding;
use busbar_plugin_sdk::units::{Quantity, UnitConversion};

/// Quantities that a unit is looked for in: a symbol such as `%` has several.
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

/// Finds the conversion of a binding's values to a unit. A binding without a unit is assumed
/// to have the one wanted; a unit that no table knows must be the same.
///
/// # Errors
/// The finding: tag, place, both units, and a remedy.
pub(crate) fn conversion(binding: &Binding, to: &str) -> Result<UnitConversion, String> {
    let (from, to) = (binding.unit.trim(), to.trim());
    if from == to {
        return Ok(UnitConversion::IDENTITY);
    }
    if from.is_empty() {
        return Ok(assumed(UnitConversion::IDENTITY));
    }
    let found = QUANTITIES.into_iter().find_map(|quantity| {
        let there = UnitConversion::between(from, to, quantity)?;
        let back = UnitConversion::between(to, from, quantity)?;
        Some((there, back.reference))
    });
    match found {
        Some((there, to)) if there.reference == to => Ok(there),
        // Absolute or gauge: one of them does not say.
        Some((there, to)) if there.reference.is_none() || to.is_none() => Ok(assumed(there)),
        _ => Err(format!(
            "the tag '{}' in the role '{}' at '{}' has the unit '{from}', which cannot be \
             converted to '{to}'; give the tag or the settings the unit of its values",
            binding.tag_id, binding.role, binding.node_id,
        )),
    }
}

fn assumed(mut conversion: UnitConversion) -> UnitConversion {
    conversion.is_assumed = true;
    conversion
}
