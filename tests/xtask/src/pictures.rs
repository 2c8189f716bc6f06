//! `pictures`: the pictures of the README.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result};
use serde_json::{Map, Value};

use crate::demo::busbar;
use crate::packages::{self, Purpose};
use crate::process::{self, Process};
use crate::simulator;
use crate::stage;
use crate::station::Station;
use crate::workspace::{Profile, Workspace};
use crate::x_server::XServer;

const FOLDER: &str = "tests/end_to_end/pictures";
/// Path of the small scene that most pictures show.
pub(crate) const SCENE: &str = "config/demo.json";
/// Render options of the README's pictures; the seconds let values arrive.
const PICTURE_OPTIONS: [&str; 4] = ["--seconds", "3", "--size", "1280x720"];

/// Rendered pictures: name, additional options.
const RENDERED: &[(&str, &[&str])] = &[
    ("demo", &[]),
    ("theta70", &["--theta", "0.7"]),
    ("wireframe", &["--camera", "transformer", "--theta", "0.3", "--wireframe"]),
];

/// Pictures of the demo without labels: name, additional settings of `view`, additional options.
const VIEWS: &[(&str, &str, &[&str])] = &[
    ("high", r#"{ "graphics": { "quality": "high", "ground": true, "fog": true } }"#, &[]),
    (
        "section",
        r#"{ "graphics": { "quality": "high", "ground": true }, "camera": { "section": { "normal": [0, 0, 1], "distance": 0 } } }"#,
        &["--camera", "transformer", "--pick", "672,220"],
    ),
];
/// Path of the demo's scene with such a view, beside its own, since its paths start there.
const VIEW_SCENE: &str = "config/picture.json";

/// Picture of the demo without a device, in which every value is marked as bad.
const LINK_DOWN: (&str, &[&str]) = ("link_down", &["--camera", "transformer"]);

/// Points on the screen along which the mouse is dragged; a single point is a click.
type Drag = &'static [[u32; 2]];

/// Pictures of windows: name, first gestures of the mouse. Theta is on the display panel.
const WINDOWS: &[(&str, &[Drag])] = &[
    ("window", &[]),
    ("window_theta", &[&[[151, 15]], &[[52, 311], [90, 311], [130, 311], [166, 311]]]),
];

/// Pictures of the generated substation: name, and options.
const SUBSTATION: &[(&str, &[&str])] = &[
    ("substation", &[]),
    ("substation_bay", &["--camera", "bay"]),
    ("substation_theta70", &["--camera", "bay", "--theta", "0.7"]),
];
/// Size of the scenarios' pictures, pixels, for files of at most half a megabyte.
const SCENARIO_SIZE: &str = "960x540";
/// Pictures of scenarios: name, camera, seconds until all events have happened.
const SCENARIOS: &[(&str, &str, &str)] = &[
    ("breaker_trip", "yard_110", "10"),
    ("overload", "overload", "30"),
    ("transformer_heating", "transformer_1", "36"),
    ("sf6_leak", "sf6", "36"),
    // The disconnector has opened half-way.
    ("isolation", "isolation", "12"),
    ("link_loss", "yard_110", "14"),
];

/// Output folder of the fleet with many samples, a million in all, and the samples for each
/// transformer.
const DENSE_FLEET: &str = "target/dense_fleet";
const DENSE_SAMPLES: &str = "83333";

const SCREEN: &str = "1280x720";
/// Longest time from the window's start to its first frame, on a software rasteriser.
const MAX_FIRST_FRAME: Duration = Duration::from_secs(60);
/// Time from the first frame until the values have arrived.
const LIVE_AFTER: Duration = Duration::from_secs(3);
/// Time for a frame on a software rasteriser.
const A_FRAME: Duration = Duration::from_millis(500);

pub(crate) fn run(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    stage::build(workspace, Profile::Release)?;
    stage::stage(workspace, Profile::Release)?;
    let folder = workspace.path(FOLDER);
    fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    render_substation(workspace, &folder)?;
    render_charts(workspace, &folder)?;
    let (name, options) = LINK_DOWN;
    render(workspace, options, &picture(&folder, name))?;
    let _simulator = simulator::start_demo(workspace, Profile::Release, Path::new(SCENE))?;
    for (name, options) in RENDERED {
        render(workspace, options, &picture(&folder, name))?;
    }
    for (name, view, options) in VIEWS {
        render_view(workspace, view, options, &picture(&folder, name))?;
    }
    for (name, drags) in WINDOWS {
        photograph(workspace, drags, &picture(&folder, name))?;
    }
    Ok(())
}

fn picture(folder: &Path, name: &str) -> std::path::PathBuf {
    folder.join(format!("{name}.png"))
}

fn render(workspace: &Workspace, options: &[&str], out: &Path) -> Result<()> {
    let mut command = busbar(workspace);
    command.args(["render", SCENE]).args(PICTURE_OPTIONS);
    process::run(command.args(options).arg("--out").arg(out))
}

/// Renders the demo without labels, with these members of its sections replaced.
fn render_view(workspace: &Workspace, view: &str, options: &[&str], out: &Path) -> Result<()> {
    let text = fs::read_to_string(workspace.path(SCENE))?;
    let mut scene: Value = serde_json::from_str(&text)?;
    scene["overlays"] = Value::Array(Vec::new());
    let members: Map<String, Value> = serde_json::from_str(view)?;
    for (section, members) in members {
        for (name, member) in members.as_object().into_iter().flatten() {
            scene[&section][name] = member.clone();
        }
    }
    let variant = workspace.path(VIEW_SCENE);
    fs::write(&variant, scene.to_string())?;
    let mut command = busbar(workspace);
    command.args(["render", VIEW_SCENE]).args(PICTURE_OPTIONS).args(options);
    let rendered = process::run(command.arg("--out").arg(out));
    fs::remove_file(&variant)?;
    rendered
}

/// Generates the substation, renders it, and then each scenario of it.
fn render_substation(workspace: &Workspace, pictures: &Path) -> Result<()> {
    let station = Station::generate(workspace, Profile::Release)?;
    for (name, options) in SUBSTATION {
        let mut command = busbar(workspace);
        command.arg("render").arg(station.scene()).args(*options);
        process::run(command.arg("--out").arg(picture(pictures, name)))?;
    }
    for (name, camera, seconds) in SCENARIOS {
        let (live, scenario) = (station.live(), station.scenario(name)?);
        let _simulator =
            simulator::start_station(workspace, Profile::Release, &live, Some(&scenario))?;
        let mut command = busbar(workspace);
        command.arg("render").arg(&live).args(["--camera", camera, "--seconds", seconds]);
        command.args(["--size", SCENARIO_SIZE]);
        process::run(command.arg("--out").arg(picture(pictures, name)))?;
    }
    Ok(())
}

/// Renders the chart of a fleet's gases: of `config/dga.json`, and of a million samples.
fn render_charts(workspace: &Workspace, pictures: &Path) -> Result<()> {
    let dense = workspace.path(DENSE_FLEET);
    let fleet = |program: &str| {
        let mut command = process::cargo();
        command.args(["run", "--release", "-p", "fleet", "--bin", program, "--"]);
        command.current_dir(&workspace.root);
        command
    };
    process::run(fleet("fleet").arg(&dense).args(["--monitored", DENSE_SAMPLES]))?;
    stage::link_plugins(workspace, &dense)?;
    let mut command = fleet("fleet_pictures");
    process::run(command.arg(workspace.path("config")).arg(&dense).arg(pictures))
}

/// Opens a window on a display in memory and takes a picture of that display.
fn photograph(workspace: &Workspace, drags: &[Drag], out: &Path) -> Result<()> {
    let server = XServer::start(SCREEN)?;
    let mut command = busbar(workspace);
    command.args(["view", SCENE]).env("DISPLAY", &server.display);
    command.env_remove("WAYLAND_DISPLAY");
    let mut window = Process::start_listening(&mut command)?;
    window
        .wait_for_line(MAX_FIRST_FRAME, |line| line == "ready")
        .context("the window showed no frame")?;
    process::sleep(LIVE_AFTER)?;
    drags.iter().try_for_each(|drag| drag_mouse(&server.display, drag))?;
    let mut import = Command::new("import");
    // Without the time of day the same picture is the same file.
    import.args(["-display", &server.display, "-window", "root", "-strip"]);
    process::run(import.arg(out))
}

/// Drags the mouse along places, slowly enough that every one gets a frame.
fn drag_mouse(display: &str, places: Drag) -> Result<()> {
    let xdotool = |arguments: &[&str]| {
        process::run(Command::new("xdotool").args(arguments).env("DISPLAY", display))?;
        process::sleep(A_FRAME)
    };
    for (index, [x, y]) in places.iter().enumerate() {
        xdotool(&["mousemove", &x.to_string(), &y.to_string()])?;
        if index == 0 {
            xdotool(&["mousedown", "1"])?;
        }
    }
    xdotool(&["mouseup", "1"])
}
