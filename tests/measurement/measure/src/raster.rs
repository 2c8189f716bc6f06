//! Small software rasteriser with a depth buffer: parallel projection, one light.

use busbar_geometry::{Bounds, Topology};
use glam::{Vec2, Vec3, vec2};
use image::{GrayImage, Luma};

/// Grey shade of the background.
const BACKGROUND: u8 = 222;
/// Range of grey shades of a surface.
const SHADES: [f32; 2] = [30.0, 200.0];
/// Direction towards the light, in the camera's axes.
const LIGHT: Vec3 = Vec3::new(-0.35, 0.5, 0.79);

/// Parallel view with its clipping box.
#[derive(Clone, Copy, Debug)]
pub struct View {
    right: Vec3,
    up: Vec3,
    back: Vec3,
    /// Middle of the picture, in the camera's axes.
    center: Vec3,
    /// Half of the picture's height, metres.
    half_height: f32,
    /// Clipping box: points outside are not drawn.
    part: Bounds,
}

/// Rendered picture with its coverage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShadedView {
    /// Grey shade of each pixel.
    pub shades: GrayImage,
    /// Coverage of each pixel by the mesh, row by row.
    pub covered: Vec<bool>,
}

impl View {
    /// Creates a view that frames a box alone, from a direction towards the eye that is not
    /// straight up or down; `aspect` is width over height.
    pub fn of_box(bounds: Bounds, towards_eye: Vec3, aspect: f32) -> Self {
        const MARGIN: f32 = 1.04;
        // Vertices that a simplifier moves may leave the box by a little.
        let beyond = (bounds.max - bounds.min).length() * (MARGIN - 1.0) * 0.5;
        let back = towards_eye.normalize();
        let right = Vec3::Y.cross(back).normalize();
        let up = back.cross(right);
        let seen = bounds.corners().map(|p| Vec3::new(p.dot(right), p.dot(up), p.dot(back)));
        let (min, max) =
            (seen.into_iter().fold(seen[0], Vec3::min), seen.into_iter().fold(seen[0], Vec3::max));
        let half = (max - min) * 0.5;
        Self {
            right,
            up,
            back,
            center: (min + max) * 0.5,
            half_height: half.y.max(half.x / aspect).max(f32::MIN_POSITIVE) * MARGIN,
            part: Bounds { min: bounds.min - beyond, max: bounds.max + beyond },
        }
    }
}

/// Draws a mesh with the normals of its triangles' corners. Surfaces have two
/// sides.
pub fn draw(
    mesh: &Topology,
    normals: &[[Vec3; 3]],
    view: &View,
    [width, height]: [u32; 2],
) -> ShadedView {
    let scale = height as f32 / (2.0 * view.half_height);
    let middle = vec2(width as f32, height as f32) * 0.5;
    let seen = |&p: &Vec3| {
        let p = Vec3::new(p.dot(view.right), p.dot(view.up), p.dot(view.back)) - view.center;
        Vec3::new(middle.x + p.x * scale, middle.y - p.y * scale, p.z)
    };
    let points: Vec<Vec3> = mesh.positions.iter().map(seen).collect();
    let mut canvas = Canvas {
        size: [width as usize, height as usize],
        depths: vec![f32::NEG_INFINITY; (width * height) as usize],
        shades: vec![BACKGROUND; (width * height) as usize],
        middle,
        scale,
        view,
    };
    let light = LIGHT.normalize();
    for (triangle, normals) in mesh.triangles.iter().zip(normals) {
        let lit = normals.map(|n| {
            let n = Vec3::new(n.dot(view.right), n.dot(view.up), n.dot(view.back));
            let facing = if n.z < 0.0 { -n } else { n };
            SHADES[0] + (SHADES[1] - SHADES[0]) * facing.dot(light).max(0.0)
        });
        canvas.fill(triangle.map(|v| points[v as usize]), lit);
    }
    let covered = canvas.depths.iter().map(|depth| depth.is_finite()).collect();
    let shade = |x: u32, y: u32| Luma([canvas.shades[(y * width + x) as usize]]);
    ShadedView { shades: GrayImage::from_fn(width, height, shade), covered }
}

struct Canvas<'a> {
    size: [usize; 2],
    /// Depth buffer: nearness to the eye of each pixel's surface.
    depths: Vec<f32>,
    shades: Vec<u8>,
    middle: Vec2,
    /// Pixels for each metre.
    scale: f32,
    view: &'a View,
}

impl Canvas<'_> {
    /// Fills the pixels whose centres lie in a triangle.
    fn fill(&mut self, [a, b, c]: [Vec3; 3], lit: [f32; 3]) {
        let (pa, pb, pc) = (a.truncate(), b.truncate(), c.truncate());
        let area = (pb - pa).perp_dot(pc - pa);
        if area == 0.0 {
            return;
        }
        let low = pa.min(pb).min(pc);
        let high = pa.max(pb).max(pc);
        let range = |low: f32, high: f32, size: usize| {
            let first = (low - 0.5).ceil().max(0.0) as usize;
            first..((high - 0.5).floor() + 1.0).clamp(0.0, size as f32) as usize
        };
        for y in range(low.y, high.y, self.size[1]) {
            for x in range(low.x, high.x, self.size[0]) {
                let p = vec2(x as f32 + 0.5, y as f32 + 0.5);
                let weights = weights(p, [pa, pb, pc], area);
                if weights.iter().any(|&weight| weight < 0.0) {
                    continue;
                }
                let mix = |v: [f32; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
                let depth = mix([a.z, b.z, c.z]);
                let pixel = y * self.size[0] + x;
                if depth > self.depths[pixel] && self.is_in_part(p, depth) {
                    self.depths[pixel] = depth;
                    self.shades[pixel] = mix(lit).round() as u8;
                }
            }
        }
    }

    /// Reports whether the point that a pixel shows lies in the clipping box.
    fn is_in_part(&self, p: Vec2, depth: f32) -> bool {
        let View { right, up, back, center, part, .. } = *self.view;
        let offset = (p - self.middle) / self.scale;
        let seen = center + Vec3::new(offset.x, -offset.y, depth);
        let point = right * seen.x + up * seen.y + back * seen.z;
        point.cmpge(part.min).all() && point.cmple(part.max).all()
    }
}

/// Returns the barycentric weights of a point, by areas.
fn weights(p: Vec2, [a, b, c]: [Vec2; 3], area: f32) -> [f32; 3] {
    let along = (p - a).perp_dot(c - a) / area;
    let across = (b - a).perp_dot(p - a) / area;
    [1.0 - along - across, along, across]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f32, z: f32, side: f32) -> Topology {
        let at = |u: f32, v: f32| Vec3::new(x + u * side, v * side, z);
        Topology {
            positions: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    fn shot(mesh: &Topology) -> ShadedView {
        let bounds = Bounds { min: Vec3::new(0.0, 0.0, -1.0), max: Vec3::new(8.0, 8.0, 1.0) };
        let view = View { half_height: 4.0, ..View::of_box(bounds, Vec3::Z, 1.0) };
        let normals = vec![[Vec3::Z; 3]; mesh.triangles.len()];
        draw(mesh, &normals, &view, [8, 8])
    }

    #[test]
    fn a_square_covers_its_pixels_once() {
        let shot = shot(&square(1.0, 0.0, 3.0));
        let covered: Vec<_> = (0..64).filter(|&i| shot.covered[i]).collect();
        // Columns 1 to 3 of the lowest three rows.
        assert_eq!(covered, [41, 42, 43, 49, 50, 51, 57, 58, 59]);
        let shade = shot.shades.get_pixel(1, 7).0[0];
        let expected = SHADES[0] + (SHADES[1] - SHADES[0]) * LIGHT.normalize().z;
        assert!((f32::from(shade) - expected).abs() <= 1.0);
        assert_eq!(shot.shades.get_pixel(0, 0).0[0], BACKGROUND);
    }

    #[test]
    fn a_shift_by_a_pixel_changes_one_column_on_each_side() {
        let [still, shifted] = [1.0, 2.0].map(|x| shot(&square(x, 0.0, 3.0)));
        let changed = |i: &usize| still.covered[*i] != shifted.covered[*i];
        let changed: Vec<_> = (0..64).filter(changed).collect();
        assert_eq!(changed, [41, 44, 49, 52, 57, 60]);
    }

    #[test]
    fn the_nearer_surface_shows() {
        let (mut both, far) = (square(0.0, 0.5, 4.0), square(0.0, -0.5, 8.0));
        both.positions.extend(far.positions);
        both.triangles.extend(far.triangles.iter().map(|t| t.map(|v| v + 4)));
        let bounds = Bounds { min: Vec3::new(0.0, 0.0, -1.0), max: Vec3::new(8.0, 8.0, 1.0) };
        let view = View::of_box(bounds, Vec3::Z, 1.0);
        // The near one is turned away from the light.
        let normals = [[[Vec3::X; 3]; 2], [[Vec3::Z; 3]; 2]].concat();
        let shot = draw(&both, &normals, &view, [8, 8]);
        let shade = |x, y| shot.shades.get_pixel(x, y).0[0];
        assert!(shade(1, 6) < shade(6, 1));
        // Of a part nothing else is drawn: the far square's left half.
        let part = Bounds { min: Vec3::NEG_ONE, max: Vec3::new(4.0, 8.0, 0.0) };
        let left = draw(&both, &normals, &View { part, ..view }, [8, 8]);
        assert_eq!(left.covered.iter().filter(|&&covered| covered).count(), 32);
        assert!(left.covered[0] && !left.covered[7]);
    }
}
