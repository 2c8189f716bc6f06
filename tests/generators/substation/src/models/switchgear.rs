//! Breakers and disconnectors, one pole each.

use demo_model::shapes::{Ends, block, loft, pipe};
use demo_model::{Finish, Solid, at};
use glam::{Mat4, Vec3};
use serde_json::{Value, json};

use super::insulator::Column;
use super::steel::{hollow_beam, support};
use super::voltage_class::Class;
use crate::body::{Body, along_x, along_z, tube, turned};

/// Bodies with their names and places.
pub(super) struct Parts {
    pub(super) bodies: Vec<Body>,
    pub(super) places: Vec<(String, usize, Mat4)>,
}

fn part(name: &str, body: usize, place: Mat4) -> (String, usize, Mat4) {
    (name.to_owned(), body, place)
}

/// Builds a mechanism box about its middle.
fn mechanism_box(width: f32, height: f32, depth: f32) -> Body {
    let mut body = Body::new();
    body.add(Finish::GreyPaint, block(Vec3::new(depth, height, width), 0.03));
    body
}

/// Builds a live-tank breaker pole: support column, and the chamber above it. Terminals: below the
/// chamber (+z) and above it (-z).
pub(super) fn breaker(class: &Class) -> Body {
    let s = class.scale();
    let mut body = Body::new();
    let base = class.terminal - class.column - 0.3;
    body.add_body(support(base - 0.3, 0.2), at(0.0, 0.0, 0.0));
    let gear = block(Vec3::new(0.44, 0.36, 0.44), 0.04);
    body.add(Finish::GreyPaint, gear.moved(0.0, base - 0.145, 0.0));
    let pole = class.column_at(base + 0.02, 0.1 + 0.02 * s);
    let waist = [(0.22, 0.02), (0.22, 0.2), (0.25, 0.23), (0.25, 0.25)];
    let chamber = Column {
        base: pole.base + pole.height + 0.255,
        height: 0.8 * class.column,
        core: 0.13 + 0.03 * s,
        overhang: 0.06,
        sheds: class.sheds,
    };
    let cap = [(0.2, 0.14), (0.23, 0.16), (0.21, 0.22), (0.1, 0.3)];
    body.add_body(pole.stacked(&waist, chamber, &cap), at(0.0, 0.0, 0.0));
    let top = chamber.base + chamber.height;
    body.cuboid(Finish::Aluminium, [0.14, 0.03, 0.5], [0.0, top + 0.1, -0.3]);
    body.add_body(mechanism_box(0.66, 1.1, 0.5), at(0.52, 1.45, 0.0));
    let rod = tube(0.02, 0.035, 1.9, base - 0.1, 6).moved(0.42, 0.0, 0.0);
    body.add(Finish::Galvanised, rod);
    body
}

/// Returns the height above the terminals at which the breaker's upper terminal lies.
pub(crate) fn breaker_top(class: &Class) -> f32 {
    class.terminal - 0.025 + 0.8 * class.column + 0.1
}

/// Builds a closed loop of bar through `corners`, square in section.
fn frame(corners: &[Vec3], bar: f32) -> Solid {
    let n = corners.len();
    let middle = corners.iter().sum::<Vec3>() / n as f32;
    let normal = (corners[0] - middle).cross(corners[1] - middle).normalize_or(Vec3::X);
    let ring = |i: usize| {
        let outward = (corners[i] - middle).normalize_or(Vec3::Y) * bar;
        let half = normal * (0.5 * bar);
        [outward + half, outward - half, -outward - half, -outward + half]
            .map(|offset| corners[i] + offset)
            .to_vec()
    };
    loft(&(0..n).map(ring).collect::<Vec<_>>(), Ends::Joined)
}

/// Builds a pantograph pole, closed onto the busbar's contact above it: its fixed body, and its
/// scissors.
pub(super) fn pantograph(class: &Class) -> Parts {
    let s = class.scale();
    let mut body = Body::new();
    let base = class.terminal - class.column;
    body.add_body(support(base - 0.2, 0.18), at(0.0, 0.0, 0.0));
    let spread = 0.24 * s + 0.08;
    body.add_body(hollow_beam(0.22, 2.0 * spread + 0.4), at(0.0, base - 0.1, 0.0));
    body.add_body(class.column_at(base + 0.012, 0.085).body(), at(0.0, 0.0, spread));
    // The operating insulator turns, and is thinner.
    body.add_body(class.column_at(base + 0.014, 0.05).body(), at(0.0, 0.0, -spread));
    let gear = block(Vec3::new(0.3, 0.26, 2.0 * spread + 0.3), 0.04);
    body.add(Finish::Aluminium, gear.moved(0.0, class.terminal + 0.12, 0.0));
    let (low, high) = (class.terminal + 0.22, class.bus - 0.36);
    let reach = high - low;
    let (knee, wide) = (0.48 * reach, 0.42 * reach);
    let mut scissors = Body::new();
    for (i, x) in [-0.09, 0.09].into_iter().enumerate() {
        let lift = 0.01 * i as f32;
        let corners = [
            Vec3::new(x, lift, 0.0),
            Vec3::new(x * 1.3, knee + lift, wide),
            Vec3::new(x * 0.6, reach + lift, 0.0),
            Vec3::new(x * 1.3, knee + lift, -wide),
        ];
        scissors.add(Finish::Aluminium, frame(&corners, 0.05));
    }
    // The horn that grips the trapeze, which hangs from the busbar.
    let horn = tube(0.015, 0.03, -0.35, 0.35, 8).transformed(along_x());
    scissors.add(Finish::Copper, horn.moved(0.0, reach + 0.06, 0.0));
    let trapeze = [
        (-0.3, class.bus - 0.3),
        (0.3, class.bus - 0.3),
        (0.1, class.bus - 0.02),
        (-0.1, class.bus - 0.02),
    ];
    let trapeze = trapeze.map(|(z, y)| Vec3::new(0.0, y, z));
    body.add(Finish::Aluminium, frame(&trapeze, 0.03));
    body.add_body(mechanism_box(0.5, 0.8, 0.4), at(0.42, 1.4, 0.0));
    Parts {
        bodies: vec![body, scissors],
        places: vec![part("body", 0, Mat4::IDENTITY), part("scissors", 1, at(0.0, low, 0.0))],
    }
}

/// Builds a centre-break disconnector pole with two turning columns, closed, the current path along
/// z, with its earthing blade, open: what stands, and three blades, each about its hinge.
pub(super) fn disconnector(class: &Class) -> Parts {
    let s = class.scale();
    let mut body = Body::new();
    let base = class.terminal - class.column;
    let half = 0.52 * class.column + 0.08;
    body.add_body(hollow_beam(0.24, 2.0 * half + 0.5), at(0.0, base - 0.11, 0.0));
    let head = [(0.15, 0.01), (0.15, 0.13), (0.06, 0.15)];
    for z in [-half, half] {
        body.add_body(support(base - 0.2, 0.15), at(0.0, 0.0, z * 0.8));
        body.add_body(class.column_at(base + 0.012, 0.08).with_head(&head), at(0.0, 0.0, z));
    }
    let y = class.terminal + 0.09;
    let radius = 0.035 + 0.015 * s;
    let bar = |from: f32, to: f32, sides: usize| {
        tube(0.7 * radius, radius, from, to, sides).transformed(along_z())
    };
    // Terminals stay where wires end.
    for sign in [-1.0, 1.0] {
        let terminal = bar(half + 0.02, half + 0.3, 4);
        let turn = turned(Vec3::Y, 90.0 - 90.0 * sign);
        body.add(Finish::Aluminium, terminal.transformed(turn).moved(0.0, y, 0.0));
    }
    let mut blades = [Body::new(), Body::new()];
    for blade in &mut blades {
        blade.add(Finish::Aluminium, bar(-0.05, half - 0.04, 6));
    }
    let contact = block(Vec3::new(0.16, 0.2, 0.26), 0.03);
    blades[0].add(Finish::Copper, contact.moved(0.0, 0.0, half));
    let hinge = Vec3::new(0.2, base + 0.02, -half - 0.1);
    let tip = Vec3::new(0.2, base + 0.12, half * 0.9);
    let mut earthing = Body::new();
    earthing.add(Finish::Aluminium, pipe(&[Vec3::ZERO, tip - hinge], 0.03, 0.0, 6));
    body.add_body(mechanism_box(0.46, 0.75, 0.36), at(0.38, 1.35, half * 0.8));
    let drive = tube(0.015, 0.025, 1.6, base - 0.05, 6).moved(0.3, 0.0, half * 0.8);
    body.add(Finish::Galvanised, drive);
    let [first, second] = blades;
    Parts {
        bodies: vec![body, first, second, earthing],
        places: vec![
            part("body", 0, Mat4::IDENTITY),
            part("blade 1", 1, at(0.0, y, -half)),
            part("blade 2", 2, at(0.0, y, half) * turned(Vec3::Y, 180.0)),
            part("earthing blade", 3, Mat4::from_translation(hinge)),
        ],
    }
}

/// Returns the moving parts of a model in the form of a configuration; none for models that stand
/// still.
pub(crate) fn moving_parts(model: &str) -> Option<Value> {
    let blade = |part: &str, degrees: f32| json!({ "part": part, "mechanism": BLADE, "axis": [0, 1, 0], "degrees": degrees });
    let scissors = json!({ "part": "scissors", "mechanism": BLADE, "scale": [1, 0.3, 1.5] });
    let earthing = json!({
        "part": "earthing blade",
        "mechanism": EARTHING_BLADE,
        "modelled": "open",
        "axis": [1, 0, 0],
        "degrees": -88,
    });
    match model.rsplit_once('_')?.0 {
        "disconnector" => Some(json!([blade("blade 1", 90.0), blade("blade 2", -90.0), earthing])),
        "pantograph" => Some(json!([scissors])),
        _ => None,
    }
}

/// Mechanism of a disconnector's current path; that of its earthing blade follows.
pub(crate) const BLADE: &str = "blade";
pub(crate) const EARTHING_BLADE: &str = "earthing blade";

/// Returns half the length of a disconnector's current path, metres.
pub(crate) fn disconnector_reach(class: &Class) -> f32 {
    0.52 * class.column + 0.08 + 0.28
}
