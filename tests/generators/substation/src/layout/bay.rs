//! Layout of the devices of one bay.

use super::Placement;
use super::wires::BayKind;
use super::yard::Yard;

/// A bay of a yard.
pub(super) struct Bay<'y> {
    pub(super) yard: &'y Yard,
    pub(super) kind: BayKind,
    pub(super) id: String,
    /// World x of the bay's middle, metres.
    pub(super) x: f32,
}

impl Bay<'_> {
    /// Places a pole in each phase at a depth that may depend on the phase's place.
    fn poles(
        &self,
        device: &str,
        kind: &str,
        depth: f32,
        (diagonal, yaw, aside, height): (f32, f32, f32, f32),
        placements: &mut Vec<Placement>,
    ) {
        for phase in 1..=3 {
            let offset = (f32::from(phase) - 2.0) * self.yard.class.phase;
            let x = self.x + offset + aside;
            placements.push(Placement {
                bay: self.id.clone(),
                device: device.to_owned(),
                phase: Some(phase),
                model: self.yard.class.named(kind),
                translation: self.yard.point(x, height, depth + diagonal * offset),
                yaw_degrees: (self.yard.yaw_degrees + yaw) % 360.0,
            });
        }
    }

    fn single(&self, device: &str, model: String, x: f32, depth: f32, p: &mut Vec<Placement>) {
        p.push(Placement {
            bay: self.id.clone(),
            device: device.to_owned(),
            phase: None,
            model,
            translation: self.yard.point(self.x + x, 0.0, depth),
            yaw_degrees: self.yard.yaw_degrees,
        });
    }
}

/// Placement offsets of devices straight behind one another, facing the lines.
const AHEAD: (f32, f32, f32, f32) = (0.0, 0.0, 0.0, 0.0);
/// Placement offsets of devices that face the transformer: diagonal, yaw, aside, height.
const BACK: (f32, f32, f32, f32) = (0.0, 180.0, 0.0, 0.0);
/// Placement offsets of devices that each stand under their own tube of the busbar.
const DIAGONAL: (f32, f32, f32, f32) = (1.0, 0.0, 0.0, 0.0);

/// Places a bay's devices and wires.
pub(super) fn place_bay(bay: &Bay<'_>, p: &mut Vec<Placement>) {
    let class = bay.yard.class;
    let d = &bay.yard.depths;
    let gantry_y = class.gantry - 0.46;
    if bay.kind != BayKind::VoltageTwo {
        bay.poles("QB1", "pantograph", d.bus_one, DIAGONAL, p);
    }
    if bay.kind != BayKind::VoltageOne {
        bay.poles("QB2", "pantograph", 0.0, DIAGONAL, p);
    }
    let [back_breaker, back_current, back_arrester, back_gantry] = d.back;
    match bay.kind {
        BayKind::Line => {
            bay.poles("UP1", "post", 0.5 * d.bus_one, DIAGONAL, p);
            bay.poles("QA1", "breaker", d.breaker, AHEAD, p);
            bay.poles("BC1", "current_transformer", d.current, AHEAD, p);
            bay.poles("QB9", "disconnector", d.disconnector, AHEAD, p);
            bay.poles("BV1", "voltage_transformer", d.voltage, AHEAD, p);
            bay.poles("FA1", "arrester", d.arrester, AHEAD, p);
            bay.poles("UT1", "tension_set", d.gantry + 0.5, (0.0, 0.0, 0.0, gantry_y), p);
        }
        BayKind::Transformer => {
            bay.poles("UP1", "post", 0.5 * d.bus_one, DIAGONAL, p);
            bay.poles("QA1", "breaker", back_breaker, BACK, p);
            bay.poles("BC1", "current_transformer", back_current, BACK, p);
            bay.poles("FA1", "arrester", back_arrester, BACK, p);
            bay.poles("UT1", "suspension_set", back_gantry, (0.0, 0.0, 0.0, gantry_y), p);
            for (number, side) in [(1, -0.5), (2, 0.5)] {
                let device = format!("UA{number}");
                let x = side * class.pitch;
                bay.single(&device, class.named("gantry_column"), x, back_gantry, p);
            }
            bay.single("UB1", class.named("gantry_beam"), 0.0, back_gantry, p);
        }
        BayKind::Coupler => {
            let aside = 0.5 * class.phase;
            bay.poles("QA1", "breaker", d.breaker, AHEAD, p);
            bay.poles("BC1", "current_transformer", d.current, AHEAD, p);
            bay.poles("UP1", "post", d.disconnector - 1.0, (0.0, 0.0, 0.5 * aside, 0.0), p);
            bay.poles("UP2", "post", 0.5 * d.bus_one, (1.0, 0.0, aside, 0.0), p);
        }
        BayKind::VoltageOne => {
            bay.poles("BV1", "voltage_transformer", d.breaker, AHEAD, p);
            bay.poles("FA1", "arrester", d.current, AHEAD, p);
        }
        BayKind::VoltageTwo => {
            bay.poles("BV1", "voltage_transformer", back_breaker, BACK, p);
            bay.poles("FA1", "arrester", back_current, BACK, p);
        }
    }
    let cubicle_depth = match bay.kind {
        BayKind::Transformer | BayKind::VoltageTwo => back_breaker - 2.2,
        _ => d.breaker + 2.2,
    };
    bay.single("UC1", "cubicle".to_owned(), 0.5 * class.phase, cubicle_depth, p);
    bay.single("WB1", class.named(bay.kind.wires()), 0.0, 0.0, p);
}
