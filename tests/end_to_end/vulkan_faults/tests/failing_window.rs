//! Fault injection into Vulkan calls while a window is open: it stays open, and shows the same
//! picture.
#![allow(clippy::print_stderr, reason = "progress of a long test")]

mod common;

use std::fs;
use std::process::Command;
use std::time::Duration;

use common::{Subject, faults_of, is_final, sample};
use e2e::{Output, Process, Stats, available};
use vulkan_faults::{VulkanFault, name_of};

const SCREEN: [usize; 2] = [640, 400];
const WINDOW: [u32; 2] = [600, 360];
/// Region of panels and model, without the status bar and its times: left, top, right, bottom.
const SHOWN: [usize; 4] = [0, 0, 590, 320];
/// Seconds that a window stays open. A run that does not show the picture in time gets the next
/// longer one: the machine may be busy.
const SECONDS: [&str; 3] = ["2.5", "7", "20"];
/// Polling period of the screen.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// Number of faults unless the environment asks for others.
const SAMPLE: usize = 16;

/// Display whose pixels lie in a file.
struct Screen {
    _server: Process,
    name: String,
    folder: tempfile::TempDir,
}

impl Screen {
    fn start() -> Option<Self> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let present = std::env::split_paths(&path).any(|folder| folder.join("Xvfb").is_file());
        if !available(present, "no Xvfb: install the package xvfb") {
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-noreset", "-fbdir"]);
        command.arg(folder.path()).args(["-screen", "0"]);
        let server = Process::start(command.arg(format!("{}x{}x24", SCREEN[0], SCREEN[1])));
        let number: u32 = server.wait_for_line(|line| line.parse().ok());
        Some(Self { _server: server, name: format!(":{number}"), folder })
    }

    /// Reads the pixels of [`SHOWN`], rows from the top: an XWD file (XWDFile.h), its header in
    /// big-endian words.
    fn shown(&self) -> Vec<u8> {
        let file = fs::read(self.folder.path().join("Xvfb_screen0")).expect("the screen's file");
        let word = |index: usize| {
            let bytes = file[index * 4..index * 4 + 4].try_into().expect("four bytes");
            u32::from_be_bytes(bytes) as usize
        };
        let (header, bits, stride, colors) = (word(0), word(11), word(12), word(19));
        assert_eq!((word(4), word(5), bits), (SCREEN[0], SCREEN[1], 32), "the screen's format");
        let pixels = &file[header + colors * 12..];
        let [left, top, right, bottom] = SHOWN;
        (top..bottom)
            .flat_map(|y| &pixels[y * stride + left * 4..y * stride + right * 4])
            .copied()
            .collect()
    }
}

/// Opens a window until it closes by itself; returns its last pixels, its output, and the number of
/// lost devices.
fn view(
    screen: &Screen,
    subject: &Subject,
    seconds: &str,
    fault: Option<&VulkanFault>,
) -> (Vec<u8>, Output, u64) {
    let stats = subject.path("stats.json");
    let _ = fs::remove_file(&stats);
    let words = stats.to_string_lossy().into_owned();
    let mut command = subject.command("view", &["--seconds", seconds, "--stats", &words]);
    command.env("DISPLAY", &screen.name).env("WINIT_X11_SCALE_FACTOR", "1");
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    match fault {
        Some(fault) => subject.strike(&mut command, fault),
        None => subject.count(&mut command),
    }
    let process = Process::start(&mut command);
    let mut shown = Vec::new();
    while !process.is_over() {
        let now = screen.shown();
        // Black is the screen without a window.
        if now.iter().any(|&byte| byte > 0) {
            shown = now;
        }
        std::thread::sleep(LOOK_PERIOD);
    }
    let output = process.finish();
    let lost = if stats.exists() { Stats::read(&stats).count("devices_replaced") } else { 0 };
    (shown, output, lost)
}

#[test]
fn a_window_goes_on_after_failing_calls() {
    let Some(screen) = Screen::start() else { return };
    let subject = Subject::new(WINDOW);
    // Long enough on any machine that it stands still.
    let (expected, output, lost) = view(&screen, &subject, SECONDS[1], None);
    output.expect_code(0);
    assert_eq!(lost, 0);
    let colors: std::collections::BTreeSet<_> = expected.chunks_exact(4).collect();
    assert!(colors.len() > 4, "the model is seen, not {colors:?}");
    // Calls are counted in a run as short as those that they fail in.
    view(&screen, &subject, SECONDS[0], None).1.expect_code(0);
    let calls = subject.calls();
    let faults = faults_of(&calls);
    // Whatever the lot, a device is lost once, while frames are drawn: one that is lost while the
    // scene opens is not counted.
    let is_loss = |fault: &&VulkanFault| {
        fault.command == "vkQueueSubmit2" && name_of(fault.code) == "VK_ERROR_DEVICE_LOST"
    };
    let losses: Vec<&VulkanFault> = faults.iter().filter(is_loss).collect();
    let loss = losses[losses.len() / 2].clone();
    let chosen: Vec<VulkanFault> =
        [loss].into_iter().chain(sample(faults.clone(), SAMPLE)).collect();
    eprintln!("{} calls, {} faults, {} of them now", calls.len(), faults.len(), chosen.len());
    let (mut wrong, mut missed, mut replaced) = (Vec::new(), 0, 0);
    for fault in &chosen {
        let mut tried = view(&screen, &subject, SECONDS[0], Some(fault));
        for seconds in &SECONDS[1..] {
            if tried.0 != expected && !is_final(fault) {
                tried = view(&screen, &subject, seconds, Some(fault));
            }
        }
        let (shown, output, lost) = tried;
        replaced += lost;
        // How many frames there are depends on time.
        if !subject.was_struck() {
            missed += 1;
            continue;
        }
        let said = format!("{}{}", output.stdout, output.stderr);
        let is_quiet = !said.contains("panicked") && !said.contains("validation:");
        let is_right = if is_final(fault) {
            output.code == Some(1) && said.contains("install the package")
        } else {
            output.code == Some(0) && shown == expected
        };
        if !is_quiet || !is_right {
            let name = format!("{} call {}: {}", fault.command, fault.call, name_of(fault.code));
            let same = shown == expected;
            eprintln!("WRONG {name}: exit {:?}, same picture: {same}\n{said}", output.code);
            wrong.push(name);
        }
    }
    eprintln!("{missed} faults found no call, {replaced} devices were replaced");
    assert!(wrong.is_empty(), "{} of {} faults: {wrong:#?}", wrong.len(), chosen.len());
    assert!(replaced > 0, "no device was lost");
    assert!(missed * 2 < chosen.len(), "{missed} of {} faults never struck", chosen.len());
}
