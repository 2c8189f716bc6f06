//! Unattended operation: machine diagnosis, log, metrics, full screen, and systemd units.

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use e2e::display::Display;
use e2e::peer::python;
use e2e::{Process, Scene, available, busbar, finish, wait_for, workspace_path};
use serde_json::{Value, json};

const SCREEN: [u32; 2] = [1024, 640];
const MAX_WAIT: Duration = Duration::from_secs(20);

/// Returns a small scene without tags.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["scene"] = json!([{ "id": "=Q1", "model": "breaker" }]);
    let breaker = scene.config["models"]["breaker"].take();
    scene.config["models"] = json!({ "breaker": breaker });
    scene.config["graphics"] = json!({ "samples": 1, "quality": "low" });
    scene.config["window"] = json!({ "size": [640, 400] });
    scene
}

/// Runs the doctor with these environment variables; returns its report and exit code.
fn doctor(config: &Path, environment: &[(&str, &str)]) -> (Value, Option<i32>) {
    let mut command = busbar();
    command.args(["doctor", "--json"]).arg(config);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").envs(environment.iter().copied());
    let output = finish(&mut command);
    (serde_json::from_str(&output.stdout).expect("it is JSON"), output.code)
}

fn finding<'a>(report: &'a Value, check: &str, state: &str) -> &'a Value {
    let findings = report["findings"].as_array().expect("a list");
    let found = findings.iter().find(|one| one["check"] == check && one["state"] == state);
    found.unwrap_or_else(|| panic!("no {check} is {state} in {report:#}"))
}

#[test]
fn the_doctor_finds_what_is_sick_and_says_what_helps() {
    let scene = scene();
    let path = scene.write();
    let (report, code) = doctor(&path, &[]);
    assert_eq!((code, &report["faults"]), (Some(0), &json!(0)), "{report:#}");
    for check in ["version", "shared memory", "cache", "plugins", "configuration", "watchdog"] {
        finding(&report, check, "ok");
    }
    let says = |one: &Value, cause: &str, remedy: &str| {
        let text = |name: &str| one[name].as_str().expect("words").to_owned();
        assert!(text("cause").contains(cause), "{one}");
        assert!(text("remedy").contains(remedy), "{one}");
    };
    says(finding(&report, "display", "warning"), "DISPLAY", "busbar render");

    let (report, code) = doctor(
        &path,
        &[
            ("VK_ICD_FILENAMES", "/absent/icd.json"),
            ("VK_DRIVER_FILES", "/absent/icd.json"),
            ("DISPLAY", ":987"),
            ("XDG_CACHE_HOME", "/proc/nowhere"),
            ("NOTIFY_SOCKET", "/run/absent"),
        ],
    );
    assert_eq!(code, Some(1));
    says(finding(&report, "graphics", "fault"), "", "VK_ICD_FILENAMES");
    says(finding(&report, "display", "fault"), ":987", "start the X server");
    says(finding(&report, "cache", "fault"), "/proc/nowhere", "another folder");
    says(finding(&report, "watchdog", "warning"), "watchdog", "WatchdogSec");

    // A plugin folder that everybody may write to, and a configuration with a fault.
    let plugins = scene.path("plugins");
    fs::set_permissions(&plugins, fs::Permissions::from_mode(0o777)).expect("it is ours");
    let (report, code) = doctor(&path, &[]);
    assert_eq!(code, Some(1));
    finding(&report, "plugins", "fault");
    fs::set_permissions(&plugins, fs::Permissions::from_mode(0o755)).expect("it is ours");
    let path = scene.write_text("{");
    let (report, _) = doctor(&path, &[]);
    says(finding(&report, "configuration", "fault"), "scene.json:1:", "");
}

#[test]
fn the_log_goes_into_a_file_and_a_full_disk_stops_nothing() {
    let scene = scene();
    let (path, log) = (scene.write(), scene.path("busbar.log"));
    let check = |log: &Path| {
        let mut command = busbar();
        command.env("BUSBAR_LOG", "debug").arg("check").arg(&path);
        finish(command.arg("--log").arg(log).args(["--log-format", "json"]))
    };
    check(&log).expect_code(0);
    let text = fs::read_to_string(&log).expect("it was written");
    assert!(!text.is_empty());
    for line in text.lines() {
        let line: Value = serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        assert!(line["timestamp"].is_string() && line["level"].is_string(), "{line}");
    }
    for absent in ["/dev/full", "/absent/folder/busbar.log"] {
        let output = check(Path::new(absent)).expect_code(0);
        assert!(output.stderr.contains("is not written"), "{}", output.stderr);
        assert!(output.stdout.contains("no errors"));
    }
}

/// Returns the command of a window on its own display.
fn view(scene: &Scene, display: &Display, more: &[&str]) -> Command {
    let mut command = busbar();
    command.arg("view").arg(scene.write()).args(more);
    command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    command.env_remove("WAYLAND_SOCKET").env("WINIT_X11_SCALE_FACTOR", "1");
    command
}

fn start(command: &mut Command) -> Process {
    let process = Process::start(command);
    process.wait_for_line(|line| (line == "ready").then_some(()));
    process
}

fn page(address: &str) -> Option<String> {
    let mut stream = TcpStream::connect(address).ok()?;
    write!(stream, "GET /metrics HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    let (head, body) = answer.split_once("\r\n\r\n")?;
    head.starts_with("HTTP/1.1 200").then(|| body.to_owned())
}

#[test]
fn numbers_are_served_as_another_parser_reads_them() {
    let Some(display) = Display::start(SCREEN) else { return };
    let Some(python) = python("prometheus_client") else { return };
    let parser = "import sys, json\n\
        from prometheus_client.openmetrics.parser import text_string_to_metric_families as read\n\
        print(json.dumps([[s.name, s.labels, s.value] for f in read(sys.stdin.read()) for s in f.samples]))";
    let port = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("it").port();
    let address = format!("127.0.0.1:{port}");
    let mut scene = scene();
    scene.config["plugins"]["more"] = json!({ "plugin": "power_overlay" });
    scene.config["overlays"] = json!(["more"]);
    let process = start(&mut view(&scene, &display, &["--metrics", &address]));
    scene.write_text("{");
    let text = wait_for("a reload among the numbers", MAX_WAIT, || {
        page(&address).filter(|text| text.contains("busbar_reloads_total{outcome=\"bad\"} 1"))
    });
    let mut child = Command::new(&python);
    let child = child.args(["-c", parser]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = child.spawn().expect("python starts");
    child.stdin.take().expect("piped").write_all(text.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{text}");
    let samples: Vec<(String, Value, f64)> =
        serde_json::from_slice(&output.stdout).expect("as printed");
    let value = |name: &str, labels: Value| {
        let found = samples.iter().find(|(own, of, _)| own == name && *of == labels);
        found.unwrap_or_else(|| panic!("no {name} {labels} in {text}")).2
    };
    let frames = value("busbar_frames_total", json!({}));
    assert!(frames >= 2.0);
    assert_eq!(value("busbar_frame_seconds_count", json!({})), frames);
    assert_eq!(value("busbar_plugin_up", json!({ "plugin": "more" })), 1.0);
    assert_eq!(value("busbar_plugin_deaths_total", json!({ "plugin": "more" })), 0.0);
    assert_eq!(value("busbar_tags", json!({ "quality": "bad" })), 0.0);
    assert_eq!(value("busbar_configuration_faulty", json!({})), 1.0);
    assert!(value("busbar_resident_memory_bytes", json!({})) > 1e6);
    drop(process);

    let output = finish(&mut view(&scene, &display, &["--metrics", "0.0.0.0:0"])).expect_code(1);
    assert!(output.stderr.contains("--metrics-public"), "{}", output.stderr);
}

/// Returns an unused address of this machine.
fn free_address() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("it has one").to_string()
}

#[test]
fn log_and_numbers_follow_the_configuration_unless_arguments_say_where() {
    let Some(display) = Display::start(SCREEN) else { return };
    let mut scene = scene();
    let [first, second] = [free_address(), free_address()];
    scene.config["log"] = json!({ "file": "first.log" });
    scene.config["metrics"] = json!({ "address": first });
    let process = start(&mut view(&scene, &display, &[]));
    let log = |scene: &Scene, name: &str| fs::read_to_string(scene.path(name)).unwrap_or_default();
    wait_for("numbers", MAX_WAIT, || page(&first));

    scene.config["log"] = json!({ "file": "second.log", "format": "json" });
    scene.config["metrics"] = json!({ "address": second });
    scene.write();
    wait_for("numbers elsewhere", MAX_WAIT, || page(&second));
    assert_eq!(page(&first), None, "not there any more");
    // What is refused is told in the log that is used now.
    scene.write_text("{");
    wait_for("a line", MAX_WAIT, || log(&scene, "second.log").contains("not loaded").then_some(()));
    let text = log(&scene, "second.log");
    let line = text.lines().next().expect("a line");
    assert!(serde_json::from_str::<Value>(line).is_ok(), "{line}");
    let was = log(&scene, "first.log");
    assert!(was.contains("loaded again") && !was.contains("not loaded"), "{was}");

    // An address that is taken costs the numbers, and not the view.
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("it has one").to_string();
    scene.config["metrics"] = json!({ "address": address });
    scene.write();
    wait_for("a line", MAX_WAIT, || log(&scene, "second.log").contains(&address).then_some(()));
    assert!(page(&second).is_some(), "they stay where they were");
    drop(process);

    let own = scene.path("own.log").display().to_string();
    scene.config["log"] = json!({ "file": "third.log" });
    scene.config["metrics"] = json!({ "address": first });
    let arguments = ["--log", &own, "--metrics", &second];
    let _process = start(&mut view(&scene, &display, &arguments));
    wait_for("numbers", MAX_WAIT, || page(&second));
    assert_eq!(page(&first), None, "arguments go before");
    assert!(!scene.path("third.log").exists() && scene.path("own.log").exists());
}

#[test]
fn a_served_view_feeds_the_watchdog() {
    let scene = scene();
    let socket = scene.path("notify");
    let systemd = UnixDatagram::bind(&socket).expect("a socket");
    systemd.set_read_timeout(Some(MAX_WAIT)).expect("a time");
    let mut command = busbar();
    command.arg("serve").arg(scene.write()).args(["--listen", "127.0.0.1:0"]);
    let _process = Process::start(command.env("NOTIFY_SOCKET", &socket));
    let (mut told, mut bytes) = (String::new(), [0; 256]);
    while told.matches("WATCHDOG=1").count() < 3 {
        let count = systemd.recv(&mut bytes).expect("looking at the viewer feeds it");
        told += &String::from_utf8_lossy(&bytes[..count]);
    }
    assert!(told.starts_with("READY=1"), "{told}");
}

#[test]
fn a_kiosk_fills_its_screen_whatever_becomes_of_it_and_feeds_the_watchdog() {
    let Some(display) = Display::start(SCREEN) else { return };
    let scene = scene();
    let socket = scene.path("notify");
    let systemd = UnixDatagram::bind(&socket).expect("a socket");
    systemd.set_read_timeout(Some(MAX_WAIT)).expect("a time");
    let mut command = view(&scene, &display, &["--kiosk"]);
    let process = start(command.env("NOTIFY_SOCKET", &socket));
    let mut told = String::new();
    let mut bytes = [0; 256];
    while told.matches("WATCHDOG=1").count() < 3 {
        let count = systemd.recv(&mut bytes).expect("frames feed it");
        told += &String::from_utf8_lossy(&bytes[..count]);
    }
    assert!(told.starts_with("READY=1"), "{told}");

    let window = display.xdotool("search --onlyvisible --name Busbar").stdout;
    let window = window.lines().next().expect("a window").to_owned();
    let place = || display.xdotool(&format!("getwindowgeometry --shell {window}")).stdout;
    let fills = |[width, height]: [u32; 2]| {
        wait_for(&format!("{width} x {height}"), MAX_WAIT, || {
            let is_so = [("WIDTH", width), ("HEIGHT", height), ("X", 0), ("Y", 0)];
            let place = place();
            is_so.iter().all(|(name, n)| place.contains(&format!("{name}={n}\n"))).then_some(())
        });
    };
    fills(SCREEN);
    let xrandr = |words: &str| {
        let mut command = Command::new("xrandr");
        finish(command.env("DISPLAY", &display.name).args(words.split_whitespace()))
    };
    for [width, height] in [[800, 600], [640, 480]] {
        let [wide, high] = [width + 200, height + 20];
        let times = format!("40 {width} {width} {width} {wide} {height} {height} {height} {high}");
        xrandr(&format!("--newmode {width}m {times}")).expect_code(0);
        xrandr(&format!("--addmode screen {width}m")).expect_code(0);
        xrandr(&format!("--output screen --mode {width}m")).expect_code(0);
        fills([width, height]);
    }
    // The monitor goes, which a screen in memory half refuses, and comes back.
    xrandr("--output screen --off");
    std::thread::sleep(Duration::from_secs(2));
    assert!(!process.is_over());
    xrandr(&format!("--output screen --mode {}x{}", SCREEN[0], SCREEN[1])).expect_code(0);
    fills(SCREEN);
    // A window manager that asks it to close is not heard; the chord is.
    display.xdotool(&format!("windowfocus {window} key --clearmodifiers q"));
    std::thread::sleep(Duration::from_secs(1));
    assert!(!process.is_over());
    display.xdotool("key ctrl+alt+shift+q");
    process.finish().expect_code(0);
}

#[test]
fn units_are_as_systemd_wants_them() {
    let present = Command::new("systemd-analyze").arg("--version").output().is_ok();
    if !available(present, "no systemd-analyze: install systemd") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let program = e2e::built_folder().join("busbar").display().to_string();
    for unit in ["busbar-kiosk.service", "busbar-serve.service"] {
        let text = fs::read_to_string(workspace_path("config").join(unit)).expect("it is there");
        // What is installed elsewhere is not looked for here.
        let text =
            text.replace("/usr/local/bin/busbar", &program).replace("/usr/bin/xinit", &program);
        let path = folder.path().join(unit);
        fs::write(&path, text).expect("it can be written");
        let mut command = Command::new("systemd-analyze");
        let output = finish(command.arg("verify").arg("--man=no").arg(&path));
        let of_unit: Vec<_> = output.stderr.lines().filter(|line| line.contains(unit)).collect();
        assert!(of_unit.is_empty(), "{of_unit:#?}");
    }
}
