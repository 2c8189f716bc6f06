//! Tests of camera commands on a navigator.

use busbar_scene::SceneGraph;
use egui::{Pos2, vec2};

use super::*;

struct NavigatorFixture {
    navigator: Navigator,
    graph: SceneGraph,
    cameras: BTreeMap<String, CameraConfig>,
    time: f64,
}

impl NavigatorFixture {
    fn new(start: &str, in_window: bool) -> Self {
        let text = format!(
            r#"{{"version": 1, "scene": [], "camera": {start}, "cameras": {{
                "far": {{"eye": [0, 10, 100], "target": [0, 0, 0]}},
                "plan": {{"eye": [0, 50, 0.001], "target": [0, 0, 0],
                    "projection": "orthographic", "height": 30}}
            }}}}"#
        );
        let config = busbar_config::parse(&text).unwrap();
        let camera = Camera::look_at(Vec3::new(0.0, 8.0, 20.0), Vec3::Y * 2.0, 0.8);
        Self {
            navigator: Navigator::new(camera, &config.view, in_window),
            graph: SceneGraph::build(&[], &[]).unwrap(),
            cameras: config.cameras,
            time: 0.0,
        }
    }

    fn steer(&mut self, command: Command) {
        let viewport = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 450.0));
        let Self { navigator, graph, cameras, .. } = self;
        navigator
            .steer(&[command], &NavigationContext { graph, cameras, viewport, selection: None });
    }

    fn wait(&mut self, seconds: f64) {
        for _ in 0..20 {
            self.time += seconds / 20.0;
            self.navigator.advance(self.time);
        }
    }

    fn eye(&self) -> Vec3 {
        self.navigator.camera().eye()
    }

    fn go(&mut self, direction: [f32; 3], is_fast: bool) -> Vec3 {
        let before = self.eye();
        self.steer(Command::Move { direction, seconds: 0.1, is_fast });
        self.eye() - before
    }
}

#[test]
fn walking_stays_on_the_ground_at_the_configured_speed() {
    let mut fixture = NavigatorFixture::new("{}", false);
    fixture.steer(Command::SetCameraMode(CameraMode::Walk));
    assert!((fixture.eye().y - EYE_HEIGHT).abs() < 1e-4, "{}", fixture.eye());
    fixture.steer(Command::Orbit(vec2(40.0, 90.0)));
    let eye = fixture.eye();
    let way = fixture.go([0.0, 0.0, 1.0], false);
    assert!((way.length() - WALKING_SPEED * 0.1).abs() < 1e-4 && way.y.abs() < 1e-5, "{way}");
    let is_fast = fixture.go([0.0, 0.0, 1.0], true);
    assert!((is_fast - way * FAST_FACTOR).length() < 1e-4);
    fixture.go([0.0, 0.0, -1.0], true);
    fixture.go([0.0, 0.0, -1.0], false);
    assert!(fixture.eye().distance(eye) < 1e-4, "back again");
    let aside = fixture.go([1.0, 0.0, 0.0], false);
    assert!(aside.dot(way).abs() < 1e-4 && (aside.length() - way.length()).abs() < 1e-4);
}

#[test]
fn looking_around_keeps_the_eye_position() {
    let mut fixture = NavigatorFixture::new("{}", false);
    fixture.steer(Command::SetCameraMode(CameraMode::Fly));
    let (eye, ahead) = (fixture.eye(), fixture.navigator.camera().forward());
    fixture.steer(Command::Orbit(vec2(120.0, -60.0)));
    assert!(fixture.eye().distance(eye) < 1e-4);
    assert!(fixture.navigator.camera().forward().dot(ahead) < 0.9);
}

#[test]
fn flying_follows_the_view_direction_and_the_wheel_sets_the_speed() {
    let mut fixture = NavigatorFixture::new("{}", false);
    fixture.steer(Command::SetCameraMode(CameraMode::Fly));
    let ahead = fixture.navigator.camera().forward();
    let way = fixture.go([0.0, 0.0, 1.0], false);
    assert!((way - ahead * FLYING_SPEED * 0.1).length() < 1e-4, "{way}");
    assert!(fixture.go([0.0, 1.0, 0.0], false).normalize().distance(Vec3::Y) < 1e-4);
    fixture.steer(Command::Zoom(0.5));
    assert!((fixture.go([0.0, 0.0, 1.0], false).length() - way.length() * 2.0).abs() < 1e-3);
    fixture.steer(Command::Zoom(1e9));
    assert!(fixture.navigator.speed() >= *SPEED_RANGE.start());
}

#[test]
fn bookmarks_are_those_of_the_configuration_until_others_are_stored() {
    let mut fixture = NavigatorFixture::new("{}", false);
    let numbers = |fixture: &NavigatorFixture| {
        let bookmarks = fixture.navigator.bookmarks(&fixture.cameras);
        bookmarks.into_iter().map(|b| (b.number, b.name)).collect::<Vec<_>>()
    };
    let configured = vec![(1, Some("far".to_owned())), (2, Some("plan".to_owned()))];
    assert_eq!(numbers(&fixture), configured);
    let first = fixture.eye();
    fixture.steer(Command::StoreBookmark(1));
    fixture.steer(Command::StoreBookmark(5));
    fixture.steer(Command::StoreBookmark(MAX_BOOKMARKS + 1));
    fixture.steer(Command::StoreBookmark(0));
    assert_eq!(numbers(&fixture), [(1, None), configured[1].clone(), (5, None)]);
    fixture.steer(Command::GoToBookmark(2));
    assert!(fixture.navigator.is_orthographic());
    fixture.steer(Command::GoToBookmark(7));
    assert!(fixture.navigator.is_orthographic(), "there is none");
    fixture.steer(Command::GoToBookmark(1));
    assert!(fixture.eye().distance(first) < 1e-4 && !fixture.navigator.is_orthographic());
}

#[test]
fn standard_views_are_axis_aligned_and_orthographic() {
    let mut fixture = NavigatorFixture::new("{}", false);
    let sides = [
        (StandardView::Top, Vec3::NEG_Y),
        (StandardView::Front, Vec3::NEG_Z),
        (StandardView::Right, Vec3::NEG_X),
    ];
    for (side, direction) in sides {
        fixture.steer(Command::UseStandardView(side));
        let forward = fixture.navigator.camera().forward();
        assert!(forward.distance(direction) < 1e-5, "{side:?}: {forward}");
        assert!(fixture.navigator.is_orthographic());
    }
}

#[test]
fn camera_transitions_are_animated_in_a_window_and_immediate_in_a_picture() {
    let go = Command::UseCamera("far".into());
    let destination = Vec3::new(0.0, 10.0, 100.0);
    let mut picture = NavigatorFixture::new(r#"{"transition_seconds": 2}"#, false);
    picture.steer(go.clone());
    assert!(picture.eye().distance(destination) < 1e-3 && !picture.navigator.is_moving());
    let mut window = NavigatorFixture::new(r#"{"transition_seconds": 2}"#, true);
    window.wait(0.1);
    let start = window.eye();
    window.steer(go.clone());
    assert_eq!(window.eye(), start);
    window.wait(1.0);
    let half = window.eye().distance(destination) / start.distance(destination);
    assert!((0.4..0.6).contains(&half), "{half}");
    window.wait(1.1);
    assert!(window.eye().distance(destination) < 1e-3 && !window.navigator.is_moving());
    let mut at_once = NavigatorFixture::new(r#"{"transition_seconds": 0}"#, true);
    at_once.steer(go.clone());
    assert!(at_once.eye().distance(destination) < 1e-3);
    let mut stopped = NavigatorFixture::new(r#"{"transition_seconds": 2}"#, true);
    stopped.wait(0.1);
    stopped.steer(go);
    stopped.wait(0.5);
    stopped.steer(Command::Orbit(vec2(1.0, 0.0)));
    assert!(!stopped.navigator.is_moving(), "the operator's hand goes before");
}

#[test]
fn a_drag_coasts_only_if_enabled_and_comes_to_rest() {
    let coast = Command::StartInertia(vec2(400.0, 0.0));
    let mut calm = NavigatorFixture::new("{}", true);
    calm.steer(coast.clone());
    assert!(!calm.navigator.is_moving());
    let mut fixture = NavigatorFixture::new(r#"{"inertia": true}"#, true);
    fixture.wait(0.1);
    let before = fixture.eye();
    fixture.steer(coast);
    fixture.wait(0.2);
    assert!(fixture.eye().distance(before) > 0.5 && fixture.navigator.is_moving());
    fixture.wait(2.5);
    assert!(!fixture.navigator.is_moving());
}
