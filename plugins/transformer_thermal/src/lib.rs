//! Top-oil and hot-spot temperatures of transformers from their load, by IEC 60076-7, with
//! what that does to their paper.

mod model;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Error, Host, LogLevel, Overlay, OverlayFrame, Plugin, Quality, Severity,
    TagValue,
};
pub use model::{Parameters, Temperatures};
pub use settings::{Cooling, Settings, TransformerSettings};

/// Role of a tag that is a transformer's load.
const LOAD: &str = "load";
/// Role of a tag that is the temperature of the air around it.
const AMBIENT: &str = "ambient";
/// Minutes after which it does not matter what was before: many time constants.
const MAX_MINUTES: f64 = 7.0 * 24.0 * 60.0;
const NANOS_A_MINUTE: f64 = 60e9;
/// Top oil and hot spot, degrees Celsius: limits of normal cyclic loading, and of long
/// emergency loading (IEC 60076-7, table 4, large power transformers).
const NORMAL: [f64; 2] = [105.0, 120.0];
const EMERGENCY: [f64; 2] = [115.0, 140.0];

/// The overlay.
pub struct TransformerThermal {
    settings: Settings,
    transformers: Vec<Transformer>,
    host: Host,
}

/// A transformer and where its model stands.
struct Transformer {
    parameters: Parameters,
    load: Option<usize>,
    ambient: Option<usize>,
    node: u32,
    state: Option<(Temperatures, i64)>,
}

impl Plugin for TransformerThermal {
    const ID: &'static str = "transformer_thermal";
    const NAME: &'static str = "Transformer temperatures";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Top-oil and hot-spot temperatures of transformers from their load, by IEC 60076-7.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        Ok(Self { settings, transformers: Vec::new(), host })
    }
}

impl Overlay for TransformerThermal {
    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let find = |role: &str, id: &str| {
            let is_it = |binding: &Binding| binding.role == role && binding.node_id == id;
            bindings.iter().position(is_it)
        };
        let transformer = |of: &TransformerSettings| {
            let load = find(LOAD, &of.equipment);
            // Without any bindings the settings are only tried.
            if load.is_none() && !bindings.is_empty() {
                let words = "nothing tells the load of";
                let remedy = "bind a tag to it in the role 'load'";
                self.host.log(LogLevel::Warning, &format!("{words} '{}': {remedy}", of.equipment));
            }
            let ambient = find(AMBIENT, &of.equipment);
            let node = load.map_or(0, |load| bindings[load].node);
            Transformer { parameters: of.parameters(), load, ambient, node, state: None }
        };
        self.transformers = self.settings.transformers.iter().map(transformer).collect();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let now = frame.unix_nanos();
        let Settings { transformers: settings, ambient: usual, .. } = &self.settings;
        for (transformer, settings) in self.transformers.iter_mut().zip(settings) {
            let Some(load) = transformer.load else { continue };
            // The worse of the two: the line rests on it.
            let is_bad = |binding: &usize| values[*binding].quality != Quality::Good;
            let rests_on = transformer.ambient.filter(is_bad).unwrap_or(load);
            let ambient = match transformer.ambient {
                Some(binding) => values[binding].good_number(),
                None => Some(*usual),
            };
            let measured = values[load].good_number().zip(ambient);
            if let Some((load, ambient)) = measured {
                transformer.step(now, load / settings.rated_load, ambient);
            }
            let Some((temperatures, _)) = transformer.state else { continue };
            for (caption, degrees, at) in [
                ("Top oil (model)", temperatures.top_oil, 0),
                ("Hot spot (model)", temperatures.hot_spot(), 1),
            ] {
                let severity = match degrees {
                    _ if degrees > EMERGENCY[at] => Severity::Alarm,
                    _ if degrees > NORMAL[at] => Severity::Warning,
                    _ => Severity::Normal,
                };
                let text = format!("{degrees:.1} °C");
                canvas.line(rests_on, transformer.node, severity, caption, &text)?;
                if severity > Severity::Normal {
                    canvas.tint(rests_on, transformer.node, severity)?;
                }
            }
            let ageing = temperatures.ageing(settings.upgraded_paper);
            let text = format!("× {ageing:.2}");
            canvas.line(rests_on, transformer.node, Severity::Normal, "Ageing", &text)?;
        }
        Ok(())
    }
}

impl Transformer {
    /// Moves the model on to an instant. The first time, and after a long silence, the
    /// load is taken to have been so for long.
    fn step(&mut self, now: i64, load: f64, ambient: f64) {
        let steady = || Temperatures::steady(&self.parameters, load, ambient);
        let temperatures = match self.state {
            None => steady(),
            Some((temperatures, since)) => {
                let minutes = now.saturating_sub(since) as f64 / NANOS_A_MINUTE;
                match minutes {
                    // The clock was set back: no time has passed that is known.
                    _ if minutes < 0.0 => temperatures,
                    _ if minutes > MAX_MINUTES => steady(),
                    _ => temperatures.after(&self.parameters, minutes, load, ambient),
                }
            }
        };
        self.state = Some((temperatures, now));
    }
}

busbar_plugin_sdk::export_plugin!(TransformerThermal: overlay);

#[cfg(test)]
mod tests;
