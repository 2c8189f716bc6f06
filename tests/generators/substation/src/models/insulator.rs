//! Porcelain: columns and strings of cap-and-pin discs, one shell each.

use demo_model::Finish;
use demo_model::shapes::{lathe, torus};
use glam::{Mat4, Vec3};

use super::voltage_class::Class;
use crate::body::{Body, along_z};

/// Number of points around a porcelain.
const SEGMENTS: usize = 10;
/// Number of points around a disc.
const DISC_SEGMENTS: usize = 8;
/// Height of the cemented flange at either end of a column, metres.
const FLANGE: f32 = 0.09;
/// Height of a cap-and-pin disc, metres.
const DISC_PITCH: f32 = 0.146;
const DISC_RADIUS: f32 = 0.1275;
const CAP_RADIUS: f32 = 0.05;

/// Porcelain column with a flange at either end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) base: f32,
    pub(super) height: f32,
    /// Radius of the core, metres.
    pub(super) core: f32,
    /// Overhang of a large shed beyond the core, metres.
    pub(super) overhang: f32,
    pub(super) sheds: usize,
}

impl Column {
    /// Builds the column of `2 sheds + 4` rings: two to a flange, root and tip to a shed.
    pub(super) fn body(self) -> Body {
        self.with_head(&[])
    }

    /// Builds the column and, in the same shell, metal turned to `head`: radius and height above
    /// the column.
    pub(super) fn with_head(self, head: &[(f32, f32)]) -> Body {
        let mut profile = self.profile();
        let top = self.base + self.height;
        profile.extend(head.iter().map(|&(radius, y)| (radius, top + y)));
        two_tone(&profile, |y| y > self.base + FLANGE && y < top - FLANGE)
    }

    /// Builds a second column on the first, with metal between and above them.
    pub(super) fn stacked(self, waist: &[(f32, f32)], second: Column, head: &[(f32, f32)]) -> Body {
        let mut profile = self.profile();
        let (low, high) = (self.base + self.height, second.base + second.height);
        profile.extend(waist.iter().map(|&(radius, y)| (radius, low + y)));
        profile.extend(second.profile());
        profile.extend(head.iter().map(|&(radius, y)| (radius, high + y)));
        two_tone(&profile, |y| {
            [self, second].iter().any(|c| y > c.base + FLANGE && y < c.base + c.height - FLANGE)
        })
    }

    fn profile(self) -> Vec<(f32, f32)> {
        let (bottom, top) = (self.base, self.base + self.height);
        let flange = self.core + 0.035;
        let mut profile = vec![(flange, bottom), (flange, bottom + FLANGE)];
        let pitch = (self.height - 2.0 * FLANGE) / self.sheds as f32;
        for shed in 0..self.sheds {
            let root = bottom + FLANGE + pitch * (shed as f32 + 0.24);
            // Large and small in turn; the edge drips, the top slopes.
            let reach = if shed % 2 == 0 { self.overhang } else { self.overhang * 0.72 };
            profile.extend([(self.core, root), (self.core + reach, root - 0.1 * pitch)]);
        }
        profile.extend([(flange, top - FLANGE), (flange, top)]);
        profile
    }
}

fn two_tone(profile: &[(f32, f32)], is_porcelain: impl Fn(f32) -> bool) -> Body {
    let mut body = Body::new();
    let tones = [Finish::Aluminium, Finish::BrownPorcelain];
    let solid = lathe(profile, SEGMENTS);
    body.add_two_tone(tones, &solid, |middle: Vec3| is_porcelain(middle.y));
    body
}

/// Builds a string of discs from y = 0 up to its length; returns the length too.
fn string(discs: usize) -> (Body, f32) {
    let mut profile = vec![(0.02, 0.0)];
    for disc in 0..discs {
        let y = 0.06 + DISC_PITCH * disc as f32;
        profile.extend([(DISC_RADIUS, y), (CAP_RADIUS, y + 0.05), (CAP_RADIUS, y + 0.12)]);
    }
    let length = 0.12 + DISC_PITCH * discs as f32;
    profile.push((0.02, length));
    let mut body = Body::new();
    body.add(Finish::BrownPorcelain, lathe(&profile, DISC_SEGMENTS));
    (body, length)
}

/// Returns the length of a tension set from the beam to the clamp, metres.
pub(crate) fn tension_reach(discs: usize) -> f32 {
    0.12 + DISC_PITCH * discs as f32 + 0.5
}

/// Builds two strings side by side, from the beam at the origin towards -z.
pub(super) fn tension_set(class: &Class) -> Body {
    let mut body = Body::new();
    let length = tension_reach(class.discs) - 0.5;
    for x in [-0.2, 0.2] {
        let (string, _) = string(class.discs);
        let lying = demo_model::at(x, 0.0, -0.25 - length) * along_z();
        body.add_body(string, lying);
    }
    for z in [-0.24, -0.26 - length] {
        body.cuboid(Finish::Galvanised, [0.52, 0.02, 0.12], [0.0, 0.0, z]);
    }
    for z in [-0.12, -0.36 - length] {
        let link = torus(0.1, 0.02, 8, 4).transformed(Mat4::from_scale(Vec3::new(0.5, 1.0, 1.4)));
        body.add(Finish::Galvanised, link.moved(0.0, 0.0, z));
    }
    body
}

/// Builds a string that hangs from the origin, with its clamp.
pub(super) fn suspension_set(class: &Class) -> Body {
    let mut body = Body::new();
    let (string, length) = string(class.discs);
    body.add_body(string, demo_model::at(0.0, -0.2 - length, 0.0));
    body.cuboid(Finish::Galvanised, [0.04, 0.24, 0.04], [0.0, -0.1, 0.0]);
    body.cuboid(Finish::Galvanised, [0.06, 0.12, 0.24], [0.0, -0.24 - length, 0.0]);
    body
}

/// Returns the height of the beam above the clamp, metres.
pub(crate) fn suspension_reach(discs: usize) -> f32 {
    0.27 + 0.12 + DISC_PITCH * discs as f32
}

impl Class {
    /// Returns a column from `base` upwards, its core `core` metres in radius.
    pub(super) fn column_at(&self, base: f32, core: f32) -> Column {
        let overhang = 0.045 + 0.02 * self.scale();
        Column { base, height: self.column, core, overhang, sheds: self.sheds }
    }
}
