//! Closed surfaces with their shading.

use busbar_geometry::RawPrimitive;
use glam::{Mat4, Vec2, Vec3};

/// Greatest angle between faces that are shaded as one smooth surface, degrees.
const CREASE_DEGREES: f64 = 46.0;

/// Solid of one or more closed shells: every edge has two triangles, which turn counter-clockwise
/// seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solid {
    /// Points in the part's own space, metres; none repeated in a shell.
    pub points: Vec<Vec3>,
    /// Corners as indices into `points`.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates, if the finish has a texture.
    pub uv: Option<PlanarUv>,
}

/// Texture coordinates by projection onto a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarUv {
    /// Position of the image's top left corner.
    pub top_left: Vec3,
    /// Vector from the top left to the top right corner.
    pub along_u: Vec3,
    /// Vector from the top left to the bottom left corner.
    pub along_v: Vec3,
}

impl PlanarUv {
    fn at(&self, point: Vec3) -> Vec2 {
        let offset = point - self.top_left;
        Vec2::new(
            offset.dot(self.along_u) / self.along_u.length_squared(),
            offset.dot(self.along_v) / self.along_v.length_squared(),
        )
    }
}

impl Solid {
    /// Transforms the solid. A mirroring transform keeps its faces outward.
    pub fn transformed(mut self, transform: Mat4) -> Self {
        for point in &mut self.points {
            *point = transform.transform_point3(*point);
        }
        if transform.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        if let Some(uv) = &mut self.uv {
            uv.top_left = transform.transform_point3(uv.top_left);
            uv.along_u = transform.transform_vector3(uv.along_u);
            uv.along_v = transform.transform_vector3(uv.along_v);
        }
        self
    }

    /// Translates the solid without rotation.
    pub fn moved(self, x: f32, y: f32, z: f32) -> Self {
        self.transformed(Mat4::from_translation(Vec3::new(x, y, z)))
    }

    /// Maps a texture onto the solid.
    pub fn textured(mut self, uv: PlanarUv) -> Self {
        self.uv = Some(uv);
        self
    }

    /// Computes the enclosed volume in cubic metres; negative if the shells are inside out.
    pub fn signed_volume(&self) -> f64 {
        let point = |i: u32| self.points[i as usize].as_dvec3();
        let sum: f64 =
            self.triangles.iter().map(|&[a, b, c]| point(a).dot(point(b).cross(point(c)))).sum();
        sum / 6.0
    }

    /// Appends the solid to a primitive, with normals smoothed below the
    /// crease angle and weighted by area, so that large faces stay flat.
    pub(crate) fn append_to(&self, primitive: &mut RawPrimitive) {
        let faces: Vec<Vec3> = self.triangles.iter().map(|&t| self.area_vector(t)).collect();
        let mut faces_at = vec![Vec::new(); self.points.len()];
        for (face, corners) in self.triangles.iter().enumerate() {
            corners.iter().for_each(|&v| faces_at[v as usize].push(face));
        }
        let crease = libm::cos(CREASE_DEGREES.to_radians()) as f32;
        for (face, corners) in self.triangles.iter().enumerate() {
            let first = primitive.positions.len() as u32;
            let own = faces[face].normalize_or_zero();
            for &corner in corners {
                let point = self.points[corner as usize];
                let normal: Vec3 = faces_at[corner as usize]
                    .iter()
                    .map(|&other| faces[other])
                    .filter(|other| other.normalize_or_zero().dot(own) >= crease)
                    .sum();
                primitive.positions.push(point);
                primitive.normals.push(normal.try_normalize().unwrap_or(own));
                primitive.uvs.push(self.uv.map_or(Vec2::ZERO, |uv| uv.at(point)));
            }
            primitive.triangles.push([first, first + 1, first + 2]);
        }
    }

    fn area_vector(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|i| self.points[i as usize]);
        (b - a).cross(c - a)
    }
}
