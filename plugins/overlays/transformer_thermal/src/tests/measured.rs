//! Measured temperatures beside the model, and stages of cooling.

use super::*;

const TAGS: [(&str, &str); 3] = [("load", "A"), ("ambient", "°C"), ("top_oil", "°C")];

#[test]
fn a_measured_top_oil_narrows_the_band() {
    let mut without = Bench::example();
    let mut with = Bench::new(EXAMPLE, "", &TAGS);
    let values = [Some(320.0), Some(25.6)];
    let [top_oil, hot_spot] = exact(&[(1e5, 0.8)]);
    let wide = bounds(&without.run(60, &values).lines[1]);
    let drawing = with.run(60, &[Some(320.0), Some(25.6), Some(top_oil)]);
    let narrow = bounds(&drawing.lines[1]);
    assert!(narrow[1] - narrow[0] < 0.8 * (wide[1] - wide[0]), "{narrow:?} {wide:?}");
    assert!(narrow[0] < hot_spot && hot_spot < narrow[1]);
    assert_eq!(drawing.lines[0].caption, "Top oil (measured)");
    assert_near([bounds(&drawing.lines[0])[0], hot_spot], [top_oil, hot_spot]);
}

#[test]
fn a_measurement_above_the_model_is_abnormal_and_told() {
    let mut bench = Bench::new(EXAMPLE, "", &TAGS);
    let [top_oil, _] = exact(&[(1e5, 0.8)]);
    let at = |top_oil| [Some(320.0), Some(25.6), Some(top_oil)];
    assert_eq!(verdict(&bench.run(24 * 60, &at(top_oil + 9.0))), Verdict::Normal);
    let hot = bench.run(1, &at(top_oil + 11.0));
    assert_eq!(verdict(&hot), Verdict::Abnormal);
    assert!(reason(&hot).contains("check coolers, sensor and settings"), "{}", reason(&hot));
    // Below the model the sensor or the settings are wrong: no verdict.
    let cold = bench.run(1, &at(top_oil - 11.0));
    assert_eq!(verdict(&cold), Verdict::Unknown);
    assert!(reason(&cold).contains("check sensor and settings"), "{}", reason(&cold));
}

#[test]
fn a_cold_sensor_does_not_hide_a_hot_model() {
    let mut bench = Bench::new(EXAMPLE, "", &TAGS);
    bench.run(24 * 60, &[Some(760.0), Some(25.6), Some(40.0)]);
    let drawing = bench.run(1, &[Some(560.0), Some(25.6), Some(40.0)]);
    assert_ne!(verdict(&drawing), Verdict::Normal);
}

#[test]
fn measured_temperatures_alone_are_judged() {
    let tags = [("top_oil", "°C"), ("hot_spot", "°F")];
    let mut bench = Bench::new(r#""cooling": "ONAF""#, "", &tags);
    let drawing = bench.run(30, &[Some(70.0), Some(194.0)]);
    assert_eq!(verdict(&drawing), Verdict::Normal, "{}", reason(&drawing));
    assert_eq!(degrees(&drawing), [70.0, 90.0]);
    assert_eq!(drawing.lines[1].caption, "Hot spot (measured)");
    let drawing = bench.run(30, &[Some(70.0), Some(260.0)]);
    assert_eq!(verdict(&drawing), Verdict::Abnormal, "{}", reason(&drawing));
    // One of them bad: nothing else tells the load.
    assert_eq!(verdict(&bench.run(30, &[Some(70.0), None])), Verdict::Unknown);
}

#[test]
fn stages_of_cooling_follow_their_tag() {
    let stages = r#""top_oil_rise": 45, "gradient": 14.5, "hot_spot_factor": 1.3, "loss_ratio": 6,
        "stages": [
            { "stage": 0, "cooling": "ONAN", "rated_share": 0.6, "top_oil_rise": 45, "gradient": 14.5 },
            { "stage": 1, "cooling": "ONAF", "top_oil_rise": 45, "gradient": 14.5 }]"#;
    let tags = [("load", "%"), ("ambient", "°C"), ("fans", ""), ("cooler_fault", "")];
    let mut bench = Bench::new(stages, "", &tags);
    let at = |fans, fault| [Some(80.0), Some(20.0), fans, fault];
    let on = degrees(&bench.run(24 * 60, &at(Some(1.0), Some(0.0))));
    assert_eq!(verdict(&bench.run(0, &at(Some(1.0), Some(0.0)))), Verdict::Normal);
    let off = degrees(&bench.run(24 * 60, &at(Some(0.0), Some(0.0))));
    assert!(off[0] > on[0] + 20.0 && off[1] > on[1] + 30.0, "{on:?} {off:?}");
    // A stage that is not known may be either.
    let unknown = bench.run(24 * 60, &at(None, Some(0.0)));
    let [low, high] = bounds(&unknown.lines[0]);
    assert!((low - on[0]).abs() < 0.3 && (high - off[0]).abs() < 0.3, "{low} {high}");
    let fault = bench.run(1, &at(Some(1.0), Some(1.0)));
    assert_eq!(verdict(&fault), Verdict::Abnormal);
    assert!(reason(&fault).contains("a fault of the coolers is reported"));
    // A contact that is bad may stand for a fault, however cool the oil is.
    let cool = bench.run(24 * 60, &[Some(10.0), Some(20.0), Some(1.0), None]);
    assert_eq!(verdict(&cool), Verdict::Unknown);
    assert!(reason(&cool).contains("faults of the coolers: "), "{}", reason(&cool));
}
