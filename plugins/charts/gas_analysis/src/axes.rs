//! Axes and legend of the chart of a fleet.

use busbar_plugin_sdk::{ChartAxis, ChartBand, ChartState, Pattern};
use dga::c57_104::{self, Age};
use dga::{Gas, Sample};

use crate::source;

/// Gases with an axis of their own: upper end and detection limit (IEC 60567), ppm.
const GAS_AXES: [(Gas, f32, f32); 6] = [
    (Gas::H2, 1e5, 2.0),
    (Gas::Ch4, 1e5, 0.1),
    (Gas::C2h6, 1e5, 0.1),
    (Gas::C2h4, 1e5, 0.1),
    (Gas::C2h2, 1e5, 0.1),
    (Gas::Co, 1e4, 5.0),
];
/// Lower end of all axes of gases, ppm.
const GAS_LOW: f32 = 0.1;
/// Ratios of IEC 60599, table 1: their gases, and the limit that is drawn.
const RATIO_AXES: [(&str, [Gas; 2], f32); 3] = [
    ("C2H2/C2H4", [Gas::C2h2, Gas::C2h4], 1.0),
    ("CH4/H2", [Gas::Ch4, Gas::H2], 1.0),
    ("C2H4/C2H6", [Gas::C2h4, Gas::C2h6], 4.0),
];
/// Ends of axes of ratios: what is beyond, infinity too, is at an end.
const RATIO_ENDS: [f32; 2] = [0.01, 100.0];
pub(crate) const AXES: usize = GAS_AXES.len() + RATIO_AXES.len() + source::EXTRAS.len();

/// The values of a sample on all axes; NaN where there is none.
pub(crate) fn values(sample: &Sample, more: [f32; source::EXTRAS.len()]) -> [f32; AXES] {
    let mut values = [f32::NAN; AXES];
    let (gases, rest) = values.split_at_mut(GAS_AXES.len());
    for (value, (gas, _, _)) in gases.iter_mut().zip(GAS_AXES) {
        *value = sample.ppm(gas).map_or(f32::NAN, |ppm| ppm as f32);
    }
    let (ratios, extras) = rest.split_at_mut(RATIO_AXES.len());
    for (value, (_, [above, below], _)) in ratios.iter_mut().zip(RATIO_AXES) {
        let ppm = sample.ppm(above).zip(sample.ppm(below));
        // x/0 is infinite, and 0/0 is no number.
        let ratio = ppm.map_or(f64::NAN, |(above, below)| above / below);
        *value = (ratio as f32).min(RATIO_ENDS[1]);
    }
    extras.copy_from_slice(&more);
    values
}

pub(crate) fn axes(age: Age) -> Vec<ChartAxis> {
    let limits = c57_104::limits(&Sample::new(), age);
    let band = |name: &str, from: Option<f32>, to: Option<f32>, is_abnormal| ChartBand {
        name: name.into(),
        from,
        to,
        is_abnormal,
    };
    let gas_axis = |(gas, high, detection): (Gas, f32, f32)| {
        let at = c57_104::GASES.iter().position(|one| *one == gas);
        let bands = at.map_or_else(Vec::new, |at| {
            let [typical, upper] = limits[at].map(|ppm| ppm as f32);
            vec![
                band("between C57.104-2019 tables 1 and 2", Some(typical), Some(upper), false),
                band("above C57.104-2019 table 2", Some(upper), None, true),
            ]
        });
        ChartAxis {
            name: gas.formula().into(),
            unit: "ppm".into(),
            log: true,
            low: GAS_LOW,
            high,
            detection_limit: Some(detection),
            bands,
        }
    };
    let ratio_axis = |(name, _, limit): (&str, [Gas; 2], f32)| ChartAxis {
        name: name.into(),
        unit: String::new(),
        log: true,
        low: RATIO_ENDS[0],
        high: RATIO_ENDS[1],
        detection_limit: None,
        bands: vec![band("limit of IEC 60599, table 1", Some(limit), None, false)],
    };
    let linear = |name: &str, unit: &str, high, limit| ChartAxis {
        name: name.into(),
        unit: unit.into(),
        log: false,
        low: 0.0,
        high,
        detection_limit: None,
        bands: vec![band("above the limit of IEC 60076-7, table 2", Some(limit), None, true)],
    };
    let mut axes: Vec<ChartAxis> = GAS_AXES.into_iter().map(gas_axis).collect();
    axes.extend(RATIO_AXES.map(ratio_axis));
    axes.push(linear("Top oil", "°C", 140.0, 105.0));
    axes.push(linear("Load", "p.u.", 1.5, 1.3));
    axes
}

pub(crate) fn legend() -> Vec<ChartState> {
    let state = |name: &str, color, pattern, is_abnormal| ChartState {
        name: name.into(),
        color,
        pattern,
        is_abnormal,
    };
    // In the order of `verdict`'s states.
    vec![
        state("normal (C57.104 status 1)", [150, 154, 160], Pattern::Solid, false),
        state("not judged: a gas is not good", [88, 92, 98], Pattern::Striped, true),
        state("watch (status 2)", [176, 128, 0], Pattern::Dotted, true),
        state("overheating (status 3)", [214, 84, 16], Pattern::Striped, true),
        state("discharges or unclear (status 3)", [178, 16, 36], Pattern::Crossed, true),
    ]
}
