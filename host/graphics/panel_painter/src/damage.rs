//! Damage of panels: the part of the picture in which two frames' panels differ.

use busbar_gpu::ImageArea;
use egui::epaint::{Primitive, Vertex};
use egui::{ClippedPrimitive, Rect, TextureId};

/// Pixels around differing triangles that count as changed: rounding of edges and clips.
const MARGIN: f32 = 1.0;

/// Panels as they were painted last.
#[derive(Default)]
pub(crate) struct PaintedPanels {
    /// Number of pixels in one point.
    scale: f32,
    meshes: Vec<PaintedMesh>,
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

/// Mesh of panels, with its ranges in the lists.
struct PaintedMesh {
    clip: Rect,
    texture: TextureId,
    vertices: std::ops::Range<usize>,
    indices: std::ops::Range<usize>,
}

/// Mesh with its vertices and indices.
#[derive(Clone, Copy)]
struct MeshView<'a> {
    clip: Rect,
    texture: TextureId,
    vertices: &'a [Vertex],
    indices: &'a [u32],
}

/// Returns the meshes of panels in drawing order.
fn meshes(primitives: &[ClippedPrimitive]) -> impl Iterator<Item = MeshView<'_>> {
    primitives.iter().filter_map(|primitive| match &primitive.primitive {
        Primitive::Mesh(mesh) if !mesh.indices.is_empty() => Some(MeshView {
            clip: primitive.clip_rect,
            texture: mesh.texture_id,
            vertices: &mesh.vertices,
            indices: &mesh.indices,
        }),
        _ => None,
    })
}

impl PaintedPanels {
    /// Notes panels that are painted now.
    pub(crate) fn note(&mut self, primitives: &[ClippedPrimitive], scale: f32) {
        self.scale = scale;
        self.meshes.clear();
        self.vertices.clear();
        self.indices.clear();
        for mesh in meshes(primitives) {
            let (vertices, indices) = (self.vertices.len(), self.indices.len());
            self.vertices.extend_from_slice(mesh.vertices);
            self.indices.extend_from_slice(mesh.indices);
            self.meshes.push(PaintedMesh {
                clip: mesh.clip,
                texture: mesh.texture,
                vertices: vertices..self.vertices.len(),
                indices: indices..self.indices.len(),
            });
        }
    }

    fn meshes(&self) -> impl Iterator<Item = MeshView<'_>> {
        self.meshes.iter().map(|mesh| MeshView {
            clip: mesh.clip,
            texture: mesh.texture,
            vertices: &self.vertices[mesh.vertices.clone()],
            indices: &self.indices[mesh.indices.clone()],
        })
    }

    /// Returns the part of a picture of `size` pixels in which other panels differ from these; none
    /// where they do not differ.
    pub(crate) fn difference(
        &self,
        primitives: &[ClippedPrimitive],
        scale: f32,
        size: [u32; 2],
    ) -> Option<ImageArea> {
        if scale != self.scale {
            return Some(ImageArea { origin: [0; 2], size });
        }
        let (mut before, mut now) = (self.meshes(), meshes(primitives));
        let mut points = Rect::NOTHING;
        loop {
            match (before.next(), now.next()) {
                (None, None) => break,
                (Some(before), Some(now)) => points |= difference_of(before, now),
                (Some(mesh), None) | (None, Some(mesh)) => points |= bounds(mesh),
            }
        }
        pixels(points, scale, size)
    }
}

/// Returns the bounds of all that differs between two meshes, points.
fn difference_of(before: MeshView<'_>, now: MeshView<'_>) -> Rect {
    let is_alike = (before.clip, before.texture) == (now.clip, now.texture)
        && before.indices == now.indices
        && before.vertices.len() == now.vertices.len();
    if !is_alike {
        return bounds(before) | bounds(now);
    }
    if before.vertices == now.vertices {
        return Rect::NOTHING;
    }
    // A triangle with one other corner differs as a whole.
    let mut changed = Rect::NOTHING;
    for corners in now.indices.chunks_exact(3) {
        let corners = || corners.iter().map(|&corner| corner as usize);
        if corners().any(|corner| before.vertices[corner] != now.vertices[corner]) {
            for corner in corners() {
                changed.extend_with(before.vertices[corner].pos);
                changed.extend_with(now.vertices[corner].pos);
            }
        }
    }
    changed.intersect(now.clip)
}

/// Returns the bounds of a mesh within its clip rectangle, points.
fn bounds(mesh: MeshView<'_>) -> Rect {
    let mut bounds = Rect::NOTHING;
    mesh.vertices.iter().for_each(|vertex| bounds.extend_with(vertex.pos));
    bounds.intersect(mesh.clip)
}

/// Returns the whole pixels of a rectangle within a picture; none where it has none.
fn pixels(points: Rect, scale: f32, size: [u32; 2]) -> Option<ImageArea> {
    if !points.is_positive() {
        return None;
    }
    let [width, height] = size.map(|pixels| pixels as f32);
    let low = |at: f32, most: f32| (at * scale - MARGIN).floor().clamp(0.0, most) as u32;
    let high = |at: f32, most: f32| (at * scale + MARGIN).ceil().clamp(0.0, most) as u32;
    let origin = [low(points.min.x, width), low(points.min.y, height)];
    let end = [high(points.max.x, width), high(points.max.y, height)];
    let size = [0, 1].map(|axis| end[axis].saturating_sub(origin[axis]));
    (!size.contains(&0)).then_some(ImageArea { origin, size })
}

#[cfg(test)]
mod tests {
    use egui::epaint::Mesh;
    use egui::{Color32, pos2, vec2};

    use super::*;

    const SIZE: [u32; 2] = [200, 100];
    const EVERYTHING: Rect = Rect::EVERYTHING;

    fn quads(clip: Rect, places: &[([f32; 2], u8)]) -> ClippedPrimitive {
        let mut mesh = Mesh::default();
        for ([x, y], shade) in places {
            let place = Rect::from_min_size(pos2(*x, *y), vec2(10.0, 10.0));
            mesh.add_colored_rect(place, Color32::from_gray(*shade));
        }
        ClippedPrimitive { clip_rect: clip, primitive: Primitive::Mesh(mesh) }
    }

    fn difference(
        before: &[ClippedPrimitive],
        now: &[ClippedPrimitive],
        scale: f32,
    ) -> Option<ImageArea> {
        let mut painted = PaintedPanels::default();
        painted.note(before, scale);
        painted.difference(now, scale, SIZE)
    }

    #[test]
    fn equal_panels_differ_nowhere_and_a_changed_quad_in_its_place() {
        let before = [quads(EVERYTHING, &[([20.0, 30.0], 1), ([60.0, 30.0], 2)])];
        assert_eq!(difference(&before, &before.clone(), 1.0), None);
        assert_eq!(difference(&[], &[], 1.0), None);
        let now = [quads(EVERYTHING, &[([20.0, 30.0], 1), ([60.0, 30.0], 3)])];
        let place = ImageArea { origin: [59, 29], size: [12, 12] };
        assert_eq!(difference(&before, &now, 1.0), Some(place));
        let moved = [quads(EVERYTHING, &[([20.0, 30.0], 1), ([80.0, 40.0], 2)])];
        let both = ImageArea { origin: [59, 29], size: [32, 22] };
        assert_eq!(difference(&before, &moved, 1.0), Some(both), "where it was and where it is");
    }

    #[test]
    fn what_came_or_went_and_another_scale_differ() {
        let one = [quads(EVERYTHING, &[([20.0, 30.0], 1)])];
        let two = [one[0].clone(), quads(EVERYTHING, &[([60.0, 30.0], 2)])];
        let place = Some(ImageArea { origin: [59, 29], size: [12, 12] });
        assert_eq!(difference(&one, &two, 1.0), place);
        assert_eq!(difference(&two, &one, 1.0), place);
        let mut painted = PaintedPanels::default();
        painted.note(&one, 1.0);
        let whole = ImageArea { origin: [0; 2], size: SIZE };
        assert_eq!(painted.difference(&one, 2.0, SIZE), Some(whole));
    }

    #[test]
    fn a_clip_bounds_the_difference_and_is_one_itself() {
        let clip = Rect::from_min_max(pos2(0.0, 0.0), pos2(25.0, 100.0));
        let before = [quads(clip, &[([20.0, 30.0], 1), ([60.0, 30.0], 2)])];
        let hidden = [quads(clip, &[([20.0, 30.0], 1), ([60.0, 30.0], 3)])];
        assert_eq!(difference(&before, &hidden, 1.0), None, "nobody sees it");
        let wider = [quads(EVERYTHING, &[([20.0, 30.0], 1), ([60.0, 30.0], 2)])];
        let both = ImageArea { origin: [39, 59], size: [102, 22] };
        assert_eq!(difference(&before, &wider, 2.0), Some(both));
    }
}
