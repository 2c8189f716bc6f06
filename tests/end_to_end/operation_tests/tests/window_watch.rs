//! Watchdog of the program's own window, judged from the pixels of its screen: a hung viewer is
//! hatched within a second, also on a busy machine, and the watcher ends with it.
//!
//! `BUSBAR_LIVE_SECONDS` says how long the machine is busy.

use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use e2e::busy_processes::BusyProcesses;
use e2e::clock_reader::{CLOCK_PLACE, ClockLook, ClockReader, LEARNING_MILLIS, wall_millis};
use e2e::display::Display;
use e2e::{Process, Scene, busbar, live_seconds, wait_for};
use image::{Rgb, RgbImage};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConnectionExt, ImageFormat};
use x11rb::rust_connection::RustConnection;

const SCREEN: [u32; 2] = [800, 500];
/// Longest time in which an old picture passes for live.
const MAX_OLD: Duration = Duration::from_millis(1000);
/// Longest time from a new picture until the screen shows it.
const MAX_BACK: Duration = Duration::from_secs(10);
/// Longest time from the end of a viewer to the end of its watcher.
const MAX_END: Duration = Duration::from_secs(5);
/// Number of stops of a viewer.
const STOPS: u32 = 10;
/// Number of busy processes beside a viewer.
const BUSY_PROCESSES: usize = 20;
/// Period of looks at the clock.
const CLOCK_PERIOD: Duration = Duration::from_millis(10);
/// Least difference of two channels of a coloured pixel.
const MIN_COLOR: u8 = 12;
/// Interval of pixels: a picture with one coloured pixel in so many is not the cover.
const MIN_COLORED: usize = 200;

/// View on a display in memory, full-screen, with its watcher.
struct WatchedWindow {
    process: Process,
    display: Display,
    screen: Screen,
    scene: Scene,
}

impl WatchedWindow {
    fn open(arguments: &[&str]) -> Option<Self> {
        let display = Display::start(SCREEN)?;
        let mut scene = Scene::without_tags();
        scene.config["graphics"] = json!({ "samples": 1 });
        scene.config["window"] = json!({ "size": SCREEN });
        scene.config["theme"] = json!({ "background": "#3366b3" });
        let mut command = busbar();
        command.arg("view").arg(scene.write()).args(arguments);
        command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
        command.env_remove("WAYLAND_SOCKET").env("WINIT_X11_SCALE_FACTOR", "1");
        let process = Process::start(&mut command);
        process.wait_for_line(|line| (line == "ready").then_some(()));
        let screen = Screen::connect(&display);
        let watched = Self { process, display, screen, scene };
        watched.wait_until_live();
        Some(watched)
    }

    fn wait_until_live(&self) {
        wait_for("a live picture", MAX_BACK, || self.screen.passes_for_live().then_some(()));
    }

    /// Stops the viewer; returns the time until its picture no longer passes for live.
    fn time_to_cover(&self) -> Duration {
        self.process.signal(Signal::STOP);
        let struck = Instant::now();
        while self.screen.passes_for_live() {
            assert!(struck.elapsed() < MAX_OLD * 5, "it passes for live");
        }
        struck.elapsed()
    }

    fn shot(&self, name: &str) {
        let folder = self.scene.path("stats.json");
        self.display.screenshot(folder.parent().expect("a folder"), name);
    }
}

/// Connection that reads the pixels of a display's screen.
struct Screen {
    connection: RustConnection,
    root: u32,
}

impl Screen {
    fn connect(display: &Display) -> Self {
        let (connection, screen) = RustConnection::connect(Some(&display.name)).expect("it runs");
        let root = connection.setup().roots[screen].root;
        Self { connection, root }
    }

    fn picture(&self) -> RgbImage {
        let [width, height] = SCREEN;
        let image = self.connection.get_image(
            ImageFormat::Z_PIXMAP,
            self.root,
            0,
            0,
            width as u16,
            height as u16,
            u32::MAX,
        );
        let data = image.expect("it runs").reply().expect("the screen has pixels").data;
        RgbImage::from_fn(width, height, |x, y| {
            let at = 4 * (y * width + x) as usize;
            Rgb([data[at + 2], data[at + 1], data[at]])
        })
    }

    /// Looks at the clock again and again for some time.
    fn clock_looks(&self, time: Duration) -> impl Iterator<Item = ClockLook> {
        let start = Instant::now();
        std::iter::from_fn(move || {
            sleep(CLOCK_PERIOD);
            let at = wall_millis();
            let picture = self.picture();
            let [[width, height], [_, bottom]] = [CLOCK_PLACE, SCREEN];
            let place = (bottom - height..bottom).flat_map(|y| (0..width).map(move |x| (x, y)));
            let pixels = place.map(|(x, y)| picture.get_pixel(x, y).0[1]).collect();
            let is_live = passes_for_live(&picture);
            let look = ClockLook { at, is_live, pixels };
            (start.elapsed() < time).then_some(look)
        })
    }

    fn passes_for_live(&self) -> bool {
        passes_for_live(&self.picture())
    }
}

/// Reports whether there is colour: the cover has none.
fn passes_for_live(picture: &RgbImage) -> bool {
    let colored = picture.pixels().filter(|pixel| {
        let [red, green, blue] = pixel.0;
        red.max(green).max(blue) - red.min(green).min(blue) > MIN_COLOR
    });
    colored.count() > picture.pixels().len() / MIN_COLORED
}

/// Lists the child processes of a viewer that run the watcher's command.
fn watchers_of(viewer: u32) -> Vec<u32> {
    let listed = std::fs::read_dir("/proc").expect("there are processes").flatten();
    let ids = listed.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let is_watcher = |id: &u32| {
        let read = |name: &str| {
            std::fs::read_to_string(Path::new("/proc").join(id.to_string()).join(name))
        };
        let is_child = read("stat").is_ok_and(|stat| {
            let parent = stat.rsplit(')').next().and_then(|rest| rest.split_whitespace().nth(1));
            parent == Some(&viewer.to_string())
        });
        is_child && read("cmdline").is_ok_and(|words| words.contains("watch-window"))
    };
    ids.filter(is_watcher).collect()
}

fn is_there(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat"));
    stat.is_ok_and(|stat| !stat.rsplit(')').next().unwrap_or("").trim_start().starts_with('Z'))
}

#[test]
#[allow(clippy::print_stderr)]
fn a_window_that_hangs_is_hatched_within_a_second_and_comes_back() {
    let Some(watched) = WatchedWindow::open(&[]) else { return };
    watched.shot("window_live");
    let mut longest = Duration::ZERO;
    for turn in 0..STOPS {
        let took = watched.time_to_cover();
        longest = longest.max(took);
        // Nor does it come back by itself.
        sleep(Duration::from_millis(300));
        assert!(!watched.screen.passes_for_live());
        if turn == 0 {
            sleep(Duration::from_secs(3));
            watched.shot("window_hung");
        }
        watched.process.signal(Signal::CONT);
        watched.wait_until_live();
        // At another point of its frames each time.
        sleep(Duration::from_millis(300 + u64::from(turn) * 37));
    }
    eprintln!("{STOPS} stops: an old picture passes for live for at most {longest:?}");
    assert!(longest <= MAX_OLD, "live for {longest:?}");
}

#[test]
fn the_watcher_ends_with_its_viewer_and_is_started_again_without_it() {
    let Some(watched) = WatchedWindow::open(&[]) else { return };
    let viewer = watched.process.id();
    let only = || wait_for("a watcher", MAX_BACK, || watchers_of(viewer).first().copied());
    let first = only();
    assert_eq!(watchers_of(viewer).len(), 1);
    let pid = |process: u32| Pid::from_raw(process as i32).expect("a process");
    let environment = std::fs::read_to_string(format!("/proc/{first}/environ")).expect("it runs");
    assert!(!environment.contains("NOTIFY_SOCKET"), "systemd would take it for the viewer");
    kill_process(pid(first), Signal::KILL).expect("it runs");
    let second = wait_for("another watcher", MAX_BACK, || {
        watchers_of(viewer).into_iter().find(|watcher| *watcher != first)
    });
    assert!(watched.time_to_cover() <= MAX_OLD);
    watched.process.signal(Signal::KILL);
    wait_for("the watcher's end", MAX_END, || (!is_there(second)).then_some(()));
    assert!(!watched.screen.passes_for_live(), "its window has gone");
}

#[test]
fn a_viewer_that_ends_leaves_no_watcher() {
    let Some(watched) = WatchedWindow::open(&["--seconds", "6"]) else { return };
    let viewer = watched.process.id();
    let watcher = wait_for("a watcher", MAX_BACK, || watchers_of(viewer).first().copied());
    watched.process.finish().expect_code(0);
    assert!(!is_there(watcher), "it was waited for");
}

#[test]
fn a_kiosk_is_watched_as_well() {
    let Some(watched) = WatchedWindow::open(&["--kiosk"]) else { return };
    let took = watched.time_to_cover();
    assert!(took <= MAX_OLD, "live for {took:?}");
    sleep(Duration::from_secs(1));
    watched.shot("kiosk_hung");
}

#[test]
#[allow(clippy::print_stderr)]
fn a_window_beside_busy_processes_shows_nothing_old() {
    let Some(watched) = WatchedWindow::open(&[]) else { return };
    let learning = watched.screen.clock_looks(Duration::from_millis(LEARNING_MILLIS));
    let reader = ClockReader::learn(&learning.collect::<Vec<_>>());
    let viewer = watched.process.id();
    let time = Duration::from_secs(live_seconds());
    let busy = BusyProcesses::start(BUSY_PROCESSES);
    let found = reader.judge(watched.screen.clock_looks(time));
    watched.shot("window_busy");
    drop(busy);
    eprintln!("{BUSY_PROCESSES} busy processes, {time:?}: {found:?}");
    assert!(is_there(viewer), "the viewer ended");
    assert!(found.longest <= MAX_OLD.as_millis() as u64, "live for {} ms", found.longest);
    assert!(found.live > 0 && found.unread * 10 <= found.live, "{found:?}");
    watched.wait_until_live();
}
