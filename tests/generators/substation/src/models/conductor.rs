//! Conductors: tubular busbars, and wires that hang between terminals.

use demo_model::shapes::sweep;
use demo_model::{Finish, Solid};
use glam::{Vec2, Vec3};

use super::voltage_class::Class;
use crate::body::{Body, along_x, tube};

/// Number of points that one wire may have.
pub(crate) const MAX_WIRE_POINTS: usize = 512;

/// Wire through points, hanging between each two of them.
#[derive(Clone, Debug)]
pub(crate) struct Wire {
    /// Clamps of the wire, in order, metres.
    pub(crate) clamps: Vec<Vec3>,
    /// Ratio of the sag at mid-span to the span's length.
    pub(crate) sag_ratio: f32,
    /// Radius of the wire, metres.
    pub(crate) radius: f32,
    /// Number of segments of each span.
    pub(crate) segments: usize,
    /// Number of points around.
    pub(crate) sides: usize,
}

/// Builds the tube along a wire. Between clamps it follows the parabola that a catenary of small
/// sag is.
pub(crate) fn wire(wire: &Wire) -> Solid {
    let mut path = Vec::new();
    for span in wire.clamps.windows(2) {
        let sag = wire.sag_ratio * span[0].distance(span[1]);
        let segments = wire.segments.clamp(1, MAX_WIRE_POINTS);
        for i in 0..segments {
            let t = i as f32 / segments as f32;
            path.push(span[0].lerp(span[1], t) - Vec3::Y * (4.0 * sag * t * (1.0 - t)));
        }
    }
    path.extend(wire.clamps.last());
    let section: Vec<Vec2> = (0..wire.sides)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / wire.sides as f64;
            Vec2::new(libm::cos(angle) as f32, libm::sin(angle) as f32) * wire.radius
        })
        .collect();
    sweep(&path, &section, Vec3::new(0.31, 0.87, 0.17))
}

/// Builds one bay's length of aluminium tube along x, about its middle.
pub(super) fn bus_tube(class: &Class) -> Body {
    let mut body = Body::new();
    let half = 0.5 * class.pitch - 0.01;
    let outer = 0.05 + 0.025 * class.scale();
    let hollow = tube(0.85 * outer, outer, -half, half, 10);
    body.add(Finish::Aluminium, hollow.transformed(along_x()));
    body
}
