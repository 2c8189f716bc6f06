//! A graphics device that is lost while a program watches: the viewer gets another one, and
//! the program a live picture.
//!
//! `BUSBAR_EMBED_FAULTS` says how often.

mod common;

use std::process::Command;
use std::time::{Duration, SystemTime};

use busbar::abi::*;
use busbar::commands::busbar_view_pick;
use common::*;
use e2e::{built, built_folder};
use vulkan_faults::{FAULT_VARIABLE, STRUCK_VARIABLE, VulkanFault, install};

/// Default number of device losses.
const LOSSES: u64 = 2;
const VARIABLE: &str = "BUSBAR_EMBED_FAULTS";
/// The submission that fails first, of those after the first picture, and how far on each
/// further one is.
const FIRST_CALL: u64 = 60;
/// Number of the Vulkan result `VK_ERROR_DEVICE_LOST`.
const DEVICE_LOST: &str = "-4";

#[test]
#[allow(clippy::print_stderr)]
fn a_lost_device_is_not_seen_but_as_a_pause() {
    let losses = e2e::number_from_environment(VARIABLE, LOSSES);
    let library = built(built_folder().join("libvulkan_faults.so"));
    let mut times = Vec::new();
    for number in 0..losses {
        let scene = scene_of_one_label();
        let struck = scene.path("struck");
        let mut environment = Command::new("busbar");
        install(&mut environment, &library, &scene.path("")).expect("it can be written");
        let text = format!("vkQueueSubmit2:{}:{DEVICE_LOST}", FIRST_CALL + number % 7);
        let fault = VulkanFault::parse(&text).expect("such a call may give that");
        environment.env(FAULT_VARIABLE, fault.text()).env(STRUCK_VARIABLE, &struck);
        let program = program_with(&scene, &environment);
        let mut host = Host::open_with(&scene, |options| {
            options.program = program.as_ptr();
            // What is looked at is the viewer's own recovery.
            options.hung_millis = 20_000;
        });
        let before = host.look_around();
        let viewer = host.viewer();
        while !struck.exists() {
            // A view at rest submits nothing; each pick is a submission.
            // SAFETY: an open view.
            host.call(|view| unsafe { busbar_view_pick(view, 1, 1) });
            host.turn();
        }
        let at = std::fs::metadata(&struck).and_then(|file| file.modified()).expect("it was made");
        host.turn();
        host.wait_for_frame("as before", |frame| {
            let is_after = SystemTime::now() - frame.age > at;
            is_after && frame.liveness == BusbarViewLiveness::Live && frame.pixels == before.pixels
        });
        times.push(at.elapsed().unwrap_or(Duration::ZERO));
        assert_eq!(host.viewer(), viewer, "the viewer itself goes on");
    }
    let [p50, p99] = [0.5, 0.99].map(|share| percentile(&mut times, share).as_millis());
    eprintln!("{losses} lost devices: correct again after {p50} ms (p50), {p99} ms (p99)");
}
