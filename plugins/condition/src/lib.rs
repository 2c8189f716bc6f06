//! Condition monitoring: quantities against a threshold of attention and one of alarm,
//! such as arrester currents, partial discharge, loss factors, core currents.

mod settings;

use std::collections::HashMap;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Quality, Severity, TagValue,
};
pub use settings::{QuantitySettings, Settings, Side};

const ATTENTION: [u8; 3] = [0xc9, 0xa2, 0x27];
const ALARM: [u8; 3] = [0xc0, 0x22, 0x2b];

/// The overlay.
pub struct Condition {
    settings: Settings,
    watched: Vec<Watched>,
}

/// A binding that is judged.
struct Watched {
    binding: usize,
    node: u32,
    equipment: Option<usize>,
    quantity: usize,
    unit: String,
}

impl Plugin for Condition {
    const ID: &'static str = "condition";
    const NAME: &'static str = "Condition";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Monitored quantities against attention and alarm.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        Ok(Self { settings, watched: Vec::new() })
    }
}

impl Overlay for Condition {
    fn describe(&self) -> Description {
        let entries = |of: &QuantitySettings| {
            let entry = |what: &str, color, pattern| LegendEntry {
                name: format!("{} {what}", of.name),
                color,
                pattern,
            };
            [
                entry("attention", ATTENTION, Pattern::Dotted),
                entry("alarm", ALARM, Pattern::Crossed),
            ]
        };
        Description {
            legend: self.settings.quantities.iter().flat_map(entries).collect(),
            equipment: self.settings.equipment.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let Settings { quantities, equipment } = &self.settings;
        let described: HashMap<&str, usize> =
            equipment.iter().zip(0..).map(|(id, at)| (id.as_str(), at)).collect();
        let watched = |(index, binding): (usize, Binding)| {
            Some(Watched {
                quantity: quantities.iter().position(|of| of.role == binding.role)?,
                equipment: described.get(binding.node_id.as_str()).copied(),
                binding: index,
                node: binding.node,
                unit: binding.unit,
            })
        };
        self.watched = bindings.into_iter().enumerate().filter_map(watched).collect();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        // Of what is wrong at a piece of equipment, the worst shows: it comes last.
        let mut shown: Vec<(Severity, usize, usize, usize)> = Vec::new();
        for watched in &self.watched {
            let &Watched { binding, quantity, equipment, node, ref unit } = watched;
            let of = &self.settings.quantities[quantity];
            let tag = &values[binding];
            let severity = match tag.good_number() {
                Some(value) => of.judge(value),
                None => Severity::Normal,
            };
            if let Some(equipment) = equipment {
                let entry = 2 * quantity + usize::from(severity == Severity::Alarm);
                // The host shows as unknown what rests on a value that is not good.
                if severity > Severity::Normal || tag.quality != Quality::Good {
                    shown.push((severity, binding, equipment, entry));
                }
            }
            if let (Some(value), true) = (tag.good_number(), severity > Severity::Normal) {
                let text = format!("{value:.2} {unit}");
                canvas.line(binding, node, severity, &of.name, text.trim_end())?;
            }
        }
        shown.sort_by_key(|(severity, ..)| *severity);
        for (_, binding, equipment, entry) in shown {
            canvas.state(binding, equipment, entry)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(Condition: overlay);

#[cfg(test)]
mod tests;
