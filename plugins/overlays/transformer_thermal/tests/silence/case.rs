//! Courses of load and ambient temperature with faults.

use std::path::PathBuf;
use std::time::Duration;

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Origin, Plugin, Quality, Reason, TagValue, Text, Value};
use transformer_thermal::{Parameters, TransformerThermal};

use crate::common::Random;

/// Frames of a case at least.
const MIN_FRAMES: usize = 80;
/// Longest time between two frames that are drawn one after the other, minutes.
const MAX_STEP: usize = 4;

/// Longest step between frames that counts as seen, minutes.
pub(crate) const LONGEST_STEP: usize = 5;

/// Plausible load and ambient temperature of all cases.
pub(crate) const LOAD: [f64; 2] = [0.0, 1.8];
pub(crate) const AMBIENT: [f64; 2] = [-25.0, 40.0];

/// Column of table 4, written down a second time.
struct Kind {
    cooling: &'static str,
    restricted: bool,
    size: &'static str,
    exponents: [f64; 2],
    k: [f64; 3],
    minutes: [f64; 2],
}

const KINDS: [Kind; 7] = [
    kind("ONAN", "small", false, [0.8, 1.6], [1.0, 1.0, 2.0], [180.0, 4.0]),
    kind("ONAN", "medium", false, [0.8, 1.3], [0.5, 2.0, 2.0], [210.0, 10.0]),
    kind("ONAF", "medium", false, [0.8, 1.3], [0.5, 2.0, 2.0], [150.0, 7.0]),
    kind("OFAF", "medium", false, [1.0, 1.3], [1.0, 1.3, 1.0], [90.0, 7.0]),
    kind("ODAF", "medium", false, [1.0, 2.0], [1.0, 1.0, 1.0], [90.0, 7.0]),
    kind("ONAF", "medium", true, [0.8, 1.3], [0.5, 3.0, 2.0], [150.0, 7.0]),
    kind("OFAF", "medium", true, [1.0, 1.3], [1.0, 1.45, 1.0], [90.0, 7.0]),
];

const fn kind(
    cooling: &'static str,
    size: &'static str,
    restricted: bool,
    exponents: [f64; 2],
    k: [f64; 3],
    minutes: [f64; 2],
) -> Kind {
    Kind { cooling, restricted, size, exponents, k, minutes }
}

/// Fault of the inputs for some minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    BadLoad,
    NoLoad,
    ImplausibleLoad,
    /// Text in place of the load.
    LoadInWords,
    BadAmbient,
    ImplausibleAmbient,
    /// Text in place of the ambient temperature.
    AmbientInWords,
    /// Time in which nobody draws.
    NoFrame,
}

const FAULTS: [Fault; 8] = [
    Fault::BadLoad,
    Fault::NoLoad,
    Fault::ImplausibleLoad,
    Fault::LoadInWords,
    Fault::BadAmbient,
    Fault::ImplausibleAmbient,
    Fault::AmbientInWords,
    Fault::NoFrame,
];

/// A transformer, its true course by minutes, and what goes wrong.
pub(crate) struct Case {
    pub(crate) settings: String,
    pub(crate) parameters: Parameters,
    /// Reports whether the top oil is measured.
    pub(crate) has_sensor: bool,
    /// Frames in the order of their minutes.
    pub(crate) course: Vec<Instant>,
}

/// Instant of a frame, and what was so since the frame before.
#[derive(Clone, Copy)]
pub(crate) struct Instant {
    pub(crate) minute: usize,
    /// Load per unit and ambient temperature.
    pub(crate) inputs: [f64; 2],
    pub(crate) fault: Option<Fault>,
    /// Reports whether the measurement of the top oil is bad.
    pub(crate) is_sensor_bad: bool,
}

pub(crate) fn case(random: &mut Random) -> Case {
    let kind = &KINDS[random.below(KINDS.len())];
    let [top_oil_rise, gradient] = [random.between(30.0, 60.0), random.between(8.0, 22.0)];
    let hot_spot_factor = random.between(1.0, 1.5);
    let loss_ratio = random.between(1.0, 12.0);
    let parameters = Parameters {
        oil_minutes: kind.minutes[0],
        winding_minutes: kind.minutes[1],
        top_oil_rise,
        gradient,
        hot_spot_factor,
        loss_ratio,
        oil_exponent: kind.exponents[0],
        winding_exponent: kind.exponents[1],
        k: kind.k,
    };
    let settings = format!(
        r#""equipment": "=T1", "cooling": "{}", "size": "{}", "restricted_oil_flow": {}, "top_oil_rise": {top_oil_rise},
           "gradient": {gradient}, "hot_spot_factor": {hot_spot_factor},
           "loss_ratio": {loss_ratio}, "plausible_load": [{}, {}]"#,
        kind.cooling, kind.size, kind.restricted, LOAD[0], LOAD[1],
    );
    Case { settings, parameters, has_sensor: random.one_in(3), course: course(random) }
}

fn course(random: &mut Random) -> Vec<Instant> {
    let frames = MIN_FRAMES + random.below(200);
    let mut load = random.between(0.0, 1.2);
    let mut ambient = random.between(-5.0, 35.0);
    let mut minute = 0;
    let mut course = Vec::with_capacity(frames);
    for _ in 0..frames {
        if random.one_in(25) {
            let range = if random.one_in(3) { [1.2, LOAD[1]] } else { [0.0, 1.2] };
            load = random.between(range[0], range[1]);
        }
        ambient = (ambient + random.between(-0.4, 0.4)).clamp(AMBIENT[0], AMBIENT[1]);
        minute += 1 + random.below(MAX_STEP);
        course.push(Instant {
            minute,
            inputs: [load, ambient],
            fault: None,
            is_sensor_bad: random.one_in(4),
        });
    }
    for _ in 0..random.below(5) {
        let fault = FAULTS[random.below(FAULTS.len())];
        let from = random.below(frames);
        // A gap without a frame is longer than a step that counts as seen.
        let to = frames.min(from + LONGEST_STEP + 1 + random.below(80));
        let hidden = random.one_in(2).then(|| random.between(LOAD[0], LOAD[1]));
        if course[from..to].iter().any(|instant| instant.fault.is_some()) {
            continue;
        }
        for instant in &mut course[from..to] {
            instant.fault = Some(fault);
            instant.inputs[0] = hidden.unwrap_or(instant.inputs[0]);
        }
    }
    course
}

impl Case {
    /// Overlay of the case; with a file it keeps its state.
    pub(crate) fn overlay(&self, file: Option<&PathBuf>) -> TransformerThermal {
        let file =
            file.map_or(String::new(), |file| format!(r#", "state_file": "{}""#, file.display()));
        let text = format!(r#"{{ "transformers": [{{ {} }}] {file} }}"#, self.settings);
        TransformerThermal::create(serde_json::from_str(&text).expect("it is JSON"), host())
            .unwrap_or_else(|error| panic!("{error}"))
    }
}

fn text(word: &str) -> Option<Value> {
    Text::new(word).map(Value::Text)
}

impl Instant {
    /// Values of load, ambient temperature and top oil.
    pub(crate) fn values(&self, top_oil: f64) -> [TagValue; 3] {
        let [load, ambient] = self.inputs;
        let mut values = [load * 100.0, ambient, top_oil].map(|number| TagValue {
            value: Some(Value::F64(number)),
            quality: Quality::Good,
            age: Duration::ZERO,
            origin: Origin::LIVE,
        });
        if self.is_sensor_bad {
            values[2].quality = Quality::Uncertain(Reason::Stale);
        }
        match self.fault {
            Some(Fault::BadLoad) => values[0].quality = Quality::Bad(Reason::Stale),
            Some(Fault::NoLoad) => values[0].value = None,
            Some(Fault::ImplausibleLoad) => values[0].value = Some(Value::F64(-5.0)),
            Some(Fault::BadAmbient) => values[1].quality = Quality::Bad(Reason::Stale),
            Some(Fault::ImplausibleAmbient) => values[1].value = Some(Value::F64(850.0)),
            Some(Fault::LoadInWords) => values[0].value = text("50"),
            Some(Fault::AmbientInWords) => values[1].value = text("20"),
            Some(Fault::NoFrame) | None => {}
        }
        values
    }

    /// Reports of load and ambient temperature whether they are seen.
    pub(crate) fn is_seen(&self) -> [bool; 2] {
        let hides_load =
            [Fault::BadLoad, Fault::NoLoad, Fault::ImplausibleLoad, Fault::LoadInWords];
        let hides_ambient = [Fault::BadAmbient, Fault::ImplausibleAmbient, Fault::AmbientInWords];
        let is_hidden = |of: &[Fault]| self.fault.is_some_and(|fault| of.contains(&fault));
        [!is_hidden(&hides_load), !is_hidden(&hides_ambient)]
    }
}
