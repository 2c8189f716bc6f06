//! Overlay plugin `my_plugin`: a line for every value, and colour outside its band.

use busbar_plugin_sdk::{Binding, Canvas, Error, Host, Overlay, OverlayFrame, Plugin};
use busbar_plugin_sdk::{Severity, Value, export_plugin};

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Digits behind the decimal point, at most 6.
    #[schemars(range(max = 6))]
    digits: u8,
}

impl Default for Settings {
    fn default() -> Self {
        Self { digits: 1 }
    }
}

struct MyPlugin {
    settings: Settings,
    bindings: Vec<Binding>,
}

impl Plugin for MyPlugin {
    const ID: &'static str = "com.example.my_plugin";
    const NAME: &'static str = "MyPlugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Values at the equipment.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings, bindings: Vec::new() })
    }
}

impl Overlay for MyPlugin {
    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.bindings = bindings;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        for (index, (binding, state)) in self.bindings.iter().zip(frame.values()).enumerate() {
            let severity = judge(binding, state.value);
            let text = self.text(state.value, &binding.unit);
            canvas.line(index, binding.node, severity, &binding.tag_name, &text)?;
            if severity > Severity::Normal {
                canvas.tint(index, binding.node, severity)?;
            }
        }
        Ok(())
    }
}

impl MyPlugin {
    /// A value with its unit. The host adds marks for quality and age.
    fn text(&self, value: Option<Value>, unit: &str) -> String {
        let digits = usize::from(self.settings.digits);
        match value {
            None => "–".into(),
            // Few digits of a huge number are still hundreds.
            Some(Value::F64(value)) if value.abs() >= 1e9 => format!("{value:.digits$e} {unit}"),
            Some(Value::F64(value)) => format!("{value:.digits$} {unit}"),
            Some(Value::I64(value)) => format!("{value} {unit}"),
            Some(Value::Bool(value)) => (if value { "on" } else { "off" }).into(),
            Some(Value::DoublePoint(position)) => format!("{position:?}"),
        }
    }
}

/// A warning outside the normal band.
fn judge(binding: &Binding, value: Option<Value>) -> Severity {
    let Some(Value::F64(value)) = value else { return Severity::Normal };
    let below = binding.limit_low.is_some_and(|low| value < low);
    let above = binding.limit_high.is_some_and(|high| value > high);
    if below || above { Severity::Warning } else { Severity::Normal }
}

export_plugin!(MyPlugin: overlay);

#[cfg(test)]
mod tests;
