//! Overlay plugin `my_plugin`: a line for every value, colour outside its band, and a verdict
//! on every piece of equipment.

use busbar_plugin_sdk::{Binding, Canvas, Description, Error, Host, Judgment, Overlay};
use busbar_plugin_sdk::{OverlayFrame, Plugin, Severity, TagValue, Value, export_plugin};

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
    /// Equipment that bindings name, each with its bindings.
    equipment: Vec<(String, Vec<usize>)>,
}

impl Plugin for MyPlugin {
    const ID: &'static str = "com.example.my_plugin";
    const NAME: &'static str = "MyPlugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Values at the equipment.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings, bindings: Vec::new(), equipment: Vec::new() })
    }
}

impl Overlay for MyPlugin {
    fn describe(&self) -> Description {
        let equipment = self.equipment.iter().map(|(id, _)| id.clone()).collect();
        Description { equipment, ..Description::default() }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.equipment.clear();
        for (index, binding) in bindings.iter().enumerate() {
            match self.equipment.iter_mut().find(|(id, _)| *id == binding.node_id) {
                Some((_, own)) => own.push(index),
                None => self.equipment.push((binding.node_id.clone(), vec![index])),
            }
        }
        self.bindings = bindings;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        for (index, (binding, state)) in self.bindings.iter().zip(&values).enumerate() {
            let severity = judge(binding, state.value.as_ref());
            let text = self.text(state.value.as_ref(), &binding.unit);
            canvas.line(index, binding.node, severity, &binding.tag_name, &text)?;
            if severity > Severity::Normal {
                canvas.tint(index, binding.node, severity)?;
            }
        }
        for index in 0..self.equipment.len() {
            self.judge_equipment(index, &values, canvas)?;
        }
        Ok(())
    }
}

impl MyPlugin {
    /// Formats a value with its unit. The host adds marks for quality and age.
    fn text(&self, value: Option<&Value>, unit: &str) -> String {
        let digits = usize::from(self.settings.digits);
        match value {
            None => "–".into(),
            // Few digits of a huge number are still hundreds.
            Some(Value::F64(value)) if value.abs() >= 1e9 => format!("{value:.digits$e} {unit}"),
            Some(Value::F64(value)) => {
                let text = format!("{value:.digits$}");
                // A small negative number is no "-0.0".
                let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
                let text = if is_zero { text.trim_start_matches('-') } else { &text };
                format!("{text} {unit}")
            }
            Some(Value::I64(value)) => format!("{value} {unit}"),
            Some(Value::Bool(value)) => (if *value { "on" } else { "off" }).into(),
            Some(Value::DoublePoint(position)) => format!("{position:?}"),
            Some(Value::Text(text)) if text.as_str().is_empty() => "(empty)".into(),
            Some(Value::Text(text)) => text.to_string(),
        }
    }
}

impl MyPlugin {
    /// Judges a piece of equipment. Every piece has a verdict in every frame, and silence would
    /// mean "judged healthy". An unknown value makes the equipment unknown, with the reason.
    fn judge_equipment(
        &self,
        index: usize,
        values: &[TagValue],
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        let (_, own) = &self.equipment[index];
        let known = |at: &usize| values[*at].good_number();
        let is_abnormal = |at: &usize| {
            let value = known(at).map(Value::F64);
            judge(&self.bindings[*at], value.as_ref()) > Severity::Normal
        };
        let has_limits = |at: &usize| {
            let Binding { limit_low, limit_high, .. } = &self.bindings[*at];
            limit_low.is_some() || limit_high.is_some()
        };
        let judged: Vec<usize> = own.iter().copied().filter(has_limits).collect();
        // What is abnormal for sure is told first, whatever else is not known.
        if let Some(at) = judged.iter().copied().find(is_abnormal) {
            let basis = canvas.basis([at])?;
            let reason = format!("{} is outside its limits", self.bindings[at].tag_id);
            return canvas.judge(index, basis, &Judgment::abnormal(&reason));
        }
        if let Some(at) = judged.iter().copied().find(|at| known(at).is_none()) {
            let basis = canvas.basis([at])?;
            let reason = format!("{} is not good", self.bindings[at].tag_id);
            return canvas.judge(index, basis, &Judgment::unknown(&reason));
        }
        let assumption = if judged.is_empty() { "no limits are configured" } else { "" };
        let basis = canvas.basis(judged)?;
        canvas.judge(index, basis, &Judgment::NORMAL.assuming(assumption))
    }
}

/// Returns a warning outside the normal band.
fn judge(binding: &Binding, value: Option<&Value>) -> Severity {
    let value = match value {
        Some(Value::F64(value)) => *value,
        Some(Value::I64(value)) => *value as f64,
        _ => return Severity::Normal,
    };
    let below = binding.limit_low.is_some_and(|low| value < low);
    let above = binding.limit_high.is_some_and(|high| value > high);
    if below || above { Severity::Warning } else { Severity::Normal }
}

export_plugin!(MyPlugin: overlay);

#[cfg(test)]
mod tests;
