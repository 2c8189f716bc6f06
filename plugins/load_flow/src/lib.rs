//! Load flow: active power at feeders and transformers as arrows, by their share of the
//! rating (after Overbye and others, visualisation of power systems).

mod settings;

use std::collections::HashMap;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Overlay, OverlayFrame, Plugin, Severity,
};
pub use settings::{FlowSettings, Settings};

/// Role of the tags of active power.
const ROLE: &str = "active_power";

/// The overlay.
pub struct LoadFlow {
    settings: Settings,
    shown: Vec<Shown>,
}

/// A binding that is a flow.
struct Shown {
    binding: usize,
    node: u32,
    flow: usize,
    /// Of the unit of the tag.
    megawatts: f64,
}

impl Plugin for LoadFlow {
    const ID: &'static str = "load_flow";
    const NAME: &'static str = "Load flow";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Active power as arrows, by its share of the rating.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        match settings.fault() {
            Some(fault) => Err(Error::settings(fault)),
            None => Ok(Self { settings, shown: Vec::new() }),
        }
    }
}

impl Overlay for LoadFlow {
    fn describe(&self) -> Description {
        let ends = |flow: &FlowSettings| [flow.from.clone(), flow.to.clone()];
        Description {
            equipment: self.settings.flows.iter().flat_map(ends).collect(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let flows: HashMap<&str, usize> = self
            .settings
            .flows
            .iter()
            .zip(0..)
            .map(|(f, at)| (f.measured_at.as_str(), at))
            .collect();
        let mut shown = Vec::new();
        for (index, binding) in bindings.iter().enumerate().filter(|(_, b)| b.role == ROLE) {
            let Some(&flow) = flows.get(binding.node_id.as_str()) else { continue };
            let megawatts = match binding.unit.as_str() {
                "W" => 1e-6,
                "kW" => 1e-3,
                "MW" => 1.0,
                "GW" => 1e3,
                other => {
                    let tag = &binding.tag_id;
                    let fault = format!("tag {tag} is in '{other}': give it in W, kW, MW or GW");
                    return Err(Error::settings(fault));
                }
            };
            shown.push(Shown { binding: index, node: binding.node, flow, megawatts });
        }
        self.shown = shown;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<_> = frame.values().collect();
        for &Shown { binding, node, flow, megawatts } in &self.shown {
            // The last one stays where it is not good: the host marks it.
            let Some(power) = values[binding].number().map(|value| value * megawatts) else {
                canvas.line(binding, node, Severity::Normal, "Active power", "–")?;
                canvas.flow(binding, [2 * flow, 2 * flow + 1], 0.0)?;
                continue;
            };
            let share = power / self.settings.flows[flow].rating_mva;
            let is_over = share.abs() > 1.0;
            let severity = if is_over { Severity::Warning } else { Severity::Normal };
            let text = format!("{} MW  {:.0} %", rounded(power), share.abs() * 100.0);
            canvas.line(binding, node, severity, "Active power", &text)?;
            canvas.flow(binding, [2 * flow, 2 * flow + 1], share)?;
        }
        Ok(())
    }
}

/// Three digits, as far as they say anything.
fn rounded(megawatts: f64) -> String {
    let digits = match megawatts.abs() {
        size if size >= 99.95 => 0,
        size if size >= 9.995 => 1,
        _ => 2,
    };
    format!("{megawatts:.digits$}")
}

busbar_plugin_sdk::export_plugin!(LoadFlow: overlay);

#[cfg(test)]
mod tests;
