//! What the overlay shows of loads that come and go.

use std::time::Duration;

use busbar_plugin_sdk::testing::{DrawnLine, draw_at, host};
use busbar_plugin_sdk::{Reason, Value, ValueKind};

use super::*;

const MINUTE: i64 = 60_000_000_000;

fn binding(role: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: role.into(),
        tag_name: role.into(),
        unit: String::new(),
        node_id: "=T1".into(),
        role: role.into(),
    }
}

fn overlay() -> TransformerThermal {
    let text = r#"{ "transformers": [{
        "equipment": "=T1", "cooling": "ONAF", "rated_load": 400, "top_oil_rise": 38.3,
        "gradient": 14.5, "hot_spot_factor": 1.4, "loss_ratio": 1000
    }] }"#;
    TransformerThermal::create(serde_json::from_str(text).unwrap(), host()).ok().unwrap()
}

struct Bench {
    overlay: TransformerThermal,
    is_configured: bool,
}

impl Bench {
    /// What is shown at a minute of a load in amperes and an ambient temperature.
    fn at(&mut self, minute: i64, load: f64, quality: Quality) -> Vec<DrawnLine> {
        let value = |value, quality| TagValue {
            value: Some(Value::F64(value)),
            quality,
            age: Duration::ZERO,
        };
        let values = [value(load, quality), value(25.6, Quality::Good)];
        let first = !std::mem::replace(&mut self.is_configured, true);
        let bindings = first.then(|| vec![binding(LOAD), binding(AMBIENT)]);
        draw_at(&mut self.overlay, bindings, &values, minute * MINUTE).unwrap().lines
    }
}

fn degrees(lines: &[DrawnLine]) -> [f64; 2] {
    [0, 1].map(|at| lines[at].text.trim_end_matches(" °C").parse().unwrap())
}

#[test]
fn the_model_goes_on_from_frame_to_frame() {
    let mut bench = Bench { overlay: overlay(), is_configured: false };
    let cold = degrees(&bench.at(0, 0.0, Quality::Good));
    let mut minute = 0;
    // Frames as they come, some of them late.
    while minute < 190 {
        minute = (minute + 1 + minute % 3).min(190);
        bench.at(minute, 400.0, Quality::Good);
    }
    let [top_oil, hot_spot] = degrees(&bench.at(190, 400.0, Quality::Good));
    assert!(cold[0] < 26.0 && top_oil > 55.0 && hot_spot > top_oil + 20.0, "{top_oil} {hot_spot}");
    // While the load is not known nothing moves; the time is made up for afterwards.
    let lost = bench.at(300, 0.0, Quality::Bad(Reason::Stale));
    assert_eq!(degrees(&lost), [top_oil, hot_spot]);
    let back = degrees(&bench.at(400, 400.0, Quality::Good));
    assert!(back[0] > top_oil, "{back:?}");
}

#[test]
fn what_is_too_hot_is_marked() {
    let mut bench = Bench { overlay: overlay(), is_configured: false };
    let severities = |lines: &[DrawnLine]| [lines[0].severity, lines[1].severity];
    assert_eq!(severities(&bench.at(0, 400.0, Quality::Good)), [Severity::Normal; 2]);
    bench.at(1, 760.0, Quality::Good);
    let hot = bench.at(240, 760.0, Quality::Good);
    let [top_oil, hot_spot] = degrees(&hot);
    assert!(top_oil > 105.0 && hot_spot > 140.0, "{top_oil} {hot_spot}");
    assert_eq!(severities(&hot)[1], Severity::Alarm);
    assert!(severities(&hot)[0] > Severity::Normal);
    assert!(hot[2].text.starts_with("× ") && hot[2].caption == "Ageing");
}

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    let text = r#"{ "transformers": [{ "equipment": "=T1", "loss_ratio": 0 }] }"#;
    let made = TransformerThermal::create(serde_json::from_str(text).unwrap(), host());
    let words = made.err().unwrap().to_string();
    assert!(words.contains("loss_ratio is 0: give 0.1 to 10000"), "{words}");
}
