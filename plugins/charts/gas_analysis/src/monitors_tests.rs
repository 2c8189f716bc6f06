//! Monitors by their tags: verdicts, doubts and histories.

use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::{Drawing, draw_at, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, Severity, Value, ValueKind};
use dga::Gas;

use crate::verdict::{DISCHARGE, NORMAL, NOT_JUDGED};
use crate::*;

const ID: &str = "=T1";
const SECOND: i64 = 1_000_000_000;
/// Quiet oil of a sealed transformer, and one with discharges of low energy; ppm, in the
/// order of the gases.
const CALM: [f64; 9] = [14.0, 7.0, 9.0, 5.0, 0.1, 150.0, 1300.0, 2400.0, 62_000.0];
const ARCING: [f64; 9] = [550.0, 100.0, 20.0, 50.0, 240.0, 150.0, 1300.0, 2400.0, 62_000.0];

fn plugin(minutes: f64) -> GasAnalysis {
    let text = format!(r#"{{ "equipment": ["{ID}"], "record_minutes": {minutes} }}"#);
    let monitors = Some(serde_json::from_str(&text).unwrap());
    GasAnalysis::create(Settings { monitors, ..Settings::default() }, host()).unwrap()
}

fn bindings() -> Vec<Binding> {
    let binding = |gas: Gas| Binding {
        node: 3,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: gas.formula().into(),
        tag_name: gas.formula().into(),
        unit: "ppm".into(),
        node_id: ID.into(),
        role: format!("gas_{}", gas.formula().to_lowercase()),
    };
    Gas::ALL.into_iter().map(binding).collect()
}

fn values(ppm: [f64; 9]) -> Vec<TagValue> {
    let value = |ppm| TagValue {
        value: Some(Value::F64(ppm)),
        quality: Quality::Good,
        age: Duration::from_secs(2),
        origin: Origin::LIVE,
    };
    ppm.into_iter().map(value).collect()
}

/// Draws at a second; the first time with bindings.
fn draw(plugin: &mut GasAnalysis, values: &[TagValue], second: i64) -> Drawing {
    let bindings = (second == 0).then(bindings);
    draw_at(plugin, bindings, values, second * SECOND).unwrap()
}

fn state_of(drawing: &Drawing) -> u32 {
    let entry = drawing.states[0].entry;
    assert!(drawing.states.iter().all(|state| state.entry == entry && state.equipment == 0));
    assert_eq!(drawing.states.len(), Gas::ALL.len(), "it rests on every gas");
    entry as u32
}

fn states(plugin: &mut GasAnalysis) -> Vec<u32> {
    plugin.chart_records().unwrap().records.iter().map(|record| record.state).collect()
}

#[test]
fn gases_are_judged_as_those_of_a_laboratory_are() {
    let mut plugin = plugin(60.0);
    let calm = draw(&mut plugin, &values(CALM), 0);
    assert_eq!(state_of(&calm), NORMAL);
    assert_eq!(
        (calm.lines[0].severity, calm.lines[0].text.as_str()),
        (Severity::Normal, "status 1")
    );
    let arcing = draw(&mut plugin, &values(ARCING), 10);
    assert_eq!((state_of(&arcing), arcing.lines[0].severity), (DISCHARGE, Severity::Alarm));
    assert!(arcing.lines[0].text.contains("status 3, discharges of"), "{}", arcing.lines[0].text);
    assert_eq!(states(&mut plugin), [NORMAL, DISCHARGE], "what changes is recorded at once");
    let told = plugin.explain(ID, i64::MAX).unwrap();
    assert!(told.verdict.contains("discharges of") && told.evidence.len() >= 7);
    let before = plugin.explain(ID, 9 * SECOND).unwrap();
    assert!(before.verdict.contains("Status 1"), "{}", before.verdict);
    assert!(told.tables[0].rows.iter().all(|row| row.cells[4] == "–"), "seconds make no rate");
}

#[test]
fn a_gas_that_is_not_good_is_never_judged() {
    let doubts = [
        (Quality::Bad(Reason::Stale), 42, "not judged: H2 stale for 42 s"),
        (Quality::Bad(Reason::Communication), 300, "not judged: H2 bad, last good 5 min ago"),
        (Quality::Uncertain(Reason::Sensor), 1, "not judged: H2 uncertain, 1 s old"),
    ];
    for (quality, age, text) in doubts {
        let mut plugin = plugin(60.0);
        draw(&mut plugin, &values(CALM), 0);
        let mut doubtful = values(CALM);
        (doubtful[0].quality, doubtful[0].age) = (quality, Duration::from_secs(age));
        let drawn = draw(&mut plugin, &doubtful, 10);
        assert_eq!((state_of(&drawn), drawn.lines[0].severity), (NOT_JUDGED, Severity::Warning));
        assert_eq!(drawn.lines[0].text, text);
        assert_eq!(states(&mut plugin), [NORMAL, NOT_JUDGED]);
        let told = plugin.explain(ID, i64::MAX).unwrap();
        assert!(told.verdict.starts_with("Not judged: H2"), "{}", told.verdict);
        assert!(told.evidence.is_empty() && told.diagrams.is_empty());
        assert!(told.tables[0].rows.iter().all(|row| row.cells[0] != "H2"), "it is not shown");
        let records = plugin.chart_records().unwrap();
        let axes = records.values.len() / 2;
        assert!(records.values[axes].is_nan(), "H2 is missing there");
        // It comes back: judged again, and recorded.
        assert_eq!(state_of(&draw(&mut plugin, &values(CALM), 20)), NORMAL);
        assert_eq!(states(&mut plugin), [NORMAL, NOT_JUDGED, NORMAL]);
    }
    let mut many = values(CALM);
    many[1].value = None;
    many[1].quality = Quality::Bad(Reason::NotConnected);
    many[4] = TagValue { value: Some(Value::F64(-3.0)), ..many[4] };
    let drawn = draw(&mut plugin(60.0), &many, 0);
    assert_eq!(drawn.lines[0].text, "not judged: CH4 has no value yet and 1 more");
    let mut negative = values(CALM);
    negative[4] = TagValue { value: Some(Value::F64(-3.0)), ..negative[4] };
    let drawn = draw(&mut plugin(60.0), &negative, 0);
    assert!(drawn.lines[0].text.contains("C2H2 -3 ppm is negative"), "{}", drawn.lines[0].text);
}

#[test]
fn histories_are_bounded_and_no_faster_than_told() {
    let mut plugin = plugin(1.0);
    for second in 0..600 {
        let mut ppm = CALM;
        ppm[0] += second as f64 / 100.0;
        draw(&mut plugin, &values(ppm), second);
    }
    assert_eq!(states(&mut plugin), [NORMAL; 10], "one a minute");
    // Back and forth over a limit, for an hour: each is kept, up to the limit.
    for second in 600..4200 {
        let ppm = if second % 2 == 0 { CALM } else { ARCING };
        draw(&mut plugin, &values(ppm), second);
    }
    let times: Vec<i64> = {
        let records = plugin.chart_records().unwrap().records;
        records.iter().map(|record| record.unix_nanos).collect()
    };
    assert_eq!((times.len(), times.is_sorted()), (2000, true));
    assert_eq!(times.last(), Some(&(4199 * SECOND)));
    // A clock that was set back adds nothing until it is where it was.
    draw(&mut plugin, &values(CALM), 100);
    assert_eq!(plugin.chart_records().unwrap().records.len(), 2000);
    let last = plugin.chart_records().unwrap().records[1999].unix_nanos;
    assert_eq!(last, 4199 * SECOND);
}

#[test]
fn without_frames_nothing_goes_on_being_judged() {
    let mut plugin = plugin(60.0);
    draw(&mut plugin, &values(CALM), 0);
    plugin.monitors.note_silence(Instant::now());
    assert_eq!(states(&mut plugin), [NORMAL]);
    plugin.monitors.note_silence(Instant::now() + Duration::from_secs(60));
    assert_eq!(states(&mut plugin), [NORMAL, NOT_JUDGED]);
    let told = plugin.explain(ID, i64::MAX).unwrap();
    assert!(told.verdict.starts_with("Not judged: no frames came"), "{}", told.verdict);
}
