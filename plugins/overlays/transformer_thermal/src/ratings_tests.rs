//! Defaults of rises against IEC 60076-2, limits, and assumptions.

use super::*;

fn settings(text: &str) -> TransformerSettings {
    let text = format!(r#"{{ "equipment": "=T1", {text} }}"#);
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_default_hot_spot_rise_stays_within_78_kelvin() {
    for cooling in ["ONAN", "ONAF", "OF", "OFAN", "OFAF", "OFWF", "OD", "ODAN", "ODAF", "ODWF"] {
        for given in
            ["", r#", "top_oil_rise": 60"#, r#", "gradient": 30"#, r#", "hot_spot_factor": 1.5"#]
        {
            for size in ["small", "large"] {
                let of = settings(&format!(r#""cooling": "{cooling}", "size": "{size}"{given}"#));
                let parameters = of.cooling_stages()[0].parameters;
                let rise =
                    parameters.top_oil_rise + parameters.gradient * parameters.hot_spot_factor;
                assert!(rise <= MAX_HOT_SPOT_RISE + 1e-9, "{cooling} {size} {given}: {rise}");
            }
        }
    }
}

#[test]
fn defaults_are_assumed_until_they_are_given() {
    let none = settings(r#""size": "large", "cooling": "ONAF""#).assumptions().join(", ");
    assert_eq!(none, "top-oil rise 52.0 K, gradient 20.0 K, H 1.3, R 6.0");
    let given = r#""cooling": "ONAF", "top_oil_rise": 45, "gradient": 14.5,
        "hot_spot_factor": 1.3, "loss_ratio": 6"#;
    assert!(settings(given).assumptions().is_empty());
    let bare = settings(r#""untelemetered": false"#).assumptions();
    assert!(bare.contains(&"ONAN cooling".to_owned()));
    assert!(bare.contains(&"medium or large transformer".to_owned()));
}

#[test]
fn own_limits_count_in_place_of_those_of_table_2() {
    let own = settings(r#""top_oil_limit": 95, "size": "medium""#);
    assert_eq!(own.limits(Loading::NormalCyclic), (1.5, [95.0, 120.0]));
    // A limit of the next kind of loading is never below the own one.
    assert_eq!(own.limits(Loading::LongTimeEmergency), (1.5, [115.0, 140.0]));
}

#[test]
fn a_load_that_nobody_saw_goes_to_the_emergency_limit() {
    let high = |text| settings(text).plausible_load().high;
    assert_eq!(high(r#""size": "large""#), 1.5);
    assert_eq!(high(r#""rated_power": 40"#), 1.8);
    assert_eq!(high(r#""cooling": "ONAN""#), 2.0);
    assert_eq!(high(r#""plausible_load": [0.1, 1.2]"#), 1.2);
}

#[test]
fn a_stage_has_its_own_rated_load() {
    let of = settings(
        r#""cooling": "ONAF", "loss_ratio": 6, "stages": [
            { "stage": 0, "cooling": "ONAN", "rated_share": 0.6 },
            { "stage": 1, "cooling": "ONAF" }]"#,
    );
    let stages = of.cooling_stages();
    assert!((stages[0].parameters.loss_ratio - 6.0 * 0.36).abs() < 1e-12);
    assert_eq!(
        [stages[0].parameters.oil_minutes, stages[1].parameters.oil_minutes],
        [210.0, 150.0]
    );
}
