//! Yards far away are drawn as one mesh each, and nobody sees or feels it.

use busbar_viewer::{LoadedScene, Picture, RendererOptions, Viewer};
use e2e::{Scene, YARDS};
use serde_json::json;

const SIZE: [u32; 2] = [1600, 900];
/// From where a yard is less than its proxy's error away from what it stands for.
const FAR: [f32; 3] = [60.0, 45.0, 400.0];
const NEAR: [f32; 3] = [60.0, 10.0, 40.0];
const TARGET: [f32; 3] = [60.0, 0.0, 0.0];

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    fn draw(&mut self, eye: [f32; 3]) -> Picture {
        self.viewer.look_from(eye, TARGET);
        self.seconds += 1.0 / 60.0;
        self.viewer.frame(self.viewer.headless_input(self.seconds)).expect("a frame is drawn");
        self.viewer.read_picture().expect("the picture is there")
    }

    /// What is at each pixel of the last frame.
    fn ids(&mut self) -> Vec<Option<String>> {
        let pixels: Vec<_> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
        self.viewer.pick_many(&pixels).expect("ids are drawn")
    }
}

/// The share of places at which two of the same length differ.
fn differing<T: PartialEq>(a: &[T], b: &[T]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count() as f64 / a.len() as f64
}

fn visibly(picture: &Picture) -> Vec<[u8; 3]> {
    picture.rgba8.chunks_exact(4).map(|p| [p[0] >> 6, p[1] >> 6, p[2] >> 6]).collect()
}

/// The breaker that a piece `=Y0Q16/support` is of.
fn breaker_of(piece: &str) -> &str {
    piece.split_once('/').map_or(piece, |(breaker, _)| breaker)
}

#[test]
fn far_yards_are_one_mesh_each_and_look_and_pick_as_their_breakers() {
    let mut yards = Scene::yards();
    yards.config["view"] = json!({ "samples": 1, "size": SIZE });
    let scene = LoadedScene::load(&yards.write(), &|_, _, _| {}).expect("the scene loads");
    let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
    let viewer = Viewer::headless(scene, options, SIZE).expect("there is a device");
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
    let (pixels, objects) =
        (differing(&visibly(&far), &visibly(&full)), differing(&ids, &full_ids));
    let shown = full_ids.iter().filter(|id| id.is_some()).count() as f64 / full_ids.len() as f64;
    println!("{pixels} of pixels, {objects} of ids differ; {shown} show something");
    assert!(shown > 0.001, "there is something to see");
    assert!(pixels < 0.002, "{pixels}");
    // Breakers are some four by six pixels here: half a pixel all around would be two fifths.
    assert!(objects < 0.3 * shown, "{objects} of {shown}: half a pixel at the edges");
    // Of those that both show, nearly all are of the same breaker. Its pieces are about a
    // pixel here: half a pixel may show another of them more often.
    let both: Vec<_> =
        ids.iter().zip(&full_ids).filter_map(|(a, b)| a.as_ref().zip(b.as_ref())).collect();
    let others = both.iter().filter(|(a, b)| breaker_of(a) != breaker_of(b)).count();
    let other_pieces = both.iter().filter(|(a, b)| a != b).count();
    println!("{others} breakers and {other_pieces} pieces of {} are others", both.len());
    assert!(others * 40 < both.len(), "{others} breakers of {}", both.len());
    assert!(other_pieces * 10 < both.len(), "{other_pieces} pieces of {}", both.len());

    view.viewer.use_policies();
    assert_eq!(view.draw(NEAR), near, "near, all of it is back");
    assert_eq!(view.draw(FAR), far);
    assert_eq!(view.viewer.stats().validation_messages, Vec::<String>::new());
}
