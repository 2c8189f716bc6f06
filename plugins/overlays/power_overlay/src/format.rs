//! Formatting of values for operators.

use busbar_plugin_sdk::{DoublePoint, Value};

/// Formats a value with its unit; a dash where none came yet.
pub(crate) fn value(value: Option<&Value>, unit: &str) -> String {
    match value {
        None => "–".into(),
        Some(Value::F64(value)) => with_unit(number(*value), unit),
        Some(Value::I64(value)) => with_unit(value.to_string(), unit),
        Some(Value::Bool(value)) => (if *value { "on" } else { "off" }).into(),
        Some(Value::DoublePoint(point)) => match point {
            DoublePoint::Intermediate => "travelling",
            DoublePoint::Off => "open",
            DoublePoint::On => "closed",
            DoublePoint::BadState => "invalid",
        }
        .into(),
        // Nothing at all would look like a value that is missing.
        Some(Value::Text(text)) if text.as_str().is_empty() => "(empty)".into(),
        // A text stands for itself: no unit belongs to it.
        Some(Value::Text(text)) => text.as_str().to_owned(),
    }
}

/// Formats a number with about four significant digits, so that the text keeps its width.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return value.to_string();
    }
    let text = match value.abs() {
        size if size >= 1e7 => format!("{value:.3e}"),
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    };
    // A small negative rounds to -0.00.
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

fn with_unit(text: String, unit: &str) -> String {
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_sdk::Text;

    use super::*;

    #[test]
    fn values_read_well() {
        let check = |given: Option<Value>, unit, expected| {
            assert_eq!(value(given.as_ref(), unit), expected);
        };
        check(None, "kV", "–");
        check(Some(Value::F64(231.449)), "kV", "231.4 kV");
        check(Some(Value::F64(0.5994)), "MPa", "0.60 MPa");
        check(Some(Value::F64(-0.001)), "", "0.00");
        check(Some(Value::F64(-12.34)), "MW", "-12.3 MW");
        check(Some(Value::F64(12345.6)), "A", "12346 A");
        check(Some(Value::F64(f64::NAN)), "A", "NaN A");
        check(Some(Value::I64(-3)), "", "-3");
        check(Some(Value::Bool(true)), "", "on");
        check(Some(Value::DoublePoint(DoublePoint::On)), "", "closed");
        for text in ["AUTO", "–12.3", "Öl 電 🔌"] {
            check(Text::new(text).map(Value::Text), "kV", text);
        }
        check(Text::new("").map(Value::Text), "kV", "(empty)");
    }
}
