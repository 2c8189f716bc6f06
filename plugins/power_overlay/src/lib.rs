//! Live values as labels at the equipment, and colour for the abnormal.

mod format;

use busbar_plugin_sdk::{
    Binding, Canvas, DoublePoint, Error, Host, Overlay, OverlayFrame, Plugin, Severity, Value,
};

/// Settings of the overlay.
#[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Whether equipment with a value outside its normal band is coloured.
    tint: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tint: true }
    }
}

struct PowerOverlay {
    settings: Settings,
    bindings: Vec<Binding>,
}

impl Plugin for PowerOverlay {
    const ID: &'static str = "power_overlay";
    const NAME: &'static str = "Power overlay";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Live values at the equipment; colour for the abnormal.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings, bindings: Vec::new() })
    }
}

impl Overlay for PowerOverlay {
    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.bindings = bindings;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        for (index, (binding, state)) in self.bindings.iter().zip(frame.values()).enumerate() {
            let severity = state.value.map_or(Severity::Normal, |value| judge(binding, value));
            let text = format::value(state.value, &binding.unit);
            canvas.line(index, binding.node, severity, &binding.tag_name, &text)?;
            if self.settings.tint && severity > Severity::Normal {
                canvas.tint(index, binding.node, severity)?;
            }
        }
        Ok(())
    }
}

/// How abnormal a value is. In the role `alarm`, outside the normal band or
/// `true` is an alarm; in any other role, outside the band is a warning.
fn judge(binding: &Binding, value: Value) -> Severity {
    let alarm = binding.role == "alarm";
    let outside = |value: f64| {
        binding.limit_low.is_some_and(|low| value < low)
            || binding.limit_high.is_some_and(|high| value > high)
    };
    let abnormal = match value {
        Value::F64(value) => outside(value),
        Value::I64(value) => outside(value as f64),
        Value::Bool(value) => alarm && value,
        Value::DoublePoint(point) => point == DoublePoint::BadState,
    };
    match (abnormal, alarm) {
        (false, _) => Severity::Normal,
        (true, false) => Severity::Warning,
        (true, true) => Severity::Alarm,
    }
}

busbar_plugin_sdk::export_plugin!(PowerOverlay: overlay);

#[cfg(test)]
mod tests {
    use busbar_plugin_sdk::ValueKind;

    use super::*;

    fn binding(role: &str) -> Binding {
        Binding {
            node: 1,
            kind: ValueKind::F64,
            limit_low: Some(10.0),
            limit_high: Some(95.0),
            tag_id: "T1.TopOil".into(),
            tag_name: "Top oil".into(),
            unit: "°C".into(),
            node_id: "T1".into(),
            role: role.into(),
        }
    }

    #[test]
    fn severity_follows_band_and_role() {
        let check = |role, value, expected| {
            assert_eq!(judge(&binding(role), value), expected, "{role} {value:?}");
        };
        check("value", Value::F64(95.0), Severity::Normal);
        check("value", Value::F64(95.1), Severity::Warning);
        check("value", Value::I64(9), Severity::Warning);
        check("alarm", Value::F64(120.0), Severity::Alarm);
        check("alarm", Value::Bool(true), Severity::Alarm);
        check("value", Value::Bool(true), Severity::Normal);
        check("value", Value::DoublePoint(DoublePoint::BadState), Severity::Warning);
        check("value", Value::DoublePoint(DoublePoint::Intermediate), Severity::Normal);
    }
}
