//! An X display in memory, and hands for it.

use std::path::PathBuf;
use std::process::Command;

use crate::{Output, Process, available, finish};

/// A running Xvfb, ended when dropped.
pub struct Display {
    _server: Process,
    /// For the variable `DISPLAY`.
    pub name: String,
}

impl Display {
    /// Starts a server with one screen on a free display; none where Xvfb or
    /// xdotool is missing (see [`available`]).
    pub fn start(width: u32, height: u32) -> Option<Self> {
        let present = in_path("Xvfb") && in_path("xdotool");
        if !available(present, "no Xvfb or xdotool: install the packages xvfb and xdotool") {
            return None;
        }
        let mut command = Command::new("Xvfb");
        // It writes the display's number to standard output when it is ready.
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"]);
        let server = Process::start(command.args(["-screen", "0", &format!("{width}x{height}x24")]));
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

    /// Drags with the left button along points in screen pixels.
    pub fn drag(&self, points: &[[i32; 2]]) {
        let Some(([x, y], rest)) = points.split_first() else { return };
        self.xdotool(&format!("mousemove --sync {x} {y} mousedown 1"));
        for [x, y] in rest {
            self.xdotool(&format!("mousemove --sync {x} {y}"));
        }
        self.xdotool("mouseup 1");
    }
}

fn in_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder: PathBuf| folder.join(program)).any(|p| p.is_file())
}
