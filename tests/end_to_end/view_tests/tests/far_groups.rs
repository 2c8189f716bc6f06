//! Hierarchical levels of detail: yards far away are drawn as one mesh each, without a visible
//! difference.

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::{Scene, YARDS};
use serde_json::json;

const SIZE: [u32; 2] = [1600, 900];
/// Eye from which a yard's proxy differs from the yard by less than its error allows.
const FAR: [f32; 3] = [60.0, 45.0, 400.0];
const NEAR: [f32; 3] = [60.0, 10.0, 40.0];
const TARGET: [f32; 3] = [60.0, 0.0, 0.0];
/// Extent of a quarter of a pixel at the yards' distance, metres.
const QUARTER_PIXEL: f32 = 0.092;

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    fn draw(&mut self, eye: [f32; 3]) -> Picture {
        self.draw_moved(eye, 0.0)
    }

    /// Draws from an eye moved by `metres` to the right and up.
    fn draw_moved(&mut self, eye: [f32; 3], metres: f32) -> Picture {
        let moved = |[x, y, z]: [f32; 3]| [x + metres, y + metres, z];
        self.viewer.look_from(moved(eye), moved(TARGET));
        self.seconds += 1.0 / 60.0;
        self.viewer.frame(self.viewer.headless_input(self.seconds)).expect("a frame is drawn");
        self.viewer.read_picture().expect("the picture is there")
    }

    /// Returns the equipment at each pixel of the last frame.
    fn ids(&mut self) -> Vec<Option<String>> {
        let pixels: Vec<_> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
        self.viewer.pick_many(&pixels).expect("ids are drawn")
    }
}

/// Counts the indices at which two slices of the same length differ.
fn differing<T: PartialEq>(a: &[T], b: &[T]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

fn visibly(picture: &Picture) -> Vec<[u8; 3]> {
    picture.rgba8.chunks_exact(4).map(|p| [p[0] >> 6, p[1] >> 6, p[2] >> 6]).collect()
}

/// Numbers of pixels whose colour or pick differs from full detail.
#[derive(Debug)]
struct Differences {
    colours: usize,
    pieces: usize,
    /// Pixels at which both show a piece, but of different breakers.
    breakers: usize,
}

impl Differences {
    fn count([a, b]: [&Picture; 2], ids: [&[Option<String>]; 2]) -> Self {
        let both = ids[0].iter().zip(ids[1]).filter_map(|(a, b)| a.as_ref().zip(b.as_ref()));
        Self {
            colours: differing(&visibly(a), &visibly(b)),
            pieces: differing(ids[0], ids[1]),
            breakers: both.filter(|(a, b)| breaker_of(a) != breaker_of(b)).count(),
        }
    }
}

/// Returns the breaker that a piece such as `=Y0Q16/support` belongs to.
fn breaker_of(piece: &str) -> &str {
    piece.split_once('/').map_or(piece, |(breaker, _)| breaker)
}

fn shown(ids: &[Option<String>]) -> usize {
    ids.iter().flatten().count()
}

#[test]
fn far_yards_are_one_mesh_each_and_look_and_pick_as_their_breakers() {
    let mut yards = Scene::yards();
    yards.config["graphics"] = json!({ "samples": 1 });
    yards.config["window"] = json!({ "size": SIZE });
    let scene = LoadedScene::load(&yards.write(), &|_, _, _| {}).expect("the scene loads");
    let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
    let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
    let mut view = View { viewer, seconds: 0.0 };

    let near = view.draw(NEAR);
    let far = view.draw(FAR);
    let stats = view.viewer.stats();
    assert_eq!(stats.groups_as_one, YARDS);
    let ids = view.ids();

    view.viewer.set_theta(0.0);
    let full = view.draw(FAR);
    let of_all = view.viewer.stats();
    assert_eq!((of_all.groups_as_one, of_all.triangles), (0, of_all.triangles_full));
    assert!(stats.triangles * 5 < of_all.triangles, "{} triangles", stats.triangles);
    let full_ids = view.ids();
    let moved = view.draw_moved(FAR, QUARTER_PIXEL);
    let moved_ids = view.ids();
    // Breakers are some four by six pixels here, and most of their pieces less than one: which
    // of them a pixel shows hangs on where its middle is, also at full detail.
    let as_one = Differences::count([&far, &full], [&ids, &full_ids]);
    let by_moving = Differences::count([&moved, &full], [&moved_ids, &full_ids]);
    let [shown, shown_in_full] = [shown(&ids), shown(&full_ids)];
    println!("{as_one:?}, by a quarter of a pixel {by_moving:?}; {shown} of {shown_in_full} shown");
    assert!(shown_in_full > 1000, "there is something to see");
    let apart = shown.abs_diff(shown_in_full);
    assert!(apart * 16 < shown_in_full, "neither thinner nor thicker: {shown}, {shown_in_full}");
    assert!(as_one.colours < by_moving.colours);
    assert!(as_one.pieces < by_moving.pieces);
    assert!(as_one.breakers < by_moving.breakers);

    view.viewer.use_policies();
    assert_eq!(view.draw(NEAR), near, "near, all of it is back");
    assert_eq!(view.draw(FAR), far);
    assert_eq!(view.viewer.stats().validation_messages, Vec::<String>::new());
}
