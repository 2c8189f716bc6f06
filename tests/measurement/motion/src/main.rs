//! Measures how the window of a running viewer answers: frames a second while the scene is
//! dragged, the time until the picture is whole after that, and the time from a key to its panel.
//! `DISPLAY` names the X display, which has no other window. Prints JSON.
#![allow(clippy::print_stdout, reason = "figures are this program's output")]

mod metrics;
mod window;

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Parser;
use serde::Serialize;

use window::{Area, ViewerWindow};

/// Period of the pointer's events while dragging: that of a common mouse.
const POINTER_PERIOD: Duration = Duration::from_millis(8);
/// Radius of the circle that the pointer is dragged on, and what it advances an event, pixels.
const DRAG_RADIUS: f64 = 120.0;
const DRAG_STEP: f64 = 4.0;
/// Drags after which the time to a whole picture is taken.
const RESTS: usize = 12;
/// Time of each of those drags, and of the observation after it.
const DRAG_TIME: Duration = Duration::from_millis(700);
const OBSERVATION: Duration = Duration::from_millis(1_500);
/// Share of pixels that may differ from the last picture: values go on changing.
const WHOLE_SHARE: f64 = 0.002;
/// Letters of the keys that open panels, with Ctrl.
const KEYS: [char; 2] = ['p', 't'];
/// Longest time from a key to its panel.
const MAX_REACTION: Duration = Duration::from_secs(5);
/// Time between keys, milliseconds.
const KEY_PAUSE_MILLIS: std::ops::Range<u64> = 120..450;

/// Command-line options of the measurement.
#[derive(Parser)]
struct Arguments {
    /// Address of the viewer's metrics.
    #[arg(long)]
    metrics: SocketAddr,
    /// Seconds for which the scene is dragged.
    #[arg(long, default_value_t = 10)]
    seconds: u64,
    /// Number of keys that are pressed.
    #[arg(long, default_value_t = 100)]
    keys: usize,
    /// Width and height of the window, pixels.
    #[arg(long, num_args = 2, default_values_t = [1600, 900])]
    size: Vec<u16>,
}

/// Figures of a window.
#[derive(Serialize)]
struct Figures {
    /// Frames drawn a second while the scene was dragged.
    dragging_frames_per_second: f64,
    /// Times from the last event of a drag to a picture that stays, milliseconds.
    whole_picture_millis: Percentiles,
    /// Times from a key to its panel, milliseconds.
    key_to_panel_millis: Percentiles,
}

/// Percentiles of measured times, milliseconds.
#[derive(Serialize)]
struct Percentiles {
    count: usize,
    p50: f64,
    p99: f64,
    max: f64,
}

impl Percentiles {
    fn from_times(mut times: Vec<Duration>) -> Self {
        times.sort();
        let at = |share: f64| {
            let index = ((times.len() as f64 * share).ceil() as usize).saturating_sub(1);
            times.get(index).map_or(f64::NAN, |time| time.as_secs_f64() * 1e3)
        };
        Self { count: times.len(), p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

fn main() -> Result<()> {
    let Arguments { metrics, seconds, keys, size } = Arguments::parse();
    let window = ViewerWindow::find()?;
    window.resize([size[0], size[1]])?;
    let frames = || metrics::counter(metrics, "busbar_frames_total");

    let mut pointer = Pointer::new(&window);
    pointer.drag(Duration::from_secs(2))?;
    thread::sleep(OBSERVATION);
    let (before, started) = (frames()?, Instant::now());
    pointer.drag(Duration::from_secs(seconds))?;
    let dragging_frames_per_second = (frames()? - before) / started.elapsed().as_secs_f64();
    thread::sleep(OBSERVATION);

    let mut whole = Vec::new();
    for _ in 0..RESTS {
        pointer.drag(DRAG_TIME)?;
        whole.push(time_to_whole_picture(&window)?);
    }
    let figures = Figures {
        dragging_frames_per_second,
        whole_picture_millis: Percentiles::from_times(whole),
        key_to_panel_millis: Percentiles::from_times(reactions(&window, keys)?),
    };
    println!("{}", serde_json::to_string_pretty(&figures)?);
    Ok(())
}

/// Pointer that drags the scene on a circle around the middle of the window.
struct Pointer<'a> {
    window: &'a ViewerWindow,
    middle: [f64; 2],
    angle: f64,
}

impl<'a> Pointer<'a> {
    fn new(window: &'a ViewerWindow) -> Self {
        let middle = window.size().map(|pixels| f64::from(pixels) / 2.0);
        Self { window, middle, angle: 0.0 }
    }

    fn place(&self) -> [i16; 2] {
        let [x, y] = self.middle;
        let (sin, cos) = self.angle.sin_cos();
        [x + DRAG_RADIUS * cos, y + DRAG_RADIUS * sin].map(|pixels| pixels as i16)
    }

    /// Drags with the first button; the last event is the release.
    fn drag(&mut self, time: Duration) -> Result<()> {
        self.window.point_at(self.place())?;
        self.window.press_button(true)?;
        let end = Instant::now() + time;
        while Instant::now() < end {
            self.angle += DRAG_STEP / DRAG_RADIUS;
            self.window.point_at(self.place())?;
            thread::sleep(POINTER_PERIOD);
        }
        // A pause before the release, so that the scene does not turn on.
        thread::sleep(Duration::from_millis(1));
        self.window.press_button(false)
    }
}

/// Returns the time from now to the first picture of the scene that stays.
fn time_to_whole_picture(window: &ViewerWindow) -> Result<Duration> {
    let started = Instant::now();
    let [width, height] = window.size();
    let area = Area { at: [width as i16 / 3, height as i16 / 4], size: [width / 3, height / 2] };
    let mut pictures = Vec::new();
    while started.elapsed() < OBSERVATION {
        let pixels = window.pixels(area)?;
        pictures.push((started.elapsed(), pixels));
        thread::sleep(Duration::from_millis(4));
    }
    let (_, last) = pictures.last().context("there are pictures")?;
    let differs = |pixels: &[u8]| window::different_share(pixels, last) > WHOLE_SHARE;
    let unlike = pictures.iter().rposition(|(_, pixels)| differs(pixels));
    let first = unlike.map_or(0, |index| (index + 1).min(pictures.len() - 1));
    Ok(pictures[first].0)
}

/// Returns times from a key to the panel that it opens.
fn reactions(window: &ViewerWindow, count: usize) -> Result<Vec<Duration>> {
    let show = |key: char| -> Result<()> {
        window.press_with_control(key)?;
        thread::sleep(OBSERVATION);
        Ok(())
    };
    let mut pictures = Vec::new();
    for key in KEYS {
        show(key)?;
        pictures.push(window.pixels(window.whole())?);
    }
    let area = window.most_different_area(&pictures[0], &pictures[1]);
    let mut looks = Vec::new();
    for key in KEYS {
        show(key)?;
        looks.push(window.pixels(area)?);
    }
    let mut times = Vec::new();
    for number in 0..count {
        let shown = number % KEYS.len();
        thread::sleep(Duration::from_millis(fastrand::u64(KEY_PAUSE_MILLIS)));
        let pressed = Instant::now();
        window.press_with_control(KEYS[shown])?;
        loop {
            let pixels = window.pixels(area)?;
            let [to_shown, to_other] =
                [shown, 1 - shown].map(|look| window::different_share(&pixels, &looks[look]));
            if to_shown < to_other {
                break;
            }
            ensure!(pressed.elapsed() < MAX_REACTION, "the key {} shows nothing", KEYS[shown]);
            thread::sleep(Duration::from_millis(1));
        }
        times.push(pressed.elapsed());
    }
    Ok(times)
}
