//! Scan damage: regions without data, and outliers.

use glam::Vec3;

use crate::random::{noise, unit};
use crate::scan::Surface;
use crate::scan::field::HEIGHT;

/// Number of spots without data.
const HOLES: u64 = 34;
const HOLE_SEED: u64 = 0x0401_e500;
/// Interval of holes in which a scrap stays, as seen from another scan position.
const SCRAP_EVERY: u64 = 5;

/// Spot of the surface without data.
struct Spot {
    centre: Vec3,
    radius: f32,
    /// Offset of the scrap within the spot, metres.
    scrap: Option<Vec3>,
}

/// Returns the surface with holes, shadows and scraps.
pub(crate) fn damaged(whole: &Surface) -> Surface {
    let spots: Vec<Spot> = (0..HOLES).map(|index| spot(whole, index)).collect();
    let mut left = Surface { points: whole.points.clone(), triangles: Vec::new() };
    for triangle in &whole.triangles {
        let corners = triangle.map(|v| whole.points[v as usize]);
        let centre = corners.iter().sum::<Vec3>() / 3.0;
        if is_shadowed(centre, (corners[1] - corners[0]).cross(corners[2] - corners[0])) {
            continue;
        }
        match spots.iter().find(|spot| spot.covers(centre, 1.0)) {
            None => left.triangles.push(*triangle),
            Some(Spot { scrap: Some(offset), .. })
                if spots.iter().any(|spot| spot.covers(centre, 0.55)) =>
            {
                let first = left.points.len() as u32;
                left.points.extend(triangle.map(|v| whole.points[v as usize] + offset));
                left.triangles.push([first, first + 1, first + 2]);
            }
            Some(_) => {}
        }
    }
    left.compact()
}

impl Spot {
    /// Reports whether a point lies within a share of the radius, with a ragged rim.
    fn covers(&self, point: Vec3, share: f32) -> bool {
        let ragged = 1.0 + 0.25 * noise(point * 60.0, 9);
        point.distance(self.centre) < self.radius * share * ragged
    }
}

fn spot(whole: &Surface, index: u64) -> Spot {
    let seed = HOLE_SEED + 8 * index;
    let at = (unit(seed) * whole.points.len() as f32) as usize;
    let centre = whole.points[at.min(whole.points.len() - 1)];
    let out = Vec3::new(centre.x, 0.0, centre.z).normalize_or_zero();
    Spot {
        centre,
        radius: 0.006 + 0.024 * unit(seed + 1) * unit(seed + 2),
        scrap: index.is_multiple_of(SCRAP_EVERY).then_some(out * 0.006),
    }
}

/// Reports whether a place is hidden from the scanner: undersides near the core on its far side,
/// and the foot, which stands on the ground.
fn is_shadowed(place: Vec3, normal: Vec3) -> bool {
    let down = -normal.y / normal.length().max(f32::MIN_POSITIVE);
    let radius = Vec3::new(place.x, 0.0, place.z).length();
    let ragged = 0.012 * noise(place * 45.0, 11);
    let foot = place.y < 0.004 && down > 0.7;
    let behind = place.x < -0.3 * radius && place.y < HEIGHT * 0.85;
    foot || (behind && down > 0.55 && radius < 0.135 + ragged)
}
