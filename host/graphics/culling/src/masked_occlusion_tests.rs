use glam::Mat4;
use proptest::prelude::*;

use super::*;
use crate::CameraView;

/// No whole number of cells.
const SIZE: [u32; 2] = [75, 43];
const NEAR: f32 = 0.5;

fn camera() -> CameraView {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    CameraView::look_at(Vec3::Z * 10.0, Vec3::ZERO, Vec3::Y, 1.0, aspect, NEAR)
}

fn clip_from_world() -> Mat4 {
    camera().clip_from_world()
}

fn depth_of(samples: u32, faces: &[Vec<Vec3>]) -> MaskedDepthBuffer {
    let mut depth = MaskedDepthBuffer::default();
    depth.begin(&camera(), SIZE, samples);
    for face in faces {
        depth.add(face.iter().map(|corner| clip_from_world() * corner.extend(1.0)));
    }
    depth
}

fn sees(depth: &MaskedDepthBuffer, min: [f32; 3], max: [f32; 3]) -> bool {
    depth.is_visible(&clip_from_world(), &Bounds { min: min.into(), max: max.into() })
}

/// Returns an upright rectangle as corners.
fn wall(left: f32, right: f32, height: f32, z: f32) -> Vec<Vec3> {
    let corner = |x: f32, y: f32| Vec3::new(x, y, z);
    vec![corner(left, -20.0), corner(right, -20.0), corner(right, height), corner(left, height)]
}

#[test]
fn a_wall_hides_what_is_behind_it_and_nothing_else() {
    for samples in [1, 4] {
        let depth = depth_of(samples, &[wall(-20.0, 20.0, 1.0, 5.0)]);
        assert!(!sees(&depth, [-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]), "tolerance it");
        assert!(sees(&depth, [-1.0, -2.0, 6.0], [1.0, 0.0, 7.0]), "before it");
        assert!(sees(&depth, [-1.0, -2.0, 4.0], [1.0, 0.0, 6.0]), "within it");
        assert!(sees(&depth, [-1.0, 1.0, 0.0], [1.0, 3.0, 2.0]), "above it");
        assert!(sees(&depth, [-1.0, 0.0, 0.0], [1.0, 3.0, 2.0]), "partly above it");
        assert!(!sees(&depth, [-90.0, -1.0, 0.0], [-80.0, 0.0, 2.0]), "beside the picture");
        assert!(!sees(&depth, [-1.0, -1.0, 20.0], [1.0, 0.0, 22.0]), "tolerance the eye");
        assert!(sees(&depth, [-1.0, -1.0, 8.0], [1.0, 0.0, 12.0]), "around the eye");
        assert!(sees(&depth, [f32::NAN, -2.0, 0.0], [1.0, 0.0, 2.0]));
    }
}

/// Either way around, and where it reaches behind the eye.
#[test]
fn a_face_is_seen_from_both_sides_and_cut_at_the_near_plane() {
    let mut face = wall(-20.0, 20.0, 1.0, 5.0);
    face.reverse();
    assert!(!sees(&depth_of(1, &[face]), [-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]));
    let at = |x: f32, z: f32| Vec3::new(x, -1.0, z);
    let ground = vec![at(-50.0, 50.0), at(50.0, 50.0), at(50.0, -90.0), at(-50.0, -90.0)];
    let depth = depth_of(1, &[ground]);
    assert!(!sees(&depth, [-1.0, -4.6, 0.0], [1.0, -4.2, 2.0]), "below it");
    assert!(sees(&depth, [-1.0, -4.0, 0.0], [1.0, 0.0, 2.0]), "through it");
    assert!(sees(&depth, [-1.0, -0.9, 0.0], [1.0, 0.0, 2.0]), "above it");
    // Wholly before the near plane, or on edge, it covers nothing.
    for nothing in [wall(-20.0, 20.0, 20.0, 9.9), wall(0.0, 0.0, 20.0, 5.0), Vec::new()] {
        assert!(sees(&depth_of(1, &[nothing]), [-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]));
    }
}

/// Two that meet between pixels leave no gap; one that is apart does.
#[test]
fn faces_cover_together() {
    let box_behind = ([-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]);
    let meets = [wall(-20.0, 0.13, 20.0, 5.0), wall(0.13, 20.0, 20.0, 3.0)];
    assert!(!sees(&depth_of(1, &meets), box_behind.0, box_behind.1));
    let gaps = [wall(-20.0, 0.0, 20.0, 5.0), wall(0.4, 20.0, 20.0, 3.0)];
    assert!(sees(&depth_of(1, &gaps), box_behind.0, box_behind.1));
    // What fills the gap is the farthest.
    let filled = [gaps[0].clone(), gaps[1].clone(), wall(-1.0, 1.0, 20.0, 1.0)];
    assert!(sees(&depth_of(1, &filled), box_behind.0, box_behind.1));
    assert!(!sees(&depth_of(1, &filled), [-1.0, -2.0, -3.0], [1.0, 0.0, 0.5]));
}

#[test]
fn what_has_no_place_covers_nothing() {
    for odd in [f32::NAN, f32::INFINITY, 1e25] {
        for corner in 0..4 {
            let mut face = wall(-20.0, 20.0, 20.0, 5.0);
            face[corner].x = odd;
            assert!(sees(&depth_of(1, &[face]), [-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]), "{odd}");
        }
    }
}

#[test]
fn the_smallest_pictures_are_covered_too() {
    for size in [[1, 1], [8, 8], [9, 7]] {
        let mut depth = MaskedDepthBuffer::default();
        depth.begin(&camera(), size, 1);
        assert!(sees(&depth, [-1.0, -2.0, 0.0], [1.0, 2.0, 2.0]), "{size:?}");
        let face = wall(-20.0, 20.0, 20.0, 5.0);
        depth.add(face.iter().map(|corner| clip_from_world() * corner.extend(1.0)));
        assert!(!sees(&depth, [-1.0, -2.0, 0.0], [1.0, 2.0, 2.0]), "{size:?}");
    }
}

#[test]
fn a_picture_begins_empty() {
    let mut depth = depth_of(1, &[wall(-20.0, 20.0, 20.0, 5.0)]);
    depth.begin(&camera(), SIZE, 1);
    assert!(sees(&depth, [-1.0, -2.0, 0.0], [1.0, 0.0, 2.0]));
}

/// Returns the distance at which a ray first meets a box.
fn entry(eye: Vec3, ray: Vec3, bounds: &Bounds) -> Option<f32> {
    let [a, b] = [(bounds.min - eye) / ray, (bounds.max - eye) / ray];
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    (enter <= leave && leave > 0.0).then_some(enter.max(0.0))
}

/// Reports whether a ray meets a triangle nearer than a distance (T. Möller and B. Trumbore, "Fast,
/// Minimum Storage Ray/Triangle Intersection", 1997).
fn meets(eye: Vec3, ray: Vec3, [a, b, c]: [Vec3; 3], nearer: f32) -> bool {
    let [eye, ray, a, b, c] = [eye, ray, a, b, c].map(|vector| vector.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let across = ray.cross(ac);
    let from = eye - a;
    let along = from.cross(ab);
    let scale = ab.dot(across);
    let (u, v) = (from.dot(across) / scale, ray.dot(along) / scale);
    let distance = ac.dot(along) / scale;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && distance < f64::from(nearer)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 400,
        max_global_rejects: 100_000,
        ..ProptestConfig::default()
    })]

    /// A box taken to be hidden shows in no sample of a pixel.
    #[test]
    fn nothing_that_is_seen_is_taken_to_be_hidden(
        faces in prop::collection::vec(
            prop::array::uniform4(prop::array::uniform2(-14.0_f32..14.0)), 1..24),
        planes in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 24),
        samples in prop::sample::select(vec![1_u32, 4]),
        least in prop::array::uniform3(-4.0_f32..3.0),
        size in prop::array::uniform3(0.01_f32..2.0),
    ) {
        // In a plane each, two triangles that make a convex face or the first alone.
        let faces: Vec<Vec<Vec3>> = faces
            .iter()
            .zip(&planes)
            .map(|(corners, &[slope_x, slope_y, offset])| {
                let place = |[x, y]: [f32; 2]| {
                    Vec3::new(x, y, slope_x * x + slope_y * y + 8.0 * offset)
                };
                let corners = corners.map(place);
                let turn = |from: usize| {
                    let [a, b, c] = [0, 1, 2].map(|step| corners[(from + step) % 4]);
                    (b - a).cross(c - b).z > 0.0
                };
                let is_convex = (0..4).all(|from| turn(from) == turn(0));
                corners[..if is_convex { 4 } else { 3 }].to_vec()
            })
            .collect();
        let depth = depth_of(samples, &faces);
        let min = Vec3::from(least);
        let bounds = Bounds { min, max: min + Vec3::from(size) };
        prop_assume!(depth_of(samples, &[]).is_visible(&clip_from_world(), &bounds));
        prop_assume!(!depth.is_visible(&clip_from_world(), &bounds));
        let eye = camera().eye;
        let world_from_clip = clip_from_world().inverse();
        let [width, height] = SIZE.map(|pixels| pixels as f32);
        let places: &[f32] = if samples == 1 { &[0.5] } else { &[0.01, 0.5, 0.99] };
        let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        let all = pixels.flat_map(|(x, y)| {
            let of = move |&dx: &f32| places.iter().map(move |dy| (x as f32 + dx, y as f32 + dy));
            places.iter().flat_map(of)
        });
        for (x, y) in all {
            let clip = Vec3::new(x / width * 2.0 - 1.0, y / height * 2.0 - 1.0, 1.0);
            let on_near = world_from_clip.project_point3(clip);
            let ray = (on_near - eye).normalize();
            let Some(enters) = entry(eye, ray, &bounds) else { continue };
            let near = on_near.distance(eye);
            // What is before the near plane is not drawn.
            let from = eye + ray * near;
            let is_hidden = faces.iter().any(|face| {
                let fan = (1..face.len() - 1).map(|second| [face[0], face[second], face[second + 1]]);
                fan.into_iter().any(|triangle| meets(from, ray, triangle, enters - near))
            });
            prop_assert!(is_hidden, "at {x}, {y}");
        }
    }
}
