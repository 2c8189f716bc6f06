//! Conductors of a bay, from clamp to clamp.

use demo_model::Finish;
use glam::Vec3;

use super::yard::Yard;
use crate::body::Body;
use crate::models::{
    Winding, Wire, breaker_top, bushing_tip, disconnector_reach, primary_rise, suspension_reach,
    tension_reach, wire,
};
use crate::{Catalogue, StationError};

/// Kind of a bay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BayKind {
    Line,
    Transformer,
    Coupler,
    /// Voltage transformers of busbar I.
    VoltageOne,
    /// Voltage transformers of busbar II.
    VoltageTwo,
}

impl BayKind {
    /// Returns the bay's designation; `number` counts bays of the kind from 1.
    pub(crate) fn designation(self, number: u8) -> String {
        match self {
            Self::Line => format!("Q{number}"),
            Self::Transformer => format!("Q{}", 20 + number),
            Self::Coupler => "Q30".to_owned(),
            Self::VoltageOne => "Q41".to_owned(),
            Self::VoltageTwo => "Q42".to_owned(),
        }
    }

    /// Returns the kind of model that holds the bay's wires.
    pub(crate) fn wires(self) -> &'static str {
        match self {
            Self::Line => "wires_line",
            Self::Transformer => "wires_transformer",
            Self::Coupler => "wires_coupler",
            Self::VoltageOne => "wires_bus_one",
            Self::VoltageTwo => "wires_bus_two",
        }
    }
}

/// Distance beyond the gantry to which outgoing lines are drawn, metres.
const LINE_REACH: f32 = 40.0;
const SEGMENTS: usize = 7;

/// Adds a model of wires for each kind of bay of a yard.
pub(crate) fn add_wires(yard: &Yard, catalogue: &mut Catalogue) -> Result<(), StationError> {
    for kind in [
        BayKind::Line,
        BayKind::Transformer,
        BayKind::Coupler,
        BayKind::VoltageOne,
        BayKind::VoltageTwo,
    ] {
        let mut body = Body::new();
        for phase in 1..=3 {
            // Bay space is the world turned by the yard's yaw.
            let sign = if yard.yaw_degrees == 0.0 { 1.0 } else { -1.0 };
            let phase_x = yard.phase_x(phase);
            for run in runs(yard, kind, phase_x) {
                let clamps: Vec<Vec3> =
                    run.iter().map(|&[x, y, d]| Vec3::new(sign * x, y, -d)).collect();
                let level = clamps.iter().all(|c| (c.y - clamps[0].y).abs() < 1.5);
                let solid = wire(&Wire {
                    clamps,
                    sag_ratio: if level { 0.012 } else { 0.03 },
                    radius: 0.022,
                    segments: SEGMENTS,
                    sides: 6,
                });
                body.add(Finish::Aluminium, solid);
            }
        }
        catalogue.add(&yard.class.named(kind.wires()), body)?;
    }
    Ok(())
}

/// Adds the 35 kV conductors from a transformer's low-voltage bushings, over
/// its side and through the fire wall, to the switch house `house_x` beside it.
pub(crate) fn add_low_voltage(
    name: &str,
    house_x: f32,
    catalogue: &mut Catalogue,
) -> Result<(), StationError> {
    let mut body = Body::new();
    for phase in [-1.0, 0.0, 1.0] {
        let tip = bushing_tip(Winding::Low, phase);
        // The farthest phase from the house runs outermost: none crosses.
        let z = 2.6 - 0.5 * phase * house_x.signum();
        let turn = Vec3::new(tip.x, tip.y + 0.3, z);
        let wall = Vec3::new(house_x, 4.4, z);
        let solid = wire(&Wire {
            clamps: vec![tip, turn, wall],
            sag_ratio: 0.015,
            radius: 0.035,
            segments: SEGMENTS,
            sides: 6,
        });
        body.add(Finish::Aluminium, solid);
    }
    catalogue.add(name, body)
}

/// Returns the clamps of each wire of a phase: x from the bay's middle, height, depth.
fn runs(yard: &Yard, kind: BayKind, x: f32) -> Vec<Vec<[f32; 3]>> {
    let class = yard.class;
    let d = &yard.depths;
    let gear = class.terminal + 0.16;
    let bus_one = [x, gear, d.bus_one + x];
    let bus_two = [x, gear, x];
    let middle = [x, gear, 0.5 * d.bus_one + x];
    let tops = class.terminal + 0.15;
    // Into the housing below the breaker's chamber; from above it onwards.
    let breaker = |depth: f32, ahead: f32| [x, class.terminal - 0.15, depth - 0.15 * ahead];
    let measured = |depth: f32, current: f32, ahead: f32| {
        let primary = class.terminal + primary_rise(class);
        let upper = [x, breaker_top(class), depth + 0.45 * ahead];
        (vec![upper, [x, primary, current - 0.6 * ahead]], [x, primary, current + 0.6 * ahead])
    };
    let [back_breaker, back_current, back_arrester, back_gantry] = d.back;
    match kind {
        BayKind::Line => {
            let (through, after) = measured(d.breaker, d.current, 1.0);
            let reach = disconnector_reach(class);
            let blade = class.terminal + 0.06;
            let clamp = d.gantry + 0.5 + tension_reach(class.discs) - 0.1;
            let clamp = [x, class.gantry - 0.46, clamp];
            vec![
                vec![bus_two, middle, bus_one, breaker(d.breaker, 1.0)],
                through,
                vec![after, [x, blade, d.disconnector - reach]],
                vec![
                    [x, blade, d.disconnector + reach],
                    [x, tops, d.voltage],
                    [x, tops, d.arrester],
                    clamp,
                    [x, class.gantry + 4.0, d.gantry + LINE_REACH],
                ],
            ]
        }
        BayKind::Transformer => {
            let (through, after) = measured(back_breaker, back_current, -1.0);
            let clamp = class.gantry - 0.46 - suspension_reach(class.discs) + 0.08;
            let high = class.highest_kilovolts == 252;
            let winding = if high { Winding::High } else { Winding::Medium };
            let tip = bushing_tip(winding, (x / class.phase).round());
            vec![
                vec![bus_one, middle, bus_two, breaker(back_breaker, -1.0)],
                through,
                vec![
                    after,
                    [x, tops, back_arrester],
                    [x, clamp, back_gantry],
                    [tip.x, tip.y, tip.z.abs() - yard.origin_z.abs()],
                ],
            ]
        }
        BayKind::Coupler => {
            let (through, after) = measured(d.breaker, d.current, 1.0);
            let aside = 0.5 * class.phase;
            vec![
                vec![bus_one, breaker(d.breaker, 1.0)],
                through,
                vec![
                    after,
                    [x + 0.5 * aside, tops, d.disconnector - 1.0],
                    [x + aside, tops, 0.5 * d.bus_one + x],
                    bus_two,
                ],
            ]
        }
        BayKind::VoltageOne => {
            vec![vec![bus_one, [x, tops, d.breaker], [x, tops, d.current]]]
        }
        BayKind::VoltageTwo => {
            vec![vec![bus_two, [x, tops, back_breaker], [x, tops, back_current]]]
        }
    }
}
