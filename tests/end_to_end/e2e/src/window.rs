//! Window of the program on a display in memory.

use image::RgbImage;
use serde_json::json;

use crate::display::Display;
use crate::{Process, Scene, Stats, busbar};

/// Window that shows a scene, under Vulkan validation.
pub struct Window {
    /// Process of the program.
    pub process: Process,
    /// Display that shows the window.
    pub display: Display,
    /// Scene in the window; its `stats.json` is written when the program ends.
    pub scene: Scene,
}

impl Window {
    /// Opens the window for so many seconds, and gives it the keyboard focus once it is ready.
    ///
    /// # Panics
    /// When it does not open.
    pub fn open(scene: Scene, display: Display, seconds: u32) -> Self {
        let mut command = busbar();
        command.arg("view").arg(scene.write()).arg("--validation");
        command.args(["--seconds", &seconds.to_string()]);
        command.arg("--stats").arg(scene.path("stats.json"));
        command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
        command.env_remove("WAYLAND_SOCKET").env("WINIT_X11_SCALE_FACTOR", "1");
        let process = Process::start(&mut command);
        process.wait_for_line(|line| (line == "ready").then_some(()));
        let window = display.xdotool("search --name Busbar").stdout;
        display.xdotool(&format!("windowfocus --sync {}", window.trim()));
        Self { process, display, scene }
    }

    /// Takes a picture of the screen, a while later.
    ///
    /// # Panics
    /// When none can be taken.
    pub fn screenshot(&self, name: &str) -> RgbImage {
        // Frames are slow on a software rasteriser under validation.
        self.display.xdotool("sleep 3");
        let stats = self.scene.path("stats.json");
        self.display.screenshot(stats.parent().expect("a folder"), name)
    }

    /// Waits for the window's end; returns its statistics.
    ///
    /// # Panics
    /// When the program fails, or the validation layer reports anything.
    pub fn close(self) -> Stats {
        self.process.finish().expect_code(0);
        let stats = Stats::read(&self.scene.path("stats.json"));
        assert_eq!(stats.0["validation_messages"], json!([]));
        stats
    }
}
