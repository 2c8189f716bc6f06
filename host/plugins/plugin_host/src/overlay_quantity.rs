//! Quantities and contours of overlay plugins, read from the C ABI.

use busbar_overlay_picture::{Contour, OverlayQuantity, Quantity};
use busbar_plugin_abi as abi;
use busbar_tags::TagHandle;

use crate::text;

/// Reads a contour of a plugin.
///
/// # Safety
/// The texts are the plugin's, alive for the call.
pub(crate) unsafe fn read_contour(raw: &abi::BusbarContour) -> Result<Contour, String> {
    let limit = |value: f64| (!value.is_nan()).then_some(value);
    // SAFETY: the caller vouches for the texts.
    let (name, unit) = unsafe { (text::read(raw.name)?, text::read(raw.unit)?) };
    Ok(Contour {
        name,
        unit,
        reach_metres: raw.reach_metres,
        low: limit(raw.low),
        high: limit(raw.high),
        step: raw.step,
    })
}

/// Reads a quantity of a plugin for the tag of its binding.
pub(crate) fn read(
    raw: &abi::BusbarOverlayQuantity,
    tag: TagHandle,
) -> Result<OverlayQuantity, String> {
    let &abi::BusbarOverlayQuantity { kind, equipment, value, .. } = raw;
    let what = match kind {
        abi::BUSBAR_QUANTITY_KIND_POSITION => {
            let travelled = (!value.is_nan()).then_some(value);
            Quantity::Position { mechanism: raw.mechanism, travelled }
        }
        abi::BUSBAR_QUANTITY_KIND_FLOW => Quantity::Flow { to: raw.to_equipment, share: value },
        abi::BUSBAR_QUANTITY_KIND_LEVEL => Quantity::Level(value),
        unknown => return Err(format!("a quantity has the unknown kind {unknown}")),
    };
    Ok(OverlayQuantity { equipment, tag, what })
}
