//! Overlay with loads that come and go: temperatures, verdicts, and their reasons.

mod gaps;
mod kept;
mod measured;

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, DrawnLine, draw_at, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, Value, ValueKind, Verdict};

use super::*;

const MINUTE: i64 = 60_000_000_000;
/// Scene time at which the tests begin.
const START: i64 = 1_700_000_000_000_000_000;
/// Transformer of the example in IEC 60076-7.
const EXAMPLE: &str = r#""cooling": "ONAF", "rated_load": 400, "top_oil_rise": 38.3,
    "gradient": 14.5, "hot_spot_factor": 1.4, "loss_ratio": 1000"#;

fn binding((role, unit): (&str, &str)) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("T1.{role}"),
        tag_name: role.into(),
        unit: unit.into(),
        node_id: "=T1".into(),
        role: role.into(),
    }
}

fn create(transformer: &str, more: &str) -> TransformerThermal {
    let text = format!(r#"{{ "transformers": [{{ "equipment": "=T1", {transformer} }}] {more} }}"#);
    TransformerThermal::create(serde_json::from_str(&text).unwrap(), host()).ok().unwrap()
}

/// An overlay, its tags, and the scene clock.
struct Bench {
    overlay: TransformerThermal,
    bindings: Option<Vec<Binding>>,
    /// Minutes since the instant [`START`].
    minute: i64,
}

impl Bench {
    fn new(transformer: &str, more: &str, tags: &[(&str, &str)]) -> Self {
        let overlay = create(transformer, more);
        let bindings = Some(tags.iter().copied().map(binding).collect());
        Self { overlay, bindings, minute: 0 }
    }

    /// The example with load and ambient temperature.
    fn example() -> Self {
        Self::new(EXAMPLE, "", &[("load", "A"), ("ambient", "°C")])
    }

    /// Drawing of these values now; `None` is a bad one.
    fn draw(&mut self, values: &[Option<f64>]) -> Drawing {
        let value = |value: &Option<f64>| TagValue {
            value: Some(Value::F64(value.unwrap_or(1.0))),
            quality: value.map_or(Quality::Bad(Reason::Stale), |_| Quality::Good),
            age: Duration::ZERO,
            origin: Origin::LIVE,
        };
        let values: Vec<_> = values.iter().map(value).collect();
        let now = START + self.minute * MINUTE;
        draw_at(&mut self.overlay, self.bindings.take(), &values, now).unwrap()
    }

    /// Drawing after so many minutes of these values, one frame a minute.
    fn run(&mut self, minutes: i64, values: &[Option<f64>]) -> Drawing {
        for _ in 0..minutes {
            self.minute += 1;
            self.draw(values);
        }
        self.draw(values)
    }

    /// The same at a load per unit and the ambient temperature of the example.
    fn at_load(&mut self, minutes: i64, load: f64) -> Drawing {
        self.run(minutes, &[Some(load * 400.0), Some(25.6)])
    }
}

/// Top oil and hot spot of the lines, where they are values.
fn degrees(drawing: &Drawing) -> [f64; 2] {
    [0, 1].map(|at| {
        let text = &drawing.lines[at].text;
        text.trim_end_matches(" °C").parse().unwrap_or_else(|_| panic!("{text} is no value"))
    })
}

/// Bounds of a line.
fn bounds(line: &DrawnLine) -> [f64; 2] {
    let text = line.text.trim_end_matches(" °C").trim_start_matches("between ");
    let (low, high) = text.split_once(" and ").unwrap_or((text, text));
    [low, high].map(|number| number.parse().unwrap())
}

fn verdict(drawing: &Drawing) -> Verdict {
    drawing.verdict(0).unwrap().verdict
}

fn reason(drawing: &Drawing) -> &str {
    &drawing.verdict(0).unwrap().reason
}

/// Temperatures of the example by the exact model.
fn exact(courses: &[(f64, f64)]) -> [f64; 2] {
    let settings = format!(r#"{{ "equipment": "=T1", {EXAMPLE} }}"#);
    let settings: TransformerSettings = serde_json::from_str(&settings).unwrap();
    let parameters = settings.cooling_stages()[0].parameters;
    let steady = Temperatures::steady(&parameters, courses[0].1, 25.6);
    let after = courses.iter().fold(steady, |temperatures, (minutes, load)| {
        temperatures.after(&parameters, *minutes, *load, 25.6)
    });
    [after.top_oil, after.hot_spot()]
}

fn assert_near(ours: [f64; 2], exact: [f64; 2]) {
    let worst = ours.iter().zip(exact).map(|(ours, exact)| (ours - exact).abs());
    assert!(worst.fold(0.0, f64::max) <= 0.55, "{ours:?} for {exact:?}");
}

#[test]
fn a_load_that_was_seen_gives_the_temperatures_of_the_model() {
    let mut bench = Bench::example();
    bench.at_load(12 * 60, 0.6);
    assert_near(degrees(&bench.at_load(0, 0.6)), exact(&[(1e5, 0.6)]));
    let drawing = bench.at_load(180, 1.0);
    assert_near(degrees(&drawing), exact(&[(1e5, 0.6), (180.0, 1.0)]));
    assert_eq!(verdict(&drawing), Verdict::Normal);
    assert_eq!(drawing.verdict(0).unwrap().basis, [0, 1]);
    assert!(!drawing.verdict(0).unwrap().is_assumed, "{}", reason(&drawing));
    let captions: Vec<_> = drawing.lines.iter().map(|line| line.caption.as_str()).collect();
    let wanted = ["Top oil (model)", "Hot spot (model)", "Ageing", "Loss of life", "Load"];
    assert_eq!(captions, wanted);
}

#[test]
fn what_is_too_hot_is_abnormal() {
    let mut bench = Bench::example();
    bench.at_load(12 * 60, 0.6);
    let drawing = bench.at_load(300, 1.9);
    assert_near(degrees(&drawing), exact(&[(1e5, 0.6), (300.0, 1.9)]));
    assert_eq!(verdict(&drawing), Verdict::Abnormal);
    assert!(reason(&drawing).contains("hot spot") && reason(&drawing).contains("above 120 °C"));
    assert_eq!(drawing.lines[1].severity, Severity::Alarm);
    assert!(!drawing.tints.is_empty());
    assert!(drawing.lines[2].text.starts_with("× "));
}

#[test]
fn a_load_above_its_limit_is_abnormal_before_it_is_hot() {
    let mut bench = Bench::example();
    bench.at_load(12 * 60, 0.3);
    let drawing = bench.at_load(1, 1.6);
    assert!(degrees(&drawing)[1] < 60.0);
    assert_eq!(verdict(&drawing), Verdict::Abnormal);
    assert!(reason(&drawing).contains("load 1.60 p.u. above 1.5 p.u."), "{}", reason(&drawing));
    let mut at_limit = Bench::example();
    at_limit.at_load(12 * 60, 0.3);
    assert_eq!(verdict(&at_limit.at_load(1, 1.5)), Verdict::Normal);
}

#[test]
fn a_piece_that_is_not_telemetered_is_unknown_without_a_finding() {
    let mut bench = Bench::new(r#""untelemetered": true"#, "", &[]);
    let drawing = bench.draw(&[]);
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    assert!(bench.overlay.describe().findings.is_empty());
    assert_eq!(bench.overlay.describe().equipment, ["=T1"]);
}

#[test]
fn a_piece_without_a_load_is_unknown_and_a_finding() {
    for tags in [&[][..], &[("ambient", "°C")][..]] {
        let mut bench = Bench::new(r#""cooling": "ONAN""#, "", tags);
        let drawing = bench.draw(&vec![Some(20.0); tags.len()]);
        assert_eq!(verdict(&drawing), Verdict::Unknown);
        assert_eq!(bench.overlay.describe().findings.len(), 1);
    }
}

#[test]
fn a_current_is_never_taken_for_per_cent() {
    // 400 A with the rated load left out: 645 °C, had they been per cent.
    let mut bench = Bench::new(r#""cooling": "ONAF""#, "", &[("load", "A")]);
    let drawing = bench.run(600, &[Some(400.0)]);
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    assert!(bench.overlay.describe().findings[0].contains("give rated_current"));
}

#[test]
fn defaults_are_told_as_assumed() {
    let mut bench = Bench::new(r#""cooling": "ONAF""#, "", &[("load", "%")]);
    let drawing = bench.run(24 * 60, &[Some(50.0)]);
    assert_eq!(verdict(&drawing), Verdict::Normal);
    assert!(drawing.verdict(0).unwrap().is_assumed);
    for words in ["top-oil rise 52.0 K", "gradient 20.0 K", "H 1.3", "R 6.0", "ambient 20 °C"] {
        assert!(reason(&drawing).contains(words), "{}", reason(&drawing));
    }
}

#[test]
fn active_power_alone_never_makes_normal() {
    let more = r#""cooling": "ONAF", "rated_power": 40"#;
    let mut bench = Bench::new(more, "", &[("active_power", "MW")]);
    assert_eq!(verdict(&bench.run(24 * 60, &[Some(2.0)])), Verdict::Unknown);
    // A lower bound that is too hot is too hot.
    assert_eq!(verdict(&bench.run(24 * 60, &[Some(64.0)])), Verdict::Abnormal);
}

#[test]
fn loss_of_life_is_counted() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 1.0);
    let before = bench.overlay.transformers[0].state.unwrap().life;
    bench.at_load(10 * 60, 1.0);
    let after = bench.overlay.transformers[0].state.unwrap().life;
    let [_, hot_spot] = exact(&[(1e5, 1.0)]);
    let lost = after.hours.middle() - before.hours.middle();
    let wanted = 10.0 * ((hot_spot - 98.0) / 6.0).exp2();
    assert!((lost - wanted).abs() < 1e-3 * wanted, "{lost} {wanted}");
    let hours = after.counted_hours - before.counted_hours;
    assert!((hours - 10.0).abs() < 1e-6, "{hours}");
    // It begins with the first good value, not with the guess before.
    assert!((15.0..20.0).contains(&before.counted_hours) && before.hours.width() < 0.1);
    let line = |drawing: &Drawing| drawing.lines[3].text.clone();
    let counted = line(&bench.at_load(0, 1.0));
    assert!(counted.contains(" h in ") && !counted.contains("between"), "{counted}");
    // What was not seen is counted between bounds.
    let unseen = line(&bench.run(60, &[None, Some(25.6)]));
    assert!(unseen.starts_with("between "), "{unseen}");
    let drawing = bench.at_load(0, 1.0);
    assert!(drawing.lines[2].text.contains("dry, oxygen-free paper assumed"));
}
