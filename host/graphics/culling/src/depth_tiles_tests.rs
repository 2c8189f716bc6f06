use glam::Vec3;
use proptest::prelude::*;

use super::*;

/// No whole number of tiles.
const SIZE: [u32; 2] = [41, 27];
const NEAR: f32 = 0.5;

fn camera() -> CameraView {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    CameraView::look_at(Vec3::Z * 10.0, Vec3::ZERO, Vec3::Y, 1.0, aspect, NEAR)
}

/// Makes depth tiles from a function of the pixel, over the whole picture.
fn drawn(depth_at: impl Fn([u32; 2]) -> f32) -> DepthTiles {
    let mut drawn = DepthTiles::default();
    drawn.begin(&camera(), SIZE);
    (drawn.columns, drawn.rows) =
        (0..SIZE[0].div_ceil(TILE_PIXELS), 0..SIZE[1].div_ceil(TILE_PIXELS));
    let rows = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
    let depths: Vec<f32> = rows.map(depth_at).collect();
    add_tiles(&mut drawn.tiles, &depths, SIZE[0] as usize);
    drawn
}

/// Returns the greatest depth of a box at a pixel's middle, in double precision; `None` beside the
/// box.
fn depth_in(bounds: &Bounds, [x, y]: [u32; 2]) -> Option<f64> {
    let world_from_clip = camera().clip_from_world().as_dmat4().inverse();
    let place = [(x, SIZE[0]), (y, SIZE[1])]
        .map(|(at, pixels)| (f64::from(at) + 0.5) / f64::from(pixels) * 2.0 - 1.0);
    let at = world_from_clip * glam::DVec4::new(place[0], place[1], 1.0, 1.0);
    let (eye, on_near) = (camera().eye.as_dvec3(), at.truncate() / at.w);
    // The near plane is one such way from the eye.
    let morph = on_near - eye;
    let [one, other] = [bounds.min, bounds.max].map(|corner| (corner.as_dvec3() - eye) / morph);
    let (enters, leaves) = (one.min(other).max_element(), one.max(other).min_element());
    (enters <= leaves && enters > 1.0).then_some(enters.recip())
}

proptest! {
    /// An occluded box is hidden at each pixel that it covers; a box beside the picture covers
    /// none.
    #[test]
    fn nothing_is_hidden_that_is_seen(
        center in prop::array::uniform3(-9.0_f32..9.0),
        half in prop::array::uniform3(0.01_f32..2.0),
        seed in any::<u64>(),
        least in 0.01_f32..0.5,
    ) {
        let noise = |[x, y]: [u32; 2]| {
            let mixed = (seed ^ u64::from(x / 6 + 99 * (y / 6))).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            least + (mixed >> 40) as f32 / (1 << 24) as f32 * 0.1
        };
        let drawn = drawn(noise);
        let (center, half) = (Vec3::from(center), Vec3::from(half));
        let bounds = Bounds { min: center - half, max: center + half };
        if !drawn.is_visible(&camera().clip_from_world(), &bounds) {
            let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
            for pixel in pixels {
                let depth = depth_in(&bounds, pixel);
                prop_assert!(depth.is_none_or(|depth| depth < noise(pixel).into()), "{pixel:?}");
            }
        }
    }
}

#[test]
fn a_box_behind_what_was_drawn_is_hidden_and_one_before_it_or_beside_a_gap_is_not() {
    let clip = camera().clip_from_world();
    let sees = |drawn: &DepthTiles, center: [f32; 3]| {
        let [min, max] = [-0.5, 0.5].map(|half| Vec3::from(center) + half);
        drawn.is_visible(&clip, &Bounds { min, max })
    };
    // A wall four metres from the eye.
    let wall = drawn(|_| NEAR / 4.0);
    assert!(!sees(&wall, [0.0, 0.0, 5.0]), "tolerance it");
    assert!(sees(&wall, [0.0, 0.0, 7.0]), "before it");
    assert!(sees(&wall, [0.0, 0.0, 6.0]), "within it");
    assert!(sees(&wall, [0.0, 0.0, 10.0]), "around the eye");
    assert!(!sees(&wall, [0.0, 0.0, 12.0]), "tolerance the eye");
    assert!(!sees(&wall, [50.0, 0.0, 5.0]), "beside the picture");
    assert!(sees(&wall, [f32::NAN, 0.0, 5.0]));
    let gap = drawn(|[x, y]| if [x, y] == [20, 13] { 0.0 } else { NEAR / 4.0 });
    assert!(sees(&gap, [0.0, 0.0, 5.0]), "through the gap");
    assert!(!sees(&gap, [2.5, 0.0, 3.0]), "beside it");
    // What is not known hides nothing.
    let mut part = drawn(|_| NEAR / 4.0);
    part.columns = 0..3;
    assert!(sees(&part, [0.0, 0.0, 5.0]));
}

#[test]
fn what_is_asked_about_is_answered_in_order() {
    let mut drawn = drawn(|_| NEAR / 4.0);
    let clip = camera().clip_from_world();
    for z in [5.0, 7.0, 12.0, 4.0] {
        let min = Vec3::new(-0.5, -0.5, z - 0.5);
        drawn.add_query(&clip, &Bounds { min, max: min + 1.0 });
    }
    assert_eq!(drawn.query_results().collect::<Vec<_>>(), [false, true, false, false]);
}
