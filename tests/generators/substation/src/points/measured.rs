//! Measured values of a bay.

use super::loads::{POWER_FACTOR, load_of};
use super::point_list::{NormalValue, PointContext, PointKind, PointListBuilder, Quantity};

/// Measured values of a bay: the first 14 of every bay, the rest of voltage transformers.
const MEASURED: [Quantity; 18] = [
    ("MMXU.TotW", "active power", "MW", -400.0, 400.0, 1000),
    ("MMXU.TotVAr", "reactive power", "Mvar", -200.0, 200.0, 1000),
    ("MMXU.A.phsA", "current L1", "A", 0.0, 3150.0, 1000),
    ("MMXU.A.phsB", "current L2", "A", 0.0, 3150.0, 1000),
    ("MMXU.A.phsC", "current L3", "A", 0.0, 3150.0, 1000),
    ("MSQI.SeqA.c3", "residual current", "A", 0.0, 3150.0, 1000),
    ("MMXU.PhV.phsA", "voltage L1", "kV", 0.0, 160.0, 1000),
    ("MMXU.PhV.phsB", "voltage L2", "kV", 0.0, 160.0, 1000),
    ("MMXU.PhV.phsC", "voltage L3", "kV", 0.0, 160.0, 1000),
    ("MMXU.PPV.phsAB", "voltage L1-L2", "kV", 0.0, 270.0, 1000),
    ("MMXU.Hz", "frequency", "Hz", 0.0, 55.0, 1000),
    ("MMXU.TotPF", "power factor", "1", -1.0, 1.0, 1000),
    ("MMTR.SupWh", "energy out", "MWh", 0.0, 1.0e7, 5000),
    ("MMTR.DmdWh", "energy in", "MWh", 0.0, 1.0e7, 5000),
    ("MMXU.PPV.phsBC", "voltage L2-L3", "kV", 0.0, 270.0, 1000),
    ("MMXU.PPV.phsCA", "voltage L3-L1", "kV", 0.0, 270.0, 1000),
    ("MSQI.SeqV.c3", "residual voltage", "kV", 0.0, 160.0, 1000),
    ("MHAI.ThdPPV", "voltage distortion", "%", 0.0, 100.0, 1000),
];
const OF_FEEDER: [usize; 14] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13];

/// Adds the measured values of a feeder, at the devices that measure currents and voltages.
pub(super) fn add_measured(bay: &str, at: [&str; 2], node: usize, list: &mut PointListBuilder) {
    add_some_measured(bay, at, node, &OF_FEEDER, list);
}

/// Adds the measured values with these indices, at the devices that measure currents and voltages.
pub(super) fn add_some_measured(
    bay: &str,
    [current, voltage]: [&str; 2],
    node: usize,
    which: &[usize],
    list: &mut PointListBuilder,
) {
    let load = load_of(bay);
    let (power, amperes) = (load.megawatts, load.amperes());
    let (line, phase) = (1.02 * load.kilovolts, 1.02 * load.kilovolts / 3_f64.sqrt());
    let hours_a_unit = 1.0 / power.abs().max(0.1);
    for &index in which {
        let quantity = MEASURED[index];
        let is_voltage = matches!(index, 6..=10 | 14..);
        let (role, usual) = match index {
            0 if load.kilovolts < 100.0 => ("feeder_power", walk(power)),
            0 => ("active_power", walk(power)),
            // Of the same sign as the power.
            1 => ("reactive_power", walk(power * (POWER_FACTOR.powi(-2) - 1.0).sqrt())),
            2..=4 => ("current", walk(amperes)),
            6..=8 => ("phase_voltage", walk(phase)),
            9 | 14 | 15 => ("voltage", walk(line)),
            10 => ("frequency", NormalValue::Walk(50.0, 0.015)),
            11 => ("power_factor", NormalValue::Walk(POWER_FACTOR, 0.004)),
            12 if power > 0.0 => ("energy", NormalValue::Counter(84_000.0, 3600.0 * hours_a_unit)),
            13 if power < 0.0 => ("energy", NormalValue::Counter(84_000.0, 3600.0 * hours_a_unit)),
            12 | 13 => ("energy", NormalValue::Constant(1_200.0)),
            17 => ("distortion", NormalValue::Walk(1.4, 0.1)),
            _ => {
                ("residual", NormalValue::Walk(0.004 * amperes.max(1.0), 0.001 * amperes.max(1.0)))
            }
        };
        let equipment = if is_voltage { voltage } else { current }.to_owned();
        let point = list.add(
            PointKind::Analog,
            quantity,
            PointContext { bay, equipment, node, role },
            usual,
        );
        match role {
            "current" => point.limits[1] = Some(load.rated_amperes),
            "voltage" => point.limits = [0.9, 1.1].map(|share| Some(share * load.kilovolts)),
            "frequency" => point.limits = [Some(49.8), Some(50.2)],
            _ => {}
        }
    }
}

/// Returns a random walk of half a percent, within the deadband of a control centre.
fn walk(base: f64) -> NormalValue {
    NormalValue::Walk(base, 0.005 * base.abs())
}
