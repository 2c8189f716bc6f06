//! Current and voltage transformers, arresters, posts, one pole each.

use demo_model::shapes::block;
use demo_model::{Finish, at};
use glam::Vec3;

use super::insulator::Column;
use super::steel::{grading_ring, support};
use super::voltage_class::Class;
use crate::body::{Body, along_z, tube};

/// Profile of a rounded metal cap with its clamp: radius, height above the column.
const CAP: [(f32, f32); 4] = [(0.12, 0.03), (0.1, 0.08), (0.05, 0.1), (0.05, 0.16)];

/// Builds an inverted (head-type) current transformer, its primary along z.
pub(super) fn current_transformer(class: &Class) -> Body {
    let s = class.scale();
    let mut body = Body::new();
    let base = class.terminal - class.column;
    body.add_body(support(base - 0.34, 0.19), at(0.0, 0.0, 0.0));
    let foot = block(Vec3::new(0.62, 0.36, 0.62), 0.03);
    body.add(Finish::GreyPaint, foot.moved(0.0, base - 0.165, 0.0));
    let radius = 0.24 + 0.12 * s;
    let head = [
        (radius, 0.12),
        (radius, 0.12 + 0.5 * s),
        (radius * 0.8, 0.2 + 0.5 * s),
        (radius * 0.62, 0.21 + 0.5 * s),
        (radius * 0.62, 0.5 + 0.5 * s),
        (radius * 0.2, 0.55 + 0.5 * s),
    ];
    body.add_body(class.column_at(base + 0.012, 0.13).with_head(&head), at(0.0, 0.0, 0.0));
    let reach = radius + 0.28;
    let bar = tube(0.025, 0.045, -reach, reach, 8).transformed(along_z());
    body.add(Finish::Copper, bar.moved(0.0, class.terminal + primary_rise(class), 0.0));
    body
}

/// Returns height of a current transformer's primary above the terminals, metres.
pub(crate) fn primary_rise(class: &Class) -> f32 {
    0.168 + 0.2 * class.scale()
}

/// Builds a capacitor voltage transformer on its electromagnetic unit.
pub(super) fn voltage_transformer(class: &Class) -> Body {
    let mut body = Body::new();
    let base = class.terminal - class.column;
    body.add_body(support(base - 0.52, 0.19), at(0.0, 0.0, 0.0));
    let tank = block(Vec3::new(0.66, 0.54, 0.66), 0.04);
    body.add(Finish::GreyPaint, tank.moved(0.0, base - 0.255, 0.0));
    let half = Column {
        base: base + 0.012,
        height: 0.5 * class.column - 0.02,
        core: 0.125,
        overhang: 0.055,
        sheds: class.sheds.div_ceil(2),
    };
    let upper = Column { base: half.base + half.height + 0.02, ..half };
    body.add_body(half.stacked(&[], upper, &CAP), at(0.0, 0.0, 0.0));
    body.add_body(grading_ring(0.36), at(0.0, class.terminal + 0.02, 0.0));
    body
}

/// Builds a metal-oxide arrester with grading ring and counter.
pub(super) fn arrester(class: &Class) -> Body {
    let s = class.scale();
    let mut body = Body::new();
    let base = class.terminal - class.column;
    body.add_body(support(base, 0.15), at(0.0, 0.0, 0.0));
    body.add_body(class.column_at(base + 0.012, 0.09).with_head(&CAP), at(0.0, 0.0, 0.0));
    let ring = grading_ring(0.3 + 0.2 * s);
    body.add_body(ring, at(0.0, class.terminal - 0.25 * s, 0.0));
    let counter = block(Vec3::new(0.12, 0.2, 0.16), 0.015);
    body.add(Finish::GreyPaint, counter.moved(0.22, 1.6, 0.0));
    body
}

/// Builds a post insulator on its support.
pub(super) fn post(class: &Class) -> Body {
    let mut body = Body::new();
    let base = class.terminal - class.column;
    body.add_body(support(base, 0.15), at(0.0, 0.0, 0.0));
    body.add_body(class.column_at(base + 0.012, 0.075).with_head(&CAP), at(0.0, 0.0, 0.0));
    body
}
