//! Ground, roads, walls, houses, trenches, and the 35 kV capacitor banks.

use demo_model::shapes::{Ends, block, loft};
use demo_model::{Finish, Solid, at};
use glam::{Mat4, Vec3};

use super::insulator::Column;
use crate::body::{Body, sheet, tube};

/// Corner of the site with the least x and z, metres.
pub(crate) const SITE_MIN: [f32; 2] = [-86.0, -94.0];
/// Corner of the site with the greatest x and z, metres.
pub(crate) const SITE_MAX: [f32; 2] = [86.0, 70.0];
/// Distance from the wall to the middle of the ring road, metres.
const ROAD_INSET: f32 = 6.0;
const ROAD_WIDTH: f32 = 4.0;

/// Builds a band of rectangular section around a rectangle.
fn rectangle(min: [f32; 2], max: [f32; 2], width: f32, low: f32, high: f32) -> Solid {
    let ring = |sx: f32, sz: f32| {
        let corner = |grow: f32, y: f32| {
            let x = if sx < 0.0 { min[0] - grow } else { max[0] + grow };
            let z = if sz < 0.0 { min[1] - grow } else { max[1] + grow };
            Vec3::new(x, y, z)
        };
        let half = 0.5 * width;
        vec![corner(-half, low), corner(-half, high), corner(half, high), corner(half, low)]
    };
    loft(&[ring(-1.0, -1.0), ring(-1.0, 1.0), ring(1.0, 1.0), ring(1.0, -1.0)], Ends::Joined)
}

/// Builds the gravel, within and a little beyond the wall.
pub(super) fn ground() -> Body {
    let mut body = Body::new();
    let grow = 26.0;
    let (min, max) = (SITE_MIN.map(|v| v - grow), SITE_MAX.map(|v| v + grow));
    body.add(Finish::Gravel, sheet(min, max, 0.0, [9, 8]));
    body
}

/// Builds the ring road and the road along the transformers.
pub(super) fn road() -> Body {
    let mut body = Body::new();
    let (min, max) = (SITE_MIN.map(|v| v + ROAD_INSET), SITE_MAX.map(|v| v - ROAD_INSET));
    body.add(Finish::Concrete, rectangle(min, max, ROAD_WIDTH, -0.2, 0.1));
    let length = max[0] - min[0] - ROAD_WIDTH - 0.1;
    for z in [-7.6, 7.6] {
        body.cuboid(Finish::Concrete, [length, 0.31, ROAD_WIDTH], [0.0, -0.056, z]);
    }
    body
}

/// Builds the boundary wall with its piers and gate.
pub(super) fn fence() -> Body {
    const PIER_PITCH: f32 = 6.0;
    let mut body = Body::new();
    body.add(Finish::GreyPaint, rectangle(SITE_MIN, SITE_MAX, 0.24, -0.3, 2.3));
    body.add(Finish::Concrete, rectangle(SITE_MIN, SITE_MAX, 0.36, 2.28, 2.4));
    for (axis, other) in [(0, 1), (1, 0)] {
        let length = SITE_MAX[axis] - SITE_MIN[axis];
        let count = (length / PIER_PITCH) as usize;
        for i in 0..count {
            let along = SITE_MIN[axis] + length * (i as f32 + 0.5) / count as f32;
            for edge in [SITE_MIN[other], SITE_MAX[other]] {
                let (x, z) = if axis == 0 { (along, edge) } else { (edge, along) };
                body.cuboid(Finish::Concrete, [0.44, 2.8, 0.44], [x, 1.1, z]);
            }
        }
    }
    for z in [-3.1, 3.1] {
        body.cuboid(Finish::DarkPaint, [0.12, 2.1, 6.0], [SITE_MAX[0] + 0.3, 1.2, z]);
    }
    body
}

/// Builds a flat-roofed house of `[length, height, depth]` with windows on its long sides and a
/// door at its end.
pub(super) fn house([length, height, depth]: [f32; 3], windows: usize) -> Body {
    let mut body = Body::new();
    let walls = block(Vec3::new(length, height + 0.4, depth), 0.04);
    body.add(Finish::WhiteEnamel, walls.moved(0.0, 0.5 * height - 0.2, 0.0));
    let base = block(Vec3::new(length + 0.3, 0.7, depth + 0.3), 0.03);
    body.add(Finish::Concrete, base.moved(0.0, 0.1, 0.0));
    let roof = block(Vec3::new(length + 0.9, 0.3, depth + 0.9), 0.04);
    body.add(Finish::Concrete, roof.moved(0.0, height + 0.1, 0.0));
    let pitch = length / windows as f32;
    for i in 0..windows {
        let x = (i as f32 - 0.5 * (windows - 1) as f32) * pitch;
        for z in [-0.5, 0.5] {
            body.cuboid(Finish::Aluminium, [1.7, 1.5, 0.1], [x, 2.3, z * depth]);
            body.cuboid(Finish::Glass, [1.5, 1.3, 0.16], [x, 2.301, z * depth]);
        }
    }
    body.cuboid(Finish::DarkPaint, [0.14, 2.4, 1.8], [0.5 * length, 1.45, 0.0]);
    body.cuboid(Finish::Concrete, [1.4, 0.32, 2.6], [0.5 * length + 0.8, 0.1, 0.0]);
    body
}

/// Builds a 35 kV capacitor bank in its frame, with three air-core reactors.
pub(super) fn capacitor_bank() -> Body {
    let mut body = Body::new();
    body.add(Finish::Concrete, block(Vec3::new(13.0, 0.5, 4.6), 0.03));
    for tier in 0..2 {
        let y = 1.0 + 1.5 * tier as f32;
        body.cuboid(Finish::Galvanised, [6.6, 0.12, 1.6], [-2.6, y, 0.0]);
        for i in 0..9 {
            let x = -2.6 + (i as f32 - 4.0) * 0.7;
            let can = block(Vec3::new(0.34, 0.9, 1.1), 0.01);
            body.add(Finish::GreyPaint, can.moved(x, y + 0.5, 0.0));
            let stub =
                Column { base: y + 0.93, height: 0.26, core: 0.03, overhang: 0.03, sheds: 3 };
            body.add_body(stub.body(), at(x, 0.0, 0.3));
        }
    }
    for x in [-5.8, -2.6, 0.6] {
        for z in [-0.75, 0.75] {
            body.cuboid(Finish::Galvanised, [0.12, 3.8, 0.12], [x, 1.9, z]);
        }
    }
    for phase in 0..3 {
        let x = 2.6 + 1.75 * phase as f32;
        let foot = Column { base: 0.24, height: 0.7, core: 0.1, overhang: 0.05, sheds: 6 };
        body.add_body(foot.body(), at(x, 0.0, 0.0));
        body.add(Finish::WhiteEnamel, tube(0.45, 0.75, 0.98, 2.3, 20).moved(x, 0.0, 0.0));
        body.cuboid(Finish::Aluminium, [1.44, 0.06, 0.1], [x, 0.96, 0.0]);
    }
    body
}

/// Builds a bay's marshalling cubicle; its door looks towards x.
pub(super) fn cubicle() -> Body {
    let mut body = Body::new();
    let case = block(Vec3::new(0.7, 1.6, 1.1), 0.02);
    body.add(Finish::GreyPaint, case.moved(0.0, 1.04, 0.0));
    let door = block(Vec3::new(0.03, 1.45, 1.0), 0.01);
    body.add(Finish::GreyPaint, door.moved(0.355, 1.04, 0.0));
    body
}

/// Builds a fire wall beside a transformer, along z.
pub(super) fn fire_wall() -> Body {
    let mut body = Body::new();
    body.add(Finish::Concrete, block(Vec3::new(0.35, 7.2, 10.4), 0.03).moved(0.0, 3.4, 0.0));
    body
}

/// Builds the kerb and stone bed that catch a transformer's oil.
pub(super) fn oil_pit() -> Body {
    let mut body = Body::new();
    let (min, max) = ([-6.6, -4.6], [6.6, 4.6]);
    body.add(Finish::Concrete, rectangle(min, max, 0.3, -0.3, 0.22));
    body.cuboid(Finish::Gravel, [13.0, 0.2, 9.0], [0.0, 0.02, 0.0]);
    body
}

/// Cable trenches by start and end: x and z in metres.
const TRENCHES: [[[f32; 2]; 2]; 5] = [
    [[-76.0, -54.2], [76.0, -54.2]],
    [[-70.0, 36.4], [60.0, 36.4]],
    [[-76.0, -11.0], [76.0, -11.0]],
    [[-78.0, -53.2], [-78.0, -12.0]],
    [[-78.0, -10.0], [-78.0, 17.0]],
];

/// Returns length of all trenches, metres.
pub(crate) fn trench_metres() -> f32 {
    TRENCHES.iter().map(|[[x, z], [u, w]]| (u - x).abs() + (w - z).abs()).sum()
}

/// Builds the cable trenches under `covers` slabs of equal length.
pub(crate) fn trench(covers: usize) -> Body {
    let mut body = Body::new();
    let total = trench_metres();
    let mut placed = 0;
    let mut run = 0.0;
    for [[x, z], [u, w]] in TRENCHES {
        let length = (u - x).abs() + (w - z).abs();
        run += length;
        let until = (covers as f32 * run / total).round() as usize;
        let count = until.saturating_sub(placed);
        for i in 0..count {
            let share = (i as f32 + 0.5) / count as f32;
            let slab = length / count as f32 - 0.015;
            let size = if u == x { [1.1, 0.16, slab] } else { [slab, 0.16, 1.1] };
            let middle =
                Mat4::from_translation(Vec3::new(x + (u - x) * share, 0.04, z + (w - z) * share));
            let mut cover = Body::new();
            cover.cuboid(Finish::Concrete, size, [0.0; 3]);
            body.add_body(cover, middle);
        }
        placed = placed.max(until);
    }
    body
}
