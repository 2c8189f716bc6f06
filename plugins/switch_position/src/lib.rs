//! Where switches stand: double-points (IEC 61850-7-3) to positions that the host shows by
//! moving blades and flags.

mod settings;
mod travel;

use std::collections::HashMap;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Overlay, OverlayFrame, Plugin, TagValue, Value,
};
pub use settings::{Settings, SwitchSettings};
pub use travel::Travel;

/// The overlay.
pub struct SwitchPosition {
    settings: Settings,
    mechanisms: Vec<String>,
    shown: Vec<Shown>,
}

/// A binding that is a position.
struct Shown {
    binding: usize,
    switch: usize,
    mechanism: usize,
    travel: Travel,
}

impl Plugin for SwitchPosition {
    const ID: &'static str = "switch_position";
    const NAME: &'static str = "Switch position";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Blades and flags of switches by their positions.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let mut mechanisms: Vec<String> =
            settings.switches.iter().map(|switch| switch.mechanism.clone()).collect();
        mechanisms.sort();
        mechanisms.dedup();
        Ok(Self { settings, mechanisms, shown: Vec::new() })
    }
}

impl Overlay for SwitchPosition {
    fn describe(&self) -> Description {
        Description {
            equipment: self.settings.switches.iter().map(|s| s.equipment.clone()).collect(),
            mechanisms: self.mechanisms.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let by_binding: HashMap<(&str, &str), usize> = bindings
            .iter()
            .zip(0..)
            .map(|(binding, at)| ((binding.node_id.as_str(), binding.role.as_str()), at))
            .collect();
        let shown = |(index, switch): (usize, &SwitchSettings)| {
            let own = (switch.equipment.as_str(), switch.role.as_str());
            Some(Shown {
                binding: by_binding.get(&own).copied()?,
                switch: index,
                mechanism: self.mechanisms.binary_search(&switch.mechanism).ok()?,
                travel: Travel::taking(switch.travel_seconds),
            })
        };
        self.shown = self.settings.switches.iter().enumerate().filter_map(shown).collect();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        for shown in &mut self.shown {
            // The host shows as not known what is not good, whatever is drawn.
            let travelled = match values[shown.binding].value {
                Some(Value::DoublePoint(point)) => shown.travel.at(point, frame.unix_nanos()),
                _ => None,
            };
            canvas.position(shown.binding, shown.switch, shown.mechanism, travelled)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(SwitchPosition: overlay);

#[cfg(test)]
mod tests;
