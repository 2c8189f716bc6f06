//! Frames are drawn for what changes, and for nothing else: each cause of a frame, the times at
//! rest without one, and pictures that equal those drawn anew.

use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{AlarmAction, HostTagValue, Picture, SectionPlane, Viewer, renderer_options};
use e2e::{Scene, wait_for};
use egui::{Event, Key, Modifiers, PointerButton, pos2};
use glam::Vec3;
use serde_json::json;

const SIZE: [u32; 2] = [960, 540];
const TRANSFORMER: &str = "=S12D1T1-TA1";
const TOP_OIL: &str = "T1.TopOil";
const ALARM: &str = "T1.TopOil.High";
/// Tag that no label and no row shows.
const UNSEEN: &str = "Spare";
/// Time for which values are current.
const FRESHNESS: Duration = Duration::from_secs(3);
/// Longest time from the end of that until the picture shows it, on a busy machine.
const MAX_LATE: Duration = Duration::from_millis(900);
/// Longest wait for a view to rest, and for a frame.
const MAX_WAIT: Duration = Duration::from_secs(30);
/// Frames without a picture after which a view rests, and the time between them.
const CALM_FRAMES: u32 = 6;
const PERIOD: Duration = Duration::from_millis(20);
/// Height of the status bar with its clock, pixels.
const STATUS_BAR: u32 = 30;

/// Live view of an operator without a window, whose tags the test sets.
struct View {
    viewer: Viewer,
    started: Instant,
    _scene: Scene,
}

impl View {
    /// Opens the demo, at values that stay current for so long, and lets it come to rest.
    fn open(freshness: Duration, has_panels: bool) -> Self {
        let mut scene = Scene::demo(1);
        let config = &mut scene.config;
        config["plugins"].as_object_mut().expect("an object").remove("bay");
        let tags = config["tags"].as_object_mut().expect("an object");
        let spare = tags[TOP_OIL].clone();
        tags.insert(UNSEEN.into(), spare);
        for tag in tags.values_mut() {
            let tag = tag.as_object_mut().expect("an object");
            tag.insert("freshness_seconds".into(), json!(freshness.as_secs_f64()));
            if tag.remove("source").is_some() {
                tag.insert("set_by_host".into(), json!(true));
                tag.remove("scale");
                tag.remove("simulate");
            }
        }
        config["alarms"] = json!({
            ALARM: {
                "tag": TOP_OIL, "condition": { "high": 95 }, "priority": "high",
                "message": "Top oil hot", "equipment": TRANSFORMER,
            }
        });
        config["graphics"] = json!({ "samples": 1 });
        config["camera"]["transition_seconds"] = json!(0);
        let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = renderer_options(&loaded);
        let mut viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
        viewer.attach_host_program();
        viewer.set_panels_shown(has_panels);
        let mut view = Self { viewer, started: Instant::now(), _scene: scene };
        view.set(TOP_OIL, 60.0);
        view.set(UNSEEN, 1.0);
        view.rest();
        view
    }

    fn set(&mut self, tag: &str, value: f64) {
        self.viewer.set_tag(tag, HostTagValue::from_number(value)).expect("the tag is the host's");
    }

    /// Steps once; reports whether a picture was drawn.
    fn frame(&mut self, events: Vec<Event>) -> bool {
        std::thread::sleep(PERIOD);
        let mut input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        input.events = events;
        let frame = self.viewer.frame(input).expect("a frame is drawn");
        assert_eq!(frame.trouble, None);
        frame.is_drawn
    }

    /// Steps until nothing has been drawn for a while.
    fn rest(&mut self) {
        let mut calm = 0;
        wait_for("the view to rest", MAX_WAIT, || {
            calm = if self.frame(Vec::new()) { 0 } else { calm + 1 };
            (calm >= CALM_FRAMES).then_some(())
        });
    }

    /// Counts the pictures drawn within a time.
    fn pictures_within(&mut self, time: Duration) -> u32 {
        let start = Instant::now();
        let mut count = 0;
        while start.elapsed() < time {
            count += u32::from(self.frame(Vec::new()));
        }
        count
    }

    /// Drags the scene for some frames, and lets it go.
    fn drag(&mut self, frames: u16) {
        self.frame([moved(500.0, 250.0), vec![button([500.0, 250.0], true)]].concat());
        for frame in 0..frames {
            self.frame(moved(500.0 + 9.0 * f32::from(frame), 250.0));
        }
        self.frame(vec![button([500.0, 250.0], false)]);
    }

    fn picture(&mut self) -> Picture {
        self.viewer.read_picture().expect("a frame was drawn")
    }

    /// Checks that the picture at rest is the one that is drawn anew of the same state.
    fn check_picture(&mut self, what: &str) {
        // A clock or an age may go on in between, rarely several times.
        let alike = (0..4).any(|_| {
            self.rest();
            let kept = self.picture();
            self.viewer.forget_picture();
            assert!(self.frame(Vec::new()), "{what}: what is forgotten is drawn");
            let anew = self.picture();
            let above_clock = (4 * SIZE[0] * (SIZE[1] - STATUS_BAR)) as usize;
            kept.width != SIZE[0] && kept == anew
                || kept.rgba8.get(..above_clock) == anew.rgba8.get(..above_clock)
        });
        assert!(alike, "{what}: the picture at rest differs from one that is drawn anew");
    }
}

fn key(key: Key, modifiers: Modifiers) -> Vec<Event> {
    let event = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
    vec![event(true), event(false)]
}

fn moved(x: f32, y: f32) -> Vec<Event> {
    vec![Event::PointerMoved(pos2(x, y))]
}

fn button([x, y]: [f32; 2], pressed: bool) -> Event {
    let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
    Event::PointerButton { pos: pos2(x, y), button, pressed, modifiers }
}

fn clicked(x: f32, y: f32) -> Vec<Event> {
    vec![Event::PointerMoved(pos2(x, y)), button([x, y], true), button([x, y], false)]
}

type Act = Box<dyn Fn(&mut View)>;

/// Returns what changes a picture, by name: each is done once, in this order.
fn causes() -> Vec<(&'static str, Act)> {
    fn input(events: impl Fn() -> Vec<Event> + 'static) -> Act {
        Box::new(move |view| {
            // The view may draw for the input itself, which counts as well.
            view.frame(events());
        })
    }
    fn call(act: impl Fn(&mut View) + 'static) -> Act {
        Box::new(act)
    }
    vec![
        ("camera", call(|view| view.viewer.use_camera("transformer").expect("it is configured"))),
        (
            "zoom",
            input(|| {
                let wheel = Event::MouseWheel {
                    unit: egui::MouseWheelUnit::Line,
                    delta: egui::vec2(0.0, 2.0),
                    phase: egui::TouchPhase::Move,
                    modifiers: Modifiers::NONE,
                };
                [moved(640.0, 200.0), vec![wheel]].concat()
            }),
        ),
        ("drag", call(|view| view.drag(20))),
        ("hover", input(|| moved(655.0, 270.0))),
        ("selection", call(|view| assert!(view.viewer.select_equipment(TRANSFORMER)))),
        ("deselection", input(|| key(Key::Escape, Modifiers::NONE))),
        ("pick", input(|| clicked(655.0, 270.0))),
        ("value", call(|view| view.set(TOP_OIL, 61.0))),
        ("alarm", call(|view| view.set(TOP_OIL, 99.0))),
        (
            "acknowledgement",
            call(|view| {
                let acknowledge = AlarmAction::Acknowledge;
                view.viewer
                    .act_on_alarm(ALARM, acknowledge, "test")
                    .expect("it can be acknowledged");
            }),
        ),
        ("return", call(|view| view.set(TOP_OIL, 60.0))),
        ("layer", call(|view| assert!(view.viewer.set_layer_shown("values", false)))),
        ("layer again", call(|view| assert!(view.viewer.set_layer_shown("values", true)))),
        ("detail", call(|view| view.viewer.set_theta(0.9))),
        ("detail again", call(|view| view.viewer.use_policies())),
        ("wireframe", call(|view| view.viewer.set_wireframe(true))),
        ("surfaces", call(|view| view.viewer.set_wireframe(false))),
        (
            "section",
            call(|view| {
                view.viewer.set_section(Some(SectionPlane { normal: Vec3::X, distance: 0.0 }));
            }),
        ),
        ("no section", call(|view| view.viewer.set_section(None))),
        ("theme", input(|| key(Key::N, Modifiers::NONE))),
        ("theme again", input(|| key(Key::N, Modifiers::NONE))),
        ("tab", input(|| key(Key::T, Modifiers::COMMAND))),
        ("typing", input(|| vec![Event::Text("oil".into())])),
        ("another tab", input(|| key(Key::D, Modifiers::COMMAND))),
        ("help", input(|| key(Key::F1, Modifiers::NONE))),
        ("no help", input(|| key(Key::F1, Modifiers::NONE))),
        ("no panels", input(|| key(Key::F2, Modifiers::NONE))),
        ("panels", input(|| key(Key::F2, Modifiers::NONE))),
        ("size", call(|view| view.viewer.resize_offscreen([800, 500]))),
        ("size again", call(|view| view.viewer.resize_offscreen(SIZE))),
        ("uncovered", call(|view| view.viewer.invalidate_shown())),
    ]
}

#[test]
fn each_cause_is_drawn_and_the_picture_is_that_of_drawing_anew() {
    let mut view = View::open(Duration::from_secs(600), true);
    view.check_picture("at first");
    for (name, act) in causes() {
        let before = view.viewer.stats().frames;
        act(&mut view);
        wait_for(name, MAX_WAIT, || {
            view.frame(Vec::new());
            (view.viewer.stats().frames > before).then_some(())
        });
        view.check_picture(name);
    }
}

#[test]
fn nothing_is_drawn_at_rest_nor_for_what_nobody_sees() {
    let mut view = View::open(Duration::from_secs(600), false);
    assert_eq!(view.pictures_within(Duration::from_secs(3)), 0, "at rest");
    for value in 0..50 {
        view.set(UNSEEN, f64::from(value));
        // The same again is no change either.
        view.set(TOP_OIL, 60.0);
        assert!(!view.frame(Vec::new()), "value {value} of a tag without a label");
    }
    // A picture of now, though none was drawn.
    let input = view.viewer.headless_input(view.started.elapsed().as_secs_f64());
    let frame = view.viewer.frame(input).expect("a frame is drawn");
    assert!(frame.is_current && !frame.is_drawn);
}

/// At this size a rasterizer of two cores takes longer than a frame may while the camera moves.
#[test]
fn a_scene_that_was_dragged_is_whole_soon_after() {
    let mut view = View::open(Duration::from_secs(600), false);
    view.viewer.resize_offscreen([1920, 1080]);
    view.rest();
    for _ in 0..3 {
        view.drag(15);
        view.check_picture("dragged");
    }
}

#[test]
fn a_clock_draws_once_a_second() {
    let mut view = View::open(Duration::from_secs(600), true);
    let seconds = 4;
    let count = view.pictures_within(Duration::from_secs(seconds));
    assert!((seconds as u32 - 1..=seconds as u32 + 1).contains(&count), "{count} pictures");
}

#[test]
fn a_value_that_grows_old_is_marked_at_its_limit_without_any_other_cause() {
    let mut view = View::open(FRESHNESS, false);
    for turn in 0..3 {
        view.set(TOP_OIL, 60.0 + f64::from(turn));
        let set = Instant::now();
        let fresh = wait_for("the value", MAX_WAIT, || {
            view.frame(Vec::new());
            let stats = view.viewer.stats();
            let is_good = stats.tags.iter().any(|tag| tag.id == TOP_OIL && tag.quality == "good");
            is_good.then(|| view.picture())
        });
        // Nothing else draws until then.
        let late = wait_for("the mark", MAX_WAIT, || {
            view.frame(Vec::new()).then(|| set.elapsed()).filter(|age| *age >= FRESHNESS)
        });
        assert!(late <= FRESHNESS + MAX_LATE, "marked {late:?} after it was set");
        assert!(view.picture() != fresh, "it looks as before");
        view.check_picture("old value");
    }
}

#[test]
fn what_nobody_sees_is_not_drawn_and_is_of_now_once_it_is_seen() {
    let mut view = View::open(Duration::from_secs(600), false);
    view.viewer.set_seen(false);
    assert_eq!(view.pictures_within(Duration::from_millis(500)), 0);
    let before = view.viewer.stats().frames;
    view.set(TOP_OIL, 99.0);
    view.viewer.use_camera("breaker").expect("it is configured");
    assert_eq!(view.pictures_within(Duration::from_secs(1)), 0);
    let input = view.viewer.headless_input(view.started.elapsed().as_secs_f64());
    let frame = view.viewer.frame(input).expect("a frame is drawn");
    assert!(!frame.is_current, "the picture is of earlier values");
    // Alarms go on.
    let stats = view.viewer.stats();
    assert_eq!(stats.frames, before);
    assert!(stats.alarms.iter().any(|alarm| alarm.id == ALARM), "it is in alarm unseen");
    view.viewer.set_seen(true);
    assert!(view.frame(Vec::new()), "seen again");
    view.check_picture("seen again");
}
