//! Contour: levels of one quantity at equipment, whose course over the ground the host
//! works out and draws.

mod settings;

use std::collections::HashMap;

use busbar_plugin_sdk::{Binding, Canvas, Description, Error, Host, Overlay, OverlayFrame, Plugin};
pub use settings::Settings;

/// The overlay.
pub struct Contour {
    settings: Settings,
    /// Of each binding that is a level: its index, and that of the equipment.
    shown: Vec<[usize; 2]>,
}

impl Plugin for Contour {
    const ID: &'static str = "contour";
    const NAME: &'static str = "Contour";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "The course of a quantity over the ground.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        match settings.fault() {
            Some(fault) => Err(Error::settings(fault)),
            None => Ok(Self { settings, shown: Vec::new() }),
        }
    }
}

impl Overlay for Contour {
    fn describe(&self) -> Description {
        let Settings { name, unit, equipment, reach_metres, low, high, step, .. } = &self.settings;
        Description {
            equipment: equipment.clone(),
            contour: Some(busbar_plugin_sdk::Contour {
                name: name.clone(),
                unit: unit.clone(),
                reach_metres: *reach_metres,
                low: *low,
                high: *high,
                step: *step,
            }),
            starts_hidden: !self.settings.shown,
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let described: HashMap<&str, usize> =
            self.settings.equipment.iter().zip(0..).map(|(id, at)| (id.as_str(), at)).collect();
        let mut shown = Vec::new();
        for (index, binding) in bindings.iter().enumerate() {
            let equipment = described.get(binding.node_id.as_str());
            if let Some(&equipment) = equipment.filter(|_| binding.role == self.settings.role) {
                if binding.unit != self.settings.unit {
                    let (tag, unit, wanted) = (&binding.tag_id, &binding.unit, &self.settings.unit);
                    let fault = format!("tag {tag} is in '{unit}': the contour is in '{wanted}'");
                    return Err(Error::settings(fault));
                }
                shown.push([index, equipment]);
            }
        }
        self.shown = shown;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<_> = frame.values().collect();
        for &[binding, equipment] in &self.shown {
            // Without a value too: the host draws that there is no data.
            let value = values[binding].number().unwrap_or_default();
            canvas.level(binding, equipment, value)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(Contour: overlay);

#[cfg(test)]
mod tests;
