//! Vertex colours (COLOR_0) as materials: a material for each colour of flat triangles, and small
//! textures for gradients.
//!
//! The colours of a triangle lie in a plane of the colour space, and are linear over it. So
//! triangles whose colours share a plane share a texture of that plane, and their texture
//! coordinates are coordinates in it. A point between two of them is a colour between both,
//! however the mesh is simplified.

use std::collections::HashMap;

use busbar_geometry::RawPrimitive;
use busbar_scene::{AlphaMode, Material, Texture, TextureRef, Wrap};
use glam::{Vec2, Vec4};

use crate::report::Notes;

/// Materials that vertex colours may add to a model.
const MAX_ADDED_MATERIALS: usize = 1024;
/// Planes of colours in one primitive.
const MAX_PLANES: usize = 32;
/// Colours of flat triangles in one primitive that have a material each.
const MAX_FLAT_COLORS: usize = 64;
/// Difference of colours that nobody sees, linear light.
const TOLERANCE: f32 = 0.004;
/// Side of a plane's texture, pixels.
const SIDE: u32 = 64;

const APPROXIMATED: &str = "primitive whose vertex colours are shown in coarser steps";

/// The materials and textures of a model, to which colours add theirs.
pub(crate) struct ColorMaterials<'a> {
    pub(crate) materials: &'a mut Vec<Material>,
    pub(crate) textures: &'a mut Vec<Texture>,
    added: usize,
    /// Materials of flat colours, by the material that they tint.
    known: HashMap<(Option<u32>, [u8; 4]), u32>,
}

/// Triangles that share a material, and their texture coordinates by vertex if they have new ones.
struct Group {
    material: Option<u32>,
    triangles: Vec<[u32; 3]>,
    uvs: HashMap<u32, Vec2>,
}

impl<'a> ColorMaterials<'a> {
    pub(crate) fn new(materials: &'a mut Vec<Material>, textures: &'a mut Vec<Texture>) -> Self {
        Self { materials, textures, added: 0, known: HashMap::new() }
    }

    /// Splits a primitive by its colours, one a vertex, in linear light.
    pub(crate) fn split(
        &mut self,
        primitive: RawPrimitive,
        mut colors: Vec<Vec4>,
        notes: &mut Notes,
    ) -> Vec<RawPrimitive> {
        let base = primitive.material.and_then(|index| self.materials.get(index as usize));
        let base = base.cloned().unwrap_or_else(white);
        for color in &mut colors {
            *color = if color.is_nan() { Vec4::ONE } else { color.clamp(Vec4::ZERO, Vec4::ONE) };
            if base.alpha == AlphaMode::Opaque {
                color.w = 1.0;
            }
        }
        if colors.iter().all(|color| color.abs_diff_eq(Vec4::ONE, TOLERANCE)) {
            return vec![primitive];
        }
        let textured =
            base.base_color_texture.is_some() || base.metallic_roughness_texture.is_some();
        let corners = |triangle: [u32; 3]| triangle.map(|vertex| colors[vertex as usize]);
        let (flat, graded): (Vec<_>, Vec<_>) = primitive
            .triangles
            .iter()
            .partition(|&&triangle| textured || is_flat(corners(triangle)));
        let mut groups = Vec::new();
        let is_coarse = textured && primitive.triangles.iter().any(|&t| !is_flat(corners(t)));
        let mut coarse = is_coarse;
        let flats = by_color(&flat, &corners, if textured { &STEPS } else { &STEPS[..1] });
        let graded = match flats {
            Some((steps, flats)) => {
                coarse |= steps != STEPS[0];
                for (color, triangles) in flats {
                    let material = self.tinted(primitive.material, &base, color);
                    coarse |= material.is_none();
                    let material = material.unwrap_or(primitive.material);
                    groups.push(Group { material, triangles, uvs: HashMap::new() });
                }
                graded
            }
            None => primitive.triangles.clone(),
        };
        let (planes, off) = fit_planes(&graded, &corners);
        coarse |= off;
        for (plane, triangles) in planes {
            let material = self.textured(&base, plane.texture());
            coarse |= material.is_none();
            let material = material.unwrap_or(primitive.material);
            let vertices = triangles.as_flattened().iter();
            let uvs = vertices.map(|&vertex| (vertex, plane.uv(colors[vertex as usize])));
            groups.push(Group { material, uvs: uvs.collect(), triangles });
        }
        notes.add_many(APPROXIMATED, coarse.into());
        groups.into_iter().map(|group| group.extract(&primitive)).collect()
    }

    /// Returns the material of a colour; `None` where there are too many.
    fn tinted(&mut self, index: Option<u32>, base: &Material, color: Vec4) -> Option<Option<u32>> {
        let key = (index, color.to_array().map(encoded));
        if let Some(&known) = self.known.get(&key) {
            return Some(Some(known));
        }
        let base_color = (Vec4::from_array(base.base_color) * color).to_array();
        let added = self.add(Material { base_color, ..base.clone() })?;
        self.known.insert(key, added);
        Some(Some(added))
    }

    /// Returns the material of a plane of colours; `None` where there are too many.
    fn textured(&mut self, base: &Material, texture: Texture) -> Option<Option<u32>> {
        let reference = TextureRef { texture: self.textures.len() as u32, wrap: [Wrap::Clamp; 2] };
        let added = self.add(Material { base_color_texture: Some(reference), ..base.clone() })?;
        self.textures.push(texture);
        Some(Some(added))
    }

    fn add(&mut self, material: Material) -> Option<u32> {
        if self.added == MAX_ADDED_MATERIALS {
            return None;
        }
        self.added += 1;
        self.materials.push(material);
        Some(self.materials.len() as u32 - 1)
    }
}

/// Default material of coloured vertices: they alone decide the colour.
fn white() -> Material {
    Material { base_color: [1.0; 4], ..Material::default() }
}

fn is_flat([a, b, c]: [Vec4; 3]) -> bool {
    a.abs_diff_eq(b, TOLERANCE) && a.abs_diff_eq(c, TOLERANCE)
}

/// Steps of each channel by which colours are told apart, the finest first.
const STEPS: [f32; 4] = [255.0, 15.0, 7.0, 3.0];

type ByColor = Vec<(Vec4, Vec<[u32; 3]>)>;

/// Groups triangles by their mean colour, in the finest steps that give few colours; `None` where
/// even the coarsest give too many.
fn by_color(
    triangles: &[[u32; 3]],
    corners: &impl Fn([u32; 3]) -> [Vec4; 3],
    steps: &[f32],
) -> Option<(f32, ByColor)> {
    'steps: for &steps in steps {
        let mut index_of: HashMap<[u8; 4], usize> = HashMap::new();
        let mut groups: ByColor = Vec::new();
        for &triangle in triangles {
            let mean = corners(triangle).into_iter().sum::<Vec4>() / 3.0;
            // Steps that look alike: the square root is near the sRGB curve.
            let step = mean.to_array().map(|channel| (channel.sqrt() * steps).round());
            let index = *index_of.entry(step.map(|step| step as u8)).or_insert(groups.len());
            if index == groups.len() {
                if index == MAX_FLAT_COLORS && steps > 3.0 {
                    continue 'steps;
                }
                let color = match steps == STEPS[0] {
                    true => mean,
                    false => Vec4::from_array(step.map(|step| (step / steps).powi(2))),
                };
                groups.push((color, Vec::new()));
            }
            groups[index].1.push(triangle);
        }
        return Some((steps, groups));
    }
    None
}

/// A plane of colours: a point and up to two directions, with the part that is used.
struct Plane {
    origin: Vec4,
    axes: Vec<Vec4>,
    low: Vec2,
    high: Vec2,
}

impl Plane {
    fn at(origin: Vec4) -> Self {
        Self { origin, axes: Vec::new(), low: Vec2::ZERO, high: Vec2::ZERO }
    }

    /// Turns the plane so that it holds colours, as far as it has directions left. Reports whether
    /// it holds them.
    fn extend(&mut self, colors: [Vec4; 3]) -> bool {
        let before = self.axes.len();
        for color in colors {
            let rest = self.rest(color);
            if rest.length() <= TOLERANCE {
                continue;
            }
            if self.axes.len() == 2 {
                self.axes.truncate(before);
                return false;
            }
            self.axes.push(rest.normalize());
        }
        true
    }

    /// Returns the part of a colour that is beside the plane.
    fn rest(&self, color: Vec4) -> Vec4 {
        let offset = color - self.origin;
        self.axes.iter().fold(offset, |rest, axis| rest - *axis * rest.dot(*axis))
    }

    fn distance(&self, colors: [Vec4; 3]) -> f32 {
        colors.map(|color| self.rest(color).length()).into_iter().fold(0.0, f32::max)
    }

    fn coordinates(&self, color: Vec4) -> Vec2 {
        let along =
            |axis: usize| self.axes.get(axis).map_or(0.0, |axis| (color - self.origin).dot(*axis));
        Vec2::new(along(0), along(1))
    }

    /// Returns the texture coordinate of a colour, between the centres of the outermost pixels.
    fn uv(&self, color: Vec4) -> Vec2 {
        let span = (self.high - self.low).max(Vec2::splat(f32::MIN_POSITIVE));
        let share = ((self.coordinates(color) - self.low) / span).clamp(Vec2::ZERO, Vec2::ONE);
        let side = SIDE as f32;
        (share * (side - 1.0) + 0.5) / side
    }

    /// Draws the used part of the plane.
    fn texture(&self) -> Texture {
        let mut rgba8 = Vec::with_capacity((SIDE * SIDE * 4) as usize);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let share = Vec2::new(x as f32, y as f32) / (SIDE - 1) as f32;
                let at = self.low + (self.high - self.low) * share;
                let along = self.axes.iter().zip(at.to_array());
                let color = along.fold(self.origin, |color, (axis, at)| color + *axis * at);
                let [r, g, b, a] = color.clamp(Vec4::ZERO, Vec4::ONE).to_array();
                rgba8.extend([encoded(r), encoded(g), encoded(b), (a * 255.0).round() as u8]);
            }
        }
        Texture { width: SIDE, height: SIDE, rgba8 }
    }
}

/// Planes, and the triangles of each.
type Planes = Vec<(Plane, Vec<[u32; 3]>)>;

/// Finds planes for triangles. Reports whether any triangle is off its plane.
fn fit_planes(triangles: &[[u32; 3]], corners: &impl Fn([u32; 3]) -> [Vec4; 3]) -> (Planes, bool) {
    let mut planes: Planes = Vec::new();
    let mut off = false;
    let mut last = 0;
    for &triangle in triangles {
        let colors = corners(triangle);
        // Neighbours mostly share a plane.
        let order = (last..planes.len()).chain(0..last.min(planes.len()));
        let mut best = (f32::INFINITY, 0);
        for index in order {
            let plane = &mut planes[index].0;
            if plane.extend(colors) {
                best = (0.0, index);
                break;
            }
            let distance = plane.distance(colors);
            if distance < best.0 {
                best = (distance, index);
            }
        }
        let (distance, mut index) = best;
        if distance > TOLERANCE {
            if planes.len() < MAX_PLANES {
                index = planes.len();
                let mut plane = Plane::at(colors[0]);
                plane.extend(colors);
                planes.push((plane, Vec::new()));
            } else {
                off = true;
            }
        }
        last = index;
        let (plane, of_plane) = &mut planes[index];
        for color in colors {
            let at = plane.coordinates(color);
            plane.low = plane.low.min(at);
            plane.high = plane.high.max(at);
        }
        of_plane.push(triangle);
    }
    (planes, off)
}

/// Encodes linear light as an sRGB byte (IEC 61966-2-1).
fn encoded(light: f32) -> u8 {
    let value =
        if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (value * 255.0).round() as u8
}

impl Group {
    /// Takes the group's triangles out of a primitive, with the vertices that they name.
    fn extract(self, primitive: &RawPrimitive) -> RawPrimitive {
        let Self { material, mut triangles, uvs } = self;
        let mut part = RawPrimitive { material, ..RawPrimitive::default() };
        let mut new_of_old: HashMap<u32, u32> = HashMap::new();
        for corner in triangles.as_flattened_mut() {
            let old = *corner;
            *corner = *new_of_old.entry(old).or_insert_with(|| {
                let vertex = old as usize;
                part.positions.push(primitive.positions[vertex]);
                part.normals.extend(primitive.normals.get(vertex));
                match uvs.get(&old) {
                    Some(&uv) => part.uvs.push(uv),
                    None => part.uvs.extend(primitive.uvs.get(vertex)),
                }
                part.features.extend(primitive.features.get(vertex));
                part.positions.len() as u32 - 1
            });
        }
        part.triangles = triangles;
        part
    }
}
