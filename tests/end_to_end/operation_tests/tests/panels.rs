//! Faceplates by mouse and keys, from a pick, a search or an alarm; the dark theme.

use std::path::Path;
use std::time::Duration;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{FaceplateStats, RendererOptions, Stats, Viewer};
use e2e::display::{Display, LEFT_BUTTON};
use e2e::peer::{Peer, normal_values};
use e2e::window::Window;
use e2e::{Scene, picture, wait_for};
use egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use serde_json::json;

const SIZE: [u32; 2] = [1280, 720];
/// Longest wait for values, an answer or a picture.
const MAX_WAIT: Duration = Duration::from_secs(60);
const TRANSFORMER: &str = "=S12D1T1-TA1";
/// Position of the breaker's middle pole on the picture, pixels.
const PICKED: [i32; 2] = [923, 185];
const POLE: &str = "=S12D1Q1-QA1-L2";
/// Address of the Buchholz relay among the discrete inputs.
const RELAY_INPUT: u16 = 4;

/// Returns the demo scene with names, aliases and an alarm.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let config = &mut scene.config;
    for model in ["transformer", "breaker", "disconnector"] {
        config["models"][model]["theta"] = json!(0.7);
    }
    config["equipment"] = json!({
        TRANSFORMER: { "name": "Transformer 1", "aliases": ["201", "S12D1T1/YPTR1"] },
        POLE: { "name": "Line 1 breaker, pole 2", "aliases": ["2211"] }
    });
    config["alarms"] = json!({
        "Trip": {
            "tag": "T1.Buchholz", "condition": { "equals": true }, "priority": "critical",
            "message": "Buchholz trip"
        }
    });
    config["graphics"] = json!({ "samples": 1 });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay", "transition_seconds": 0 });
    scene
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    /// Opens a view with panels but without a window.
    fn open(config: &Path) -> Self {
        let loaded = LoadedScene::load(config, &|_, _, _| {});
        let scene = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let mut viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        viewer.set_panels_shown(true);
        Self { viewer, seconds: 0.0 }
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.seconds += 0.1;
        let mut input = self.viewer.headless_input(self.seconds);
        input.events = events;
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn key(&mut self, key: Key, modifiers: Modifiers) {
        let event =
            |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.frame(vec![event(true)]);
        self.frame(vec![event(false)]);
    }

    fn click(&mut self, pos: Pos2) {
        let modifiers = Modifiers::NONE;
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers,
        };
        self.frame(vec![Event::PointerMoved(pos)]);
        self.frame(vec![button(true), button(false)]);
    }

    /// Searches, and moves to the first result.
    fn find(&mut self, words: &str) -> Option<FaceplateStats> {
        self.key(Key::F, Modifiers::COMMAND);
        self.frame(Vec::new());
        self.frame(vec![Event::Text(words.to_owned())]);
        self.frame(Vec::new());
        self.key(Key::Enter, Modifiers::NONE);
        self.frame(Vec::new());
        let found = self.viewer.stats().faceplate;
        // Away with it all.
        self.key(Key::F, Modifiers::COMMAND);
        self.key(Key::Escape, Modifiers::NONE);
        self.key(Key::Escape, Modifiers::NONE);
        self.key(Key::Escape, Modifiers::NONE);
        assert!(self.viewer.stats().faceplate.is_none(), "Esc closes it");
        found
    }

    fn until(&mut self, what: &str, holds: impl Fn(&Stats) -> bool) -> Stats {
        wait_for(what, MAX_WAIT, || {
            self.frame(Vec::new());
            Some(self.viewer.stats()).filter(&holds)
        })
    }

    /// Returns a pixel that shows a part of this equipment.
    fn place_of(&mut self, id: &str) -> Pos2 {
        let pixels: Vec<[u32; 2]> =
            (10..60).flat_map(|y| (36..124).map(move |x| [x * 10 + 5, y * 10 + 5])).collect();
        let ids = self.viewer.pick_many(&pixels).expect("ids are drawn");
        let shows =
            |found: &Option<String>| found.as_ref().is_some_and(|found| found.starts_with(id));
        let shown: Vec<[u32; 2]> =
            pixels.iter().zip(&ids).filter(|(_, id)| shows(id)).map(|(pixel, _)| *pixel).collect();
        let [x, y] = shown[shown.len() / 2];
        pos2(x as f32 + 0.5, y as f32 + 0.5)
    }
}

#[test]
fn a_part_that_is_picked_opens_its_device_with_values_trends_and_alarms() {
    let Some(mut peer) = Peer::start(&normal_values()) else { return };
    let mut view = View::open(&scene(peer.port).write());
    view.until("good tags", |stats| stats.quality.bad == 0 && stats.quality.uncertain == 0);
    let place = view.place_of(&format!("{TRANSFORMER}/"));
    view.click(place);
    let stats = view.until("a faceplate", |stats| stats.faceplate.is_some());
    let picked = stats.picked.expect("one part is selected");
    assert!(picked.starts_with(&format!("{TRANSFORMER}/")), "{picked}");
    let faceplate = stats.faceplate.expect("it is there");
    assert_eq!((faceplate.id.as_str(), faceplate.name.as_str()), (TRANSFORMER, "Transformer 1"));
    for tag in ["T1.TopOil", "T1.HotSpot", "T1.OilLevel", "T1.Buchholz", "T1.Tap"] {
        assert!(faceplate.tags.iter().any(|shown| shown == tag), "{tag}: {:?}", faceplate.tags);
    }
    assert_eq!(faceplate.trends.len(), 3, "of its first analog values");
    assert!(faceplate.trends.values().all(|points| *points > 0), "{:?}", faceplate.trends);
    assert_eq!(faceplate.alarms, [""; 0]);

    peer.set("discrete", RELAY_INPUT, &[1]);
    let has_alarm = |stats: &Stats| stats.faceplate.as_ref().is_some_and(|f| f.alarms == ["Trip"]);
    view.until("its alarm", has_alarm);
    view.key(Key::Escape, Modifiers::NONE);
    assert!(view.viewer.stats().faceplate.is_none());
    view.key(Key::F8, Modifiers::NONE);
    view.until("the faceplate of the alarm", has_alarm);
    assert_eq!(view.viewer.stats().validation_messages, Vec::<String>::new());
}

#[test]
fn id_aliases_and_name_lead_to_the_same_faceplate() {
    let mut view = View::open(&scene(1).write());
    view.frame(Vec::new());
    let all = view.viewer.stats().equipment_rows;
    for words in [TRANSFORMER, "201", "s12d1t1/yptr", "transformer 1", "1 transf"] {
        let found = view.find(words).map(|faceplate| faceplate.id);
        assert_eq!(found.as_deref(), Some(TRANSFORMER), "{words}");
    }
    assert_eq!(view.find("2211").map(|faceplate| faceplate.id).as_deref(), Some(POLE));
    assert_eq!(view.find("no such thing").map(|faceplate| faceplate.id), None);
    assert_eq!(view.viewer.stats().equipment_rows, all, "the tree is back");
}

#[test]
fn a_key_changes_the_theme_and_a_font_must_be_one() {
    let mut scene = scene(1);
    scene.config["theme"]["colors"] = json!("dark");
    scene.config["theme"]["scale"] = json!(1.5);
    let mut view = View::open(&scene.write());
    view.frame(Vec::new());
    assert!(view.viewer.stats().dark);
    view.key(Key::N, Modifiers::NONE);
    assert!(!view.viewer.stats().dark);

    scene.config["theme"]["font"] = json!("no_font.ttf");
    std::fs::write(scene.path("no_font.ttf"), b"this is no font").expect("it can be written");
    let error = LoadedScene::load(&scene.write(), &|_, _, _| {}).err().expect("it is refused");
    let text = error.to_string();
    assert!(text.contains("/theme/font") && text.contains("name a TrueType"), "{text}");
}

/// Returns the mean of all channels, of 255.
fn brightness(picture: &image::RgbImage) -> f64 {
    let bytes = picture.as_raw();
    bytes.iter().map(|byte| f64::from(*byte)).sum::<f64>() / bytes.len() as f64
}

/// Opens a window of the scene with the server of its values; `None` where no server or display is
/// available.
fn open(seconds: u32) -> Option<(Window, Peer)> {
    let (peer, display) = (Peer::start(&normal_values())?, Display::start(SIZE)?);
    Some((Window::open(scene(peer.port), display, seconds), peer))
}

/// Asserts that each step changes the picture.
fn assert_steps(shots: &[&image::RgbImage]) {
    for pair in shots.windows(2) {
        assert!(picture::difference(pair[0], pair[1]).is_some(), "a step does not show");
    }
}

#[test]
fn a_click_on_a_breaker_opens_its_faceplate() {
    let Some((window, _peer)) = open(15) else { return };
    let calm = window.screenshot("panels_calm");
    window.display.click_button(LEFT_BUTTON, PICKED);
    assert_steps(&[&calm, &window.screenshot("panels_picked")]);
    let stats = window.close().0;
    assert_eq!(stats["faceplate"]["id"], POLE);
    assert_eq!(stats["faceplate"]["name"], "Line 1 breaker, pole 2");
}

#[test]
fn hands_in_a_window_search_and_darken() {
    let Some((window, _peer)) = open(30) else { return };
    let calm = window.screenshot("panels_before");
    window.display.xdotool("key ctrl+f");
    window.display.xdotool("type --delay 60 transf");
    let searched = window.screenshot("panels_searched");
    window.display.xdotool("key Return");
    let found = window.screenshot("panels_found");
    window.display.xdotool("key n");
    let dark = window.screenshot("panels_dark");
    assert_steps(&[&calm, &searched, &found, &dark]);
    let [light, dark] = [&found, &dark].map(brightness);
    assert!(dark < 0.5 * light, "{dark:.0} is not dark beside {light:.0}");
    let stats = window.close().0;
    assert_eq!(stats["faceplate"]["id"], TRANSFORMER, "found by its name");
    assert_eq!(stats["dark"], true);
}
