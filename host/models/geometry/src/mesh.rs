//! A triangle mesh with welded positions and the wedges that split them.

mod validation;

use std::ops::Range;

use glam::{Mat4, Vec2, Vec3};

/// An indexed triangle mesh.
///
/// A *position* is a welded point of the surface. A *wedge* is one position
/// with one set of attributes: a position on a normal, UV or material seam has
/// several. Triangles name wedges, so that attributes stay as imported, while
/// topology is decided on positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Welded positions in the mesh's own space, metres; each has a wedge.
    pub positions: Vec<Vec3>,
    /// Per-wedge data, parallel arrays.
    pub wedges: Wedges,
    /// Corners as wedge indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Runs of triangles that share a material, in order, covering all.
    pub sections: Vec<Section>,
    /// The feature (piece of equipment) that each position belongs to, or
    /// [`NO_FEATURE`]; empty for a mesh that is one piece. The corners of a
    /// triangle share their feature, so that no collapse leaves it.
    pub features: Vec<u32>,
}

/// A position that belongs to no feature.
pub const NO_FEATURE: u32 = u32::MAX;

/// Per-wedge data as parallel arrays of equal length. Welding puts the wedges
/// of one position together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wedges {
    /// The position each wedge stands on, index into [`Mesh::positions`].
    pub position: Vec<u32>,
    /// Normals as imported; not always of unit length.
    pub normal: Vec<Vec3>,
    /// Texture coordinates; zero where the file gives none.
    pub uv: Vec<Vec2>,
    /// The section a wedge belongs to, index into [`Mesh::sections`].
    pub section: Vec<u32>,
}

/// A run of triangles with one material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Index into the model's materials; `None` draws the default material.
    pub material: Option<u32>,
    /// Index of the first triangle.
    pub first_triangle: u32,
    /// Number of triangles in it.
    pub triangle_count: u32,
}

/// Input of an optimiser: welded positions and triangles over them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topology {
    /// Welded positions, in metres.
    pub positions: Vec<Vec3>,
    /// Corners as position indices.
    pub triangles: Vec<[u32; 3]>,
}

/// An axis-aligned box; by default the origin alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates along each axis.
    pub min: Vec3,
    /// Largest coordinates along each axis.
    pub max: Vec3,
}

impl Mesh {
    /// Returns the positions of a triangle's corners, as position indices.
    pub fn corner_positions(&self, triangle: [u32; 3]) -> [u32; 3] {
        triangle.map(|wedge| self.wedges.position[wedge as usize])
    }

    /// Gives back room that stayed empty.
    pub(crate) fn shrink_to_fit(&mut self) {
        let Self { positions, wedges, triangles, sections, features } = self;
        positions.shrink_to_fit();
        wedges.position.shrink_to_fit();
        wedges.normal.shrink_to_fit();
        wedges.uv.shrink_to_fit();
        wedges.section.shrink_to_fit();
        triangles.shrink_to_fit();
        sections.shrink_to_fit();
        features.shrink_to_fit();
    }

    /// Puts the wedges of each position together, in order of their first one.
    pub fn group_wedges(&mut self) {
        let of_wedges = &self.wedges.position;
        let mut count = vec![0_u32; self.positions.len()];
        let mut runs = 0;
        for (wedge, &position) in of_wedges.iter().enumerate() {
            runs += usize::from(wedge == 0 || of_wedges[wedge - 1] != position);
            count[position as usize] += 1;
        }
        if runs == count.iter().filter(|&&count| count > 0).count() {
            return;
        }
        const UNPLACED: u32 = u32::MAX;
        let mut next = vec![UNPLACED; self.positions.len()];
        let mut placed = 0;
        let place = |&position: &u32| {
            let next = &mut next[position as usize];
            if *next == UNPLACED {
                *next = placed;
                placed += count[position as usize];
            }
            *next += 1;
            *next - 1
        };
        let new_of_old: Vec<u32> = of_wedges.iter().map(place).collect();
        let wedges = &mut self.wedges;
        wedges.position = scatter(&wedges.position, &new_of_old);
        wedges.normal = scatter(&wedges.normal, &new_of_old);
        wedges.uv = scatter(&wedges.uv, &new_of_old);
        wedges.section = scatter(&wedges.section, &new_of_old);
        for corner in self.triangles.as_flattened_mut() {
            *corner = new_of_old[*corner as usize];
        }
    }

    /// Returns the wedge range of each position, once wedges are grouped.
    ///
    /// # Panics
    /// When a position has none: welding makes no such mesh.
    pub(crate) fn wedge_ranges(&self) -> Vec<Range<u32>> {
        let mut ranges = vec![0..0; self.positions.len()];
        for (wedge, &position) in (0_u32..).zip(&self.wedges.position) {
            let range: &mut Range<u32> = &mut ranges[position as usize];
            if range.start == range.end {
                *range = wedge..wedge;
            }
            range.end += 1;
        }
        assert!(ranges.iter().all(|range| range.start < range.end), "a wedge for each position");
        ranges
    }

    /// Returns the feature a triangle belongs to; `None` for none.
    pub fn feature(&self, triangle: [u32; 3]) -> Option<u32> {
        let position = self.wedges.position[triangle[0] as usize];
        self.features.get(position as usize).copied().filter(|&feature| feature != NO_FEATURE)
    }

    /// Copies positions and triangles without attributes.
    pub fn topology(&self) -> Topology {
        Topology {
            positions: self.positions.clone(),
            triangles: self.triangles.iter().map(|&t| self.corner_positions(t)).collect(),
        }
    }

    /// Returns the box around all positions; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::from_points(self.positions.iter().copied())
    }
}

/// Values in a new order: where each goes.
pub(crate) fn scatter<T: Copy + Default>(values: &[T], new_of_old: &[u32]) -> Vec<T> {
    let mut scattered = vec![T::default(); values.len()];
    for (&value, &new) in values.iter().zip(new_of_old) {
        scattered[new as usize] = value;
    }
    scattered
}

impl Wedges {
    /// Returns the number of wedges.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Reports whether there is no wedge.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

impl Bounds {
    /// Returns the box around points; `None` when there are none.
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds, point| match bounds {
            None => Some(Self { min: point, max: point }),
            Some(b) => Some(Self { min: b.min.min(point), max: b.max.max(point) }),
        })
    }

    /// Returns the box around both boxes.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the centre of the box.
    pub fn center(self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Radius of the sphere around the box.
    pub fn radius(self) -> f32 {
        (self.max - self.min).length() * 0.5
    }

    /// Returns the box around the transformed box.
    pub fn transformed(self, transform: &Mat4) -> Self {
        let corners = self.corners().map(|corner| transform.transform_point3(corner));
        let [first, others @ ..] = corners;
        let grown = |b: Self, p: Vec3| Self { min: b.min.min(p), max: b.max.max(p) };
        others.into_iter().fold(Self { min: first, max: first }, grown)
    }

    /// Returns the eight corners of the box.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            Vec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }
}
