//! Faces as a CAD system tessellates them: each by itself, with the exact
//! normals of its surface, its border points shared bit by bit.

use busbar_geometry::RawPrimitive;
use glam::{Mat4, Vec2, Vec3};

/// Vertex of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) position: Vec3,
    /// Surface normal of unit length.
    pub(crate) normal: Vec3,
    /// Coordinates along the surface, metres.
    pub(crate) uv: Vec2,
}

/// Faces of one or more bodies, in their own space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Adds a curved face: a net of `steps` squares each way.
    pub(crate) fn net(&mut self, steps: [usize; 2], vertex: impl Fn(usize, usize) -> Vertex) {
        let first = self.vertices.len() as u32;
        let columns = steps[1] as u32 + 1;
        for u in 0..=steps[0] {
            self.vertices.extend((0..=steps[1]).map(|v| vertex(u, v)));
        }
        for u in 0..steps[0] as u32 {
            for v in 0..steps[1] as u32 {
                let a = first + u * columns + v;
                self.triangle([a, a + 1, a + columns + 1]);
                self.triangle([a, a + columns + 1, a + columns]);
            }
        }
    }

    /// Adds a flat face with holes, level at `height`, facing up or down. Points are x and z.
    pub(crate) fn plate(&mut self, outlines: &[Vec<Vec2>], height: f32, up: bool) {
        let first = self.vertices.len() as u32;
        let normal = if up { Vec3::Y } else { Vec3::NEG_Y };
        let points = outlines.iter().flatten().map(|p| p.to_array());
        self.vertices.extend(outlines.iter().flatten().map(|&point| Vertex {
            position: Vec3::new(point.x, height, point.y),
            normal,
            uv: point,
        }));
        // Where each hole begins.
        let mut begun = 0;
        let starts = outlines.iter().map(|outline| {
            begun += outline.len() as u32;
            begun
        });
        let starts: Vec<u32> = starts.take(outlines.len().saturating_sub(1)).collect();
        let mut corners: Vec<u32> = Vec::new();
        earcut::Earcut::new().earcut(points, &starts, &mut corners);
        for &[a, b, c] in corners.as_chunks().0 {
            self.triangle([a, b, c].map(|corner| first + corner));
        }
    }

    /// Adds a triangle, oriented by its normals, unless its corners coincide.
    fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        let [p, q, r] = [a, b, c].map(|v| self.vertices[v as usize]);
        if p.position == q.position || q.position == r.position || r.position == p.position {
            return;
        }
        let turned = (q.position - p.position).cross(r.position - p.position);
        let outward = turned.dot(p.normal + q.normal + r.normal) >= 0.0;
        self.triangles.push(if outward { [a, b, c] } else { [a, c, b] });
    }

    /// Adds the faces of another shape.
    pub(crate) fn add(&mut self, other: &Self, place: Mat4) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(other.vertices.iter().map(|v| Vertex {
            position: place.transform_point3(v.position),
            normal: place.transform_vector3(v.normal),
            uv: v.uv,
        }));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
    }

    /// Returns the faces as a primitive of a file.
    pub(crate) fn primitive(&self, material: u32) -> RawPrimitive {
        RawPrimitive {
            positions: self.vertices.iter().map(|v| v.position).collect(),
            normals: self.vertices.iter().map(|v| v.normal).collect(),
            uvs: self.vertices.iter().map(|v| v.uv).collect(),
            features: Vec::new(),
            triangles: self.triangles.clone(),
            material: Some(material),
        }
    }
}
