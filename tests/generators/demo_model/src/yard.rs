//! The ground of the demo bay: gravel, a kerb, and a covered cable trench from
//! the transformer to the switchgear.

use busbar_geometry::WeldError;
use busbar_scene::Model;
use glam::{Mat4, Vec3};

use crate::shapes::{block, cuboid};
use crate::{Assembly, Finish, Part, at};

/// Size of the yard along x and z, metres.
const WIDTH: f32 = 20.0;
const LENGTH: f32 = 34.0;
/// Foundations reach deeper than the gravel's underside.
const GRAVEL_THICKNESS: f32 = 0.1;
const KERB_WIDTH: f32 = 0.2;
const COVER_LENGTH: f32 = 0.6;
const TRENCH_COVERS: usize = 30;

/// Builds the yard; its middle is at the origin, gravel ends at y = 0.
///
/// # Errors
/// [`WeldError`] if a dimension above were not finite.
pub fn yard() -> Result<Model, WeldError> {
    let (mut assembly, root) = Assembly::new("yard");
    let mut gravel = Part::new();
    gravel.add(
        Finish::Gravel,
        cuboid(Vec3::new(WIDTH, GRAVEL_THICKNESS, LENGTH)).moved(0.0, -GRAVEL_THICKNESS * 0.5, 0.0),
    );
    assembly.place_part("gravel", root, &gravel, Mat4::IDENTITY)?;
    assembly.place_part("kerb", root, &kerb(), Mat4::IDENTITY)?;
    let mut cover = Part::new();
    cover.add(
        Finish::Concrete,
        block(Vec3::new(0.9, 0.08, COVER_LENGTH - 0.02), 0.01).moved(0.0, 0.03, 0.0),
    );
    let cover = assembly.mesh(&cover)?;
    for number in 0..TRENCH_COVERS {
        let z = (number as f32 - (TRENCH_COVERS - 1) as f32 * 0.5) * COVER_LENGTH;
        let name = format!("trench cover {}", number + 1);
        assembly.place(&name, root, cover, at(WIDTH * 0.5 - 2.0, 0.0, z));
    }
    Ok(assembly.into_model())
}

fn kerb() -> Part {
    let mut part = Part::new();
    let (x, z) = ((WIDTH + KERB_WIDTH) * 0.5, (LENGTH + KERB_WIDTH) * 0.5);
    for side in [-1.0, 1.0] {
        let long = block(Vec3::new(KERB_WIDTH, 0.25, LENGTH), 0.02);
        part.add(Finish::Concrete, long.moved(side * x, -0.03, 0.0));
        let across = block(Vec3::new(WIDTH + 2.0 * KERB_WIDTH, 0.25, KERB_WIDTH), 0.02);
        part.add(Finish::Concrete, across.moved(0.0, -0.03, side * z));
    }
    part
}
