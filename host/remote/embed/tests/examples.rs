//! The examples are built by what an installed library offers (header, library, pkg-config)
//! and run on a display in memory: each shows the scene, and tells what is picked.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod common;

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::*;
use e2e::display::Display;
use e2e::{Process, available, built_folder, finish};
use image::RgbImage;
use tempfile::TempDir;

const SCREEN: [u32; 2] = [900, 560];
/// Compiler with the extensions of POSIX, which C99 lacks.
const X11_COMPILER: [&str; 3] = ["gcc", "-std=c99", "-D_POSIX_C_SOURCE=200809L"];
/// Number of clicks until one is answered: the first may come before the picture.
const CLICKS: &str = "20";

/// Installation prefix of the library.
struct Installed(TempDir);

impl Installed {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR"));
        for (from, to) in [
            (source.join("include/busbar.h"), "include/busbar.h"),
            (source.join("busbar.pc"), "lib/pkgconfig/busbar.pc"),
            (built_folder().join("libbusbar.so"), "lib/libbusbar.so.0"),
            (built_folder().join("libbusbar.a"), "lib/libbusbar.a"),
        ] {
            let to = folder.path().join(to);
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(&from, &to).unwrap_or_else(|error| panic!("{from:?}: {error}"));
        }
        // Programs are linked with the one, and ask for the other when they run.
        symlink("libbusbar.so.0", folder.path().join("lib/libbusbar.so")).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Returns what pkg-config says of packages; none where one is missing.
    fn flags(&self, packages: &[&str], more: &[&str]) -> Option<Vec<String>> {
        let mut command = Command::new("pkg-config");
        command.env("PKG_CONFIG_PATH", self.path("lib/pkgconfig"));
        let output = command.args(["--cflags", "--libs"]).args(more).args(packages).output();
        let output = output.expect("pkg-config runs; install the package pkg-config");
        let text = String::from_utf8(output.stdout).unwrap();
        let is_there = available(output.status.success(), &format!("no {packages:?}"));
        is_there.then(|| text.split_whitespace().map(str::to_owned).collect())
    }

    /// Compiles an example with every warning an error; its program.
    fn build(&self, name: &str, compiler: &[&str], packages: &[&str]) -> Option<PathBuf> {
        let flags = self.flags(packages, &[])?;
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
        let program = self.path(Path::new(name).file_stem().unwrap().to_str().unwrap());
        let mut command = Command::new(compiler[0]);
        command.args(&compiler[1..]).args(["-Wall", "-Wextra", "-Werror"]).arg(source);
        finish(command.arg("-o").arg(&program).args(flags)).expect_code(0);
        Some(program)
    }

    /// Runs something that finds the library and the program.
    fn environment(&self, command: &mut Command) {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut folders = vec![built_folder()];
        folders.extend(std::env::split_paths(&path));
        command.env("PATH", std::env::join_paths(folders).unwrap());
        command.env("LD_LIBRARY_PATH", self.path("lib"));
    }
}

/// The demo without devices, looked at from where the transformer is in the middle.
fn example_scene() -> e2e::Scene {
    let mut scene = scene();
    scene.config["cameras"] = serde_json::json!({
        "middle": { "eye": [14, 8, 14], "target": [0, 2.5, 0] }
    });
    scene.config["camera"]["start"] = "middle".into();
    scene.config.as_object_mut().unwrap().remove("bindings");
    scene
}

/// Reports whether a picture shows a scene: many shades, and more than a background in the middle.
fn shows_a_scene(picture: &RgbImage) -> bool {
    let [width, height] = [picture.width(), picture.height()];
    let middle =
        (width / 4..3 * width / 4).flat_map(|x| (height / 4..3 * height / 4).map(move |y| (x, y)));
    let shades: std::collections::BTreeSet<_> =
        middle.map(|(x, y)| picture.get_pixel(x, y).0).collect();
    shades.len() > 500
}

/// Starts a program on a display; clicks into the scene until it says what is there.
fn check_on_display(name: &str, compiler: &[&str], packages: &[&str]) {
    let Some(running) = Running::start(name, compiler, packages) else { return };
    let Running { process, display, installed, _scene } = running;
    let picture = e2e::wait_for("a picture of the scene", PATIENCE, || {
        let picture = display.screenshot(installed.0.path(), name);
        shows_a_scene(&picture).then_some(picture)
    });
    assert_eq!([picture.width(), picture.height()], SCREEN);
    let mut clicks = Command::new("xdotool");
    clicks.env("DISPLAY", &display.name).args(["mousemove", "400", "270", "click"]);
    let _clicks = Process::start(clicks.args(["--repeat", CLICKS, "--delay", "700", "1"]));
    let picked = process.wait_for_line(|line| Some(line.strip_prefix("picked ")?.to_owned()));
    assert!(picked.starts_with(TRANSFORMER), "{picked}");
}

#[test]
fn plain_x11() {
    check_on_display(
        "x11.c",
        &["gcc", "-std=c99", "-D_POSIX_C_SOURCE=200809L"],
        &["busbar", "x11"],
    );
}

/// Returns the viewer that a program started last; none while it has none.
fn viewer_of(program: u32) -> Option<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{program}/task")).ok()?;
    let children = tasks
        .flatten()
        .filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    children.flat_map(|list| list.split_whitespace().filter_map(|id| id.parse().ok()).max()).max()
}

/// Reports whether a part of the screen that the first picture did not reach shows something.
fn reaches_the_corner(picture: &RgbImage) -> bool {
    (820..SCREEN[0]).all(|x| picture.get_pixel(x, 540).0 != [0; 3])
}

/// An example in X11 that shows the scene, and what it runs on and with.
struct Running {
    process: Process,
    display: Display,
    installed: Installed,
    _scene: e2e::Scene,
}

impl Running {
    fn start(name: &str, compiler: &[&str], packages: &[&str]) -> Option<Self> {
        let installed = Installed::new();
        let program = installed.build(name, compiler, packages)?;
        let display = Display::start(SCREEN)?;
        let scene = example_scene();
        let mut command = Command::new(program);
        installed.environment(&mut command);
        let process = Process::start(command.arg(scene.write()).env("DISPLAY", &display.name));
        process.wait_for_line(|line| line.starts_with("ready").then_some(()));
        Some(Self { process, display, installed, _scene: scene })
    }

    fn plain_x11() -> Option<Self> {
        Self::start("x11.c", &X11_COMPILER, &["busbar", "x11"])
    }
}

/// Reports whether the window of an example is hatched and without colour along a row.
fn is_hatched(picture: &RgbImage, y: u32) -> bool {
    let row: Vec<_> = (0..760).map(|x| picture.get_pixel(x, y).0).collect();
    let jumps = row.windows(2).filter(|pair| pair[0][0].abs_diff(pair[1][0]) > 60).count();
    row.iter().all(|[red, green, blue]| red == green && green == blue) && jumps >= 760 / 24
}

/// Stops the viewer of an example: the library covers the window, the example says so, and both
/// end with the stop. `y` is a row of its window that has no text of the cover's.
fn check_stopped(running: Running, name: &str, y: u32) {
    let Running { process, display, installed, _scene } = running;
    let shot = |what: &str, wanted: &dyn Fn(&RgbImage) -> bool| {
        e2e::wait_for(what, PATIENCE, || {
            let picture = display.screenshot(installed.0.path(), &format!("{name}_stopped"));
            wanted(&picture).then_some(picture)
        })
    };
    shot("a picture", &|picture| shows_a_scene(picture));
    let viewer = viewer_of(process.id()).expect("there is a viewer");
    let pid = rustix::process::Pid::from_raw(viewer as i32).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::STOP).expect("it is there");
    process.wait_for_line(|line| line.starts_with("lost").then_some(()));
    shot("hatching", &|picture| is_hatched(picture, y));
    rustix::process::kill_process(pid, rustix::process::Signal::CONT).expect("it is there");
    process.wait_for_line(|line| line.starts_with("recovered").then_some(()));
    shot("the scene again", &|picture| shows_a_scene(picture) && !is_hatched(picture, y));
    assert_eq!(viewer_of(process.id()), Some(viewer), "it was not started again");
}

#[test]
fn plain_x11_is_covered_while_its_viewer_is_stopped() {
    let Some(running) = Running::plain_x11() else { return };
    check_stopped(running, "x11", 40);
}

#[test]
fn qt_is_covered_while_its_viewer_is_stopped() {
    let compiler = ["g++", "-std=c++17", "-fPIC"];
    let Some(running) = Running::start("qt.cpp", &compiler, &["busbar", "Qt6Widgets"]) else {
        return;
    };
    check_stopped(running, "qt", 100);
}

fn wait_for_end(viewer: u32) {
    e2e::wait_for("the viewer's end", PATIENCE, || {
        std::fs::read_link(format!("/proc/{viewer}/exe")).is_err().then_some(())
    });
}

#[test]
fn a_viewer_ends_with_a_program_that_is_killed() {
    let Some(running) = Running::plain_x11() else { return };
    let viewer = viewer_of(running.process.id()).expect("there is a viewer");
    running.process.signal(rustix::process::Signal::KILL);
    wait_for_end(viewer);
}

#[test]
fn a_window_is_followed_and_a_viewer_that_died_comes_back_into_it() {
    let Some(running) = Running::plain_x11() else { return };
    let Running { process, display, installed, _scene } = running;
    let shot = |what: &str, wanted: &dyn Fn(&RgbImage) -> bool| {
        e2e::wait_for(what, PATIENCE, || {
            let picture = display.screenshot(installed.0.path(), "window");
            wanted(&picture).then_some(picture)
        })
    };
    let small = shot("a picture", &|picture| shows_a_scene(picture));
    assert!(!reaches_the_corner(&small));
    display.xdotool("search --name Busbar.in.X11 windowsize 900 560");
    shot("a larger picture", &|picture| shows_a_scene(picture) && reaches_the_corner(picture));
    let before = viewer_of(process.id()).expect("there is a viewer");
    let pid = rustix::process::Pid::from_raw(before as i32).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).expect("it is there");
    e2e::wait_for("another viewer", PATIENCE, || {
        viewer_of(process.id()).filter(|viewer| *viewer != before)
    });
    shot("its picture", &|picture| shows_a_scene(picture) && reaches_the_corner(picture));
    // The end of the window is that of the view, and no crash.
    display.xdotool("search --name Busbar.in.X11 windowclose");
    let viewer = viewer_of(process.id());
    process.finish();
    viewer.into_iter().for_each(wait_for_end);
}

#[test]
fn gtk() {
    check_on_display("gtk.c", &["gcc", "-std=c99"], &["busbar", "gtk+-3.0"]);
}

#[test]
fn qt() {
    check_on_display("qt.cpp", &["g++", "-std=c++17", "-fPIC"], &["busbar", "Qt6Widgets"]);
}

#[test]
fn python() {
    let installed = Installed::new();
    let scene = example_scene();
    let picture = installed.path("picture.ppm");
    let mut command = Command::new("python3");
    installed.environment(&mut command);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/offscreen.py");
    let output = finish(command.arg(script).arg(scene.write()).arg(&picture)).expect_code(0);
    let picked = output.stdout.trim().strip_prefix("picked ").expect("it says so");
    assert!(picked.starts_with(TRANSFORMER), "{picked}");
    let ppm = std::fs::read(&picture).unwrap();
    let pixels = ppm.strip_prefix(b"P6 640 360 255\n").expect("a PPM of that size");
    let picture = RgbImage::from_raw(640, 360, pixels.to_vec()).expect("all pixels");
    assert!(shows_a_scene(&picture));
}

/// Lines of an example that have to do with a view, at most.
const MAX_LINES: usize = 30;

#[test]
fn examples_are_short() {
    for name in ["x11.c", "gtk.c", "qt.cpp", "offscreen.py"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
        let text = std::fs::read_to_string(path).unwrap();
        let words = ["busbar", "event.", "frame.", "options.", "options("];
        let of_view = |line: &&str| words.iter().any(|word| line.to_lowercase().contains(word));
        let count = text.lines().filter(of_view).count();
        assert!((5..=MAX_LINES).contains(&count), "{name}: {count} lines");
    }
}

#[test]
fn a_program_is_linked_statically() {
    let installed = Installed::new();
    let source = installed.path("version.c");
    let text =
        "#include <busbar.h>\nint main(void) { return busbar_view_abi() != BUSBAR_VIEW_ABI; }\n";
    std::fs::write(&source, text).unwrap();
    std::fs::remove_file(installed.path("lib/libbusbar.so")).unwrap();
    let flags = installed.flags(&["busbar"], &["--static"]).expect("it is installed");
    let program = installed.path("version");
    let mut command = Command::new("gcc");
    finish(command.arg("-std=c99").arg(&source).arg("-o").arg(&program).args(flags)).expect_code(0);
    finish(&mut Command::new(program)).expect_code(0);
}
