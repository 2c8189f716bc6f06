//! Quadrics of features that a vertex must stay near to: faces, borders and seams.

use glam::DVec3;

use crate::attributes::Attributes;
use crate::quadric::Quadric;
use crate::surface::{Spoke, Surface};

/// Writes the quadric of each vertex, and marks vertices at open edges.
///
/// A face counts with a third of its area at each corner. A border adds a
/// plane through it, upright on its face, that counts as `border_weight` times
/// the square of its length (Garland and Heckbert 1997, section 6); so does a
/// texture or material seam, on either side.
pub(crate) fn measure(
    surface: &mut Surface,
    attributes: Option<&Attributes<'_>>,
    border_weight: f64,
    quadrics: &mut Vec<Quadric>,
) {
    quadrics.clear();
    quadrics.resize(surface.len(), Quadric::default());
    for corners in surface.triangles() {
        let [a, b, c] = corners.map(|v| surface.positions[v as usize]);
        let cross = (b - a).cross(c - a);
        let double_area = cross.length();
        if double_area > 0.0 {
            let share = double_area / 6.0;
            let face = Quadric::plane(cross / double_area, a, share).with_area(share);
            corners.iter().for_each(|&v| quadrics[v as usize] += face);
        }
    }
    let mut ring = Vec::new();
    for vertex in 0..surface.len() as u32 {
        let complete = surface.ring(vertex, &mut ring);
        let quadric = &mut quadrics[vertex as usize];
        if add_edge_planes(surface, attributes, vertex, &ring, border_weight, quadric) || !complete
        {
            surface.open[vertex as usize] = true;
        }
    }
}

/// Adds the planes of the edges at a vertex. Returns whether one is open: has
/// not exactly one triangle on either side.
fn add_edge_planes(
    surface: &mut Surface,
    attributes: Option<&Attributes<'_>>,
    vertex: u32,
    ring: &[Spoke],
    weight: f64,
    quadric: &mut Quadric,
) -> bool {
    let mut open = false;
    // Most rings are closed: each `ahead` is the `behind` of one other.
    surface.begin_marks();
    for spoke in ring {
        open |= !surface.mark(spoke.behind);
    }
    for spoke in ring {
        let closed = surface.is_marked(spoke.ahead);
        open |= !closed;
        if !closed {
            *quadric += upright(surface, vertex, spoke.ahead, spoke.behind, weight);
        } else if let Some(attributes) = attributes {
            let partner = ring.iter().find(|other| other.behind == spoke.ahead);
            let breaks = |other: &Spoke| {
                attributes.is_seam(spoke.wedges[0], other.wedges[0])
                    || attributes.is_seam(spoke.wedges[1], other.wedges[2])
            };
            if let Some(other) = partner.filter(|other| breaks(other)) {
                *quadric += upright(surface, vertex, spoke.ahead, spoke.behind, weight);
                *quadric += upright(surface, vertex, spoke.ahead, other.ahead, weight);
            }
        }
    }
    surface.begin_marks();
    for spoke in ring {
        open |= !surface.mark(spoke.ahead);
    }
    for spoke in ring {
        if !surface.is_marked(spoke.behind) {
            open = true;
            *quadric += upright(surface, vertex, spoke.behind, spoke.ahead, weight);
        }
    }
    open
}

/// Returns the plane through an edge, perpendicular to the face towards `apex`.
fn upright(surface: &Surface, vertex: u32, end: u32, apex: u32, weight: f64) -> Quadric {
    let origin = surface.positions[vertex as usize];
    let along = surface.positions[end as usize] - origin;
    let normal = along.cross(surface.positions[apex as usize] - origin).cross(along);
    let plane = |normal: DVec3| Quadric::plane(normal, origin, weight * along.length_squared());
    normal.try_normalize().map_or(Quadric::default(), plane)
}
