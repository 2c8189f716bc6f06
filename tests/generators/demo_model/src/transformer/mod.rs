//! A power transformer 220/110/35 kV, 180 MVA, YNyn0d11, with tap changer.
//!
//! Dimensions of the order that makers publish for this rating: tank
//! 8.5 x 3.2 x 4 m, 11 m long and 6 m wide over all, just under 9 m high.
//! Terminals are marked after IEC 60076-1: 1U 1V 1W 1N high voltage, 2.. medium
//! voltage, 3.. low voltage.

mod bushing;
mod cabinet;
mod conservator;
mod radiator;
mod tank;
mod tap_changer;

use busbar_geometry::WeldError;
use busbar_scene::Model;
use glam::{Mat4, Vec2, Vec3};

use crate::fittings::{ladder, rotation};
use crate::shapes::{block, cuboid, strut};
use crate::structure::plinth;
use crate::{Assembly, Finish, NodeId, Part, at};

/// Half of the tank's length (x) and width (z), metres.
const TANK_HALF: Vec2 = Vec2::new(4.25, 1.6);
const TANK_BOTTOM: f32 = 0.62;
const COVER_TOP: f32 = TANK_BOTTOM + 4.0;
/// Height of the foundation's top, metres; that of the rails follows.
const FOUNDATION_TOP: f32 = 0.25;
const RAIL_TOP: f32 = 0.39;
/// Distance to which the ribs of the end walls stand out, metres.
const RIB_FACE: f32 = TANK_HALF.x + 0.13;

const RADIATORS_PER_SIDE: usize = 11;
const RADIATOR_PITCH: f32 = 0.7;
const RADIATOR_Y: f32 = 1.3;
const FANS_PER_SIDE: usize = 8;
const FAN_PITCH: f32 = 0.96;
const FAN_Y: f32 = 0.82;

/// Middle of the conservator's axis, metres.
const CONSERVATOR: Vec3 = Vec3::new(-4.95, 5.85, 0.0);
const TAP_CHANGER: Vec3 = Vec3::new(3.8, COVER_TOP, -0.35);

/// Builds the power transformer.
///
/// # Errors
/// [`WeldError`] if a dimension above were not finite.
pub fn power_transformer() -> Result<Model, WeldError> {
    let (mut assembly, root) = Assembly::new("transformer");
    place_base(&mut assembly, root)?;
    assembly.place_part("tank", root, &tank::tank(), Mat4::IDENTITY)?;
    assembly.place_part("cover", root, &tank::cover(), Mat4::IDENTITY)?;
    place_cooling(&mut assembly, root)?;
    place_bushings(&mut assembly, root)?;
    place_conservator(&mut assembly, root)?;
    place_tap_changer(&mut assembly, root)?;
    place_fittings(&mut assembly, root)?;
    Ok(assembly.into_model())
}

fn place_base(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    assembly.place_part("foundation", root, &plinth(11.6, 6.6, FOUNDATION_TOP), Mat4::IDENTITY)?;
    let mut rails = Part::new();
    for z in [-0.95, 0.95] {
        let height = RAIL_TOP - FOUNDATION_TOP;
        for (width, low, high) in
            [(0.13, -0.02, 0.02), (0.03, 0.0, height - 0.02), (0.075, height - 0.035, height)]
        {
            let bar = cuboid(Vec3::new(10.2, high - low, width));
            rails.add(Finish::DarkPaint, bar.moved(0.0, FOUNDATION_TOP + 0.5 * (low + high), z));
        }
    }
    assembly.place_part("rails", root, &rails, Mat4::IDENTITY)?;
    assembly.place_part("base skids", root, &tank::skids(RAIL_TOP - 0.005), Mat4::IDENTITY)?;
    Ok(())
}

fn place_cooling(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    let radiator_mesh = assembly.mesh(&radiator::radiator())?;
    let fan_mesh = assembly.mesh(&radiator::fan())?;
    let fan_run = FANS_PER_SIDE as f32 * FAN_PITCH;
    let frame_mesh = assembly.mesh(&radiator::fan_frame(fan_run))?;
    let sides = [at(0.0, 0.0, TANK_HALF.y), at(0.0, 0.0, -TANK_HALF.y) * rotation(Vec3::Y, 180.0)];
    for (side, model_from_wall) in sides.into_iter().enumerate() {
        for i in 0..RADIATORS_PER_SIDE {
            let x = centred(i, RADIATORS_PER_SIDE) * RADIATOR_PITCH;
            let name = format!("radiator {}", side * RADIATORS_PER_SIDE + i + 1);
            assembly.place(&name, root, radiator_mesh, model_from_wall * at(x, RADIATOR_Y, 0.0));
        }
        let name = format!("fan frame {}", side + 1);
        let frame = assembly.place(&name, root, frame_mesh, model_from_wall * at(0.0, FAN_Y, 0.0));
        for i in 0..FANS_PER_SIDE {
            let x = centred(i, FANS_PER_SIDE) * FAN_PITCH;
            let name = format!("fan {}", side * FANS_PER_SIDE + i + 1);
            assembly.place(&name, frame, fan_mesh, at(x, 0.07, radiator::MIDDLE));
        }
    }
    Ok(())
}

fn place_bushings(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    struct BushingSet {
        kind: &'static bushing::BushingKind,
        turret_radius: f32,
        turret_height: f32,
        lean_degrees: f64,
        stands: &'static [(&'static str, f32, f32)],
    }
    let sets = [
        BushingSet {
            kind: &bushing::KV_220,
            turret_radius: 0.4,
            turret_height: 0.75,
            lean_degrees: 10.0,
            stands: &[("1U", -1.9, 0.78), ("1V", 0.5, 0.78), ("1W", 2.9, 0.78)],
        },
        BushingSet {
            kind: &bushing::KV_110,
            turret_radius: 0.31,
            turret_height: 0.5,
            lean_degrees: -14.0,
            stands: &[("2U", -2.0, -0.9), ("2V", -0.5, -0.9), ("2W", 1.0, -0.9)],
        },
        BushingSet {
            kind: &bushing::KV_35,
            turret_radius: 0.2,
            turret_height: 0.22,
            lean_degrees: 0.0,
            stands: &[("3U", 2.05, -1.2), ("3V", 2.7, -1.2), ("3W", 3.35, -1.2)],
        },
        BushingSet {
            kind: &bushing::NEUTRAL,
            turret_radius: 0.24,
            turret_height: 0.34,
            lean_degrees: 0.0,
            stands: &[("1N", -3.35, 0.9), ("2N", -3.35, -0.95)],
        },
    ];
    for set in sets {
        let turret_mesh =
            assembly.mesh(&bushing::turret(set.turret_radius, set.turret_height, 0.12))?;
        let bushing_mesh = assembly.mesh(&bushing::bushing(set.kind))?;
        for &(marking, x, z) in set.stands {
            // Turned so that the terminal box looks outwards.
            let outward = if z < 0.0 { rotation(Vec3::Y, 180.0) } else { Mat4::IDENTITY };
            let lean = rotation(Vec3::X, set.lean_degrees);
            let stand = at(x, COVER_TOP, z) * lean * outward;
            let turret = assembly.place(&format!("turret {marking}"), root, turret_mesh, stand);
            let on_flange = at(0.0, set.turret_height, 0.0);
            assembly.place(&format!("bushing {marking}"), turret, bushing_mesh, on_flange);
        }
    }
    Ok(())
}

fn place_conservator(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    let underside = CONSERVATOR.y - conservator::RADIUS;
    let model_from_axis = at(CONSERVATOR.x, CONSERVATOR.y, CONSERVATOR.z);
    let wall_from_axis = -TANK_HALF.x - CONSERVATOR.x - 0.02;
    let bracket = conservator::bracket(wall_from_axis, TANK_BOTTOM + 1.2 - underside);
    assembly.place_part(
        "conservator bracket",
        root,
        &bracket,
        at(CONSERVATOR.x, underside, 0.0),
    )?;
    assembly.place_part("conservator", root, &conservator::vessel(), model_from_axis)?;

    // The pipe rises towards the conservator, so that gas finds the relay.
    let relay = Vec3::new(-4.0, 5.0, 0.0);
    let riser = Vec3::new(-3.3, relay.y - 0.02, 0.0);
    let under_vessel = Vec3::new(CONSERVATOR.x, relay.y + 0.03, 0.0);
    let pipe = [
        Vec3::new(riser.x, COVER_TOP + 0.02, 0.0),
        riser,
        under_vessel,
        under_vessel.with_y(underside + 0.03),
    ];
    assembly.place_part(
        "conservator pipe",
        root,
        &conservator::oil_pipe(&pipe, 0.05),
        Mat4::IDENTITY,
    )?;
    let relay_part = conservator::buchholz_relay();
    assembly.place_part("buchholz relay", root, &relay_part, at(relay.x, relay.y, relay.z))?;

    let breather_z = -1.7;
    let foot = Vec3::new(CONSERVATOR.x, 2.3, breather_z);
    let down = [foot.with_y(underside + 0.04), foot];
    let mut breather = conservator::breather();
    breather.add(Finish::GreyPaint, crate::shapes::pipe(&down.map(|p| p - foot), 0.025, 0.0, 8));
    for y in [0.25, 1.9] {
        // Clamps on stays that run to the bracket's post.
        breather.add(
            Finish::GreyPaint,
            strut(Vec3::new(0.0, y, -0.03), Vec3::new(0.0, y, 0.45), 0.04, 0.02),
        );
    }
    assembly.place_part("silica gel breather", root, &breather, at(foot.x, foot.y, foot.z))?;
    Ok(())
}

fn place_tap_changer(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    let shaft_x = RIB_FACE + tap_changer::DRIVE_SHAFT_X;
    let head = tap_changer::head(shaft_x - TAP_CHANGER.x - 0.13);
    let head_at = at(TAP_CHANGER.x, TAP_CHANGER.y, TAP_CHANGER.z);
    assembly.place_part("tap changer", root, &head, head_at)?;
    let drive_y = 1.9;
    let drive = tap_changer::motor_drive(COVER_TOP + tap_changer::SHAFT_HEIGHT - drive_y);
    assembly.place_part("tap changer drive", root, &drive, at(RIB_FACE, drive_y, TAP_CHANGER.z))?;

    let stub = Vec3::new(TAP_CHANGER.x - 0.24, COVER_TOP + 0.44, TAP_CHANGER.z - 0.16);
    let run_y = COVER_TOP + 0.58;
    let vessel = Vec3::new(CONSERVATOR.x, CONSERVATOR.y - conservator::RADIUS + 0.03, -0.4);
    let run = [
        stub,
        stub.with_y(run_y),
        Vec3::new(3.0, run_y, -0.3),
        Vec3::new(-3.6, run_y + 0.06, -0.3),
        Vec3::new(vessel.x, run_y + 0.07, vessel.z),
        vessel,
    ];
    let mut pipe = conservator::oil_pipe(&run, 0.035);
    for x in [-2.9, -0.9, 1.2, 2.9] {
        let post = cuboid(Vec3::new(0.04, run_y - COVER_TOP + 0.04, 0.04));
        pipe.add(Finish::GreyPaint, post.moved(x, COVER_TOP + 0.5 * (run_y - COVER_TOP), -0.3));
    }
    assembly.place_part("tap changer oil pipe", root, &pipe, Mat4::IDENTITY)?;
    Ok(())
}

fn place_fittings(assembly: &mut Assembly, root: NodeId) -> Result<(), WeldError> {
    let relief_mesh = assembly.mesh(&tank::pressure_relief())?;
    for (i, x) in [-2.4, 2.3].into_iter().enumerate() {
        let name = format!("pressure relief device {}", i + 1);
        assembly.place(&name, root, relief_mesh, at(x, COVER_TOP, 0.05));
    }
    let cabinet_y = 2.05;
    assembly.place_part("cabinet", root, &cabinet::cabinet(), at(RIB_FACE, cabinet_y, 0.75))?;
    assembly.place_part(
        "rating plate",
        root,
        &tank::rating_plate(),
        at(RIB_FACE + 0.2, 3.35, -0.85),
    )?;
    let mut ladder_part = ladder(COVER_TOP + 0.7 - FOUNDATION_TOP);
    for y in [1.0, 3.2] {
        for x in [-0.21, 0.21] {
            let stay = block(Vec3::new(0.03, 0.05, 0.3), 0.005);
            ladder_part.add(Finish::Galvanised, stay.moved(x, y, -0.14));
        }
    }
    let facing_x = rotation(Vec3::Y, 90.0);
    let ladder_at = at(RIB_FACE + 0.2, FOUNDATION_TOP, -1.32) * facing_x;
    assembly.place_part("ladder", root, &ladder_part, ladder_at)?;
    Ok(())
}

/// Returns the position of item `i` of `n` about the middle, in pitches.
fn centred(i: usize, n: usize) -> f32 {
    i as f32 - 0.5 * (n - 1) as f32
}
