//! X display in memory (Xvfb), with mouse and keys by xdotool.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;

use crate::{Output, Process, available, finish, picture};

/// Mouse button for picking and rotating.
pub const LEFT_BUTTON: u32 = 1;
/// Mouse button for panning.
pub const RIGHT_BUTTON: u32 = 3;
/// Button number of the wheel away from the user, as in X.
pub const WHEEL_UP: u32 = 4;

/// Number of steps of a drag, and the time of each, as of a human hand.
const DRAG_STEPS: i32 = 10;
const STEP_SECONDS: f64 = 0.03;

/// Running Xvfb that is ended when dropped.
pub struct Display {
    _server: Process,
    /// Value of the variable `DISPLAY`.
    pub name: String,
}

impl Display {
    /// Starts a server with one screen on a free display; none where Xvfb or
    /// xdotool is missing (see [`available`]).
    pub fn start([width, height]: [u32; 2]) -> Option<Self> {
        let present = in_path("Xvfb") && in_path("xdotool");
        if !available(present, "no Xvfb or xdotool: install the packages xvfb and xdotool") {
            return None;
        }
        let mut command = Command::new("Xvfb");
        // It writes the display's number to standard output when it is ready.
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"]);
        let server =
            Process::start(command.args(["-screen", "0", &format!("{width}x{height}x24")]));
        let number: u32 = server.wait_for_line(|line| line.parse().ok());
        Some(Self { _server: server, name: format!(":{number}") })
    }

    /// Runs xdotool with these words.
    ///
    /// # Panics
    /// When it fails.
    pub fn xdotool(&self, words: &str) -> Output {
        let mut command = Command::new("xdotool");
        command.env("DISPLAY", &self.name).args(words.split_whitespace());
        finish(&mut command).expect_code(0)
    }

    /// Takes a picture of the screen, kept where `BUSBAR_PICTURES` says, else in a folder.
    ///
    /// # Panics
    /// When none can be taken.
    pub fn screenshot(&self, folder: &Path, name: &str) -> RgbImage {
        let kept = std::env::var_os("BUSBAR_PICTURES").map(PathBuf::from);
        let path = kept.unwrap_or_else(|| folder.to_owned()).join(format!("{name}.png"));
        let mut import = Command::new("import");
        import.args(["-display", &self.name, "-window", "root", "-strip"]).arg(&path);
        finish(&mut import).expect_code(0);
        picture::load(&path)
    }

    /// Clicks with a button, or turns the wheel, at a point in screen pixels.
    pub fn click_button(&self, button: u32, [x, y]: [i32; 2]) {
        self.xdotool(&format!("mousemove {x} {y} click {button} sleep {STEP_SECONDS}"));
    }

    /// Drags with a button from one point to another, in small steps.
    pub fn drag(&self, button: u32, from: [i32; 2], to: [i32; 2]) {
        let [x, y] = from;
        self.xdotool(&format!("mousemove {x} {y} mousedown {button}"));
        for step in 1..=DRAG_STEPS {
            let [x, y] =
                [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / DRAG_STEPS);
            self.xdotool(&format!("mousemove {x} {y} sleep {STEP_SECONDS}"));
        }
        self.xdotool(&format!("mouseup {button}"));
    }
}

fn in_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder: PathBuf| folder.join(program)).any(|p| p.is_file())
}
