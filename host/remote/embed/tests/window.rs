//! A view in a window of the program: what operators press gets to the program.

mod common;

use std::ffi::CString;
use std::process::Command;

use busbar::abi::*;
use busbar::commands::*;
use common::*;
use e2e::display::Display;
use e2e::{Process, finish};
use serde_json::json;

/// An alarm that the program decides on.
const MIRRORED: &str = "Host.7";
/// A window that does nothing but tell its number.
const WINDOW: &str = r#"
#include <X11/Xlib.h>
#include <stdio.h>
int main(void)
{
    Display *display = XOpenDisplay(0);
    Window window = XCreateSimpleWindow(display, DefaultRootWindow(display), 0, 0, 640, 360, 0, 0, 0);
    XMapWindow(display, window), XSync(display, 0);
    printf("%lu\n", window), fflush(stdout);
    for (XEvent event;;) XNextEvent(display, &event);
}
"#;

#[test]
fn a_key_that_acknowledges_asks_the_program_whose_alarm_it_is() {
    let Some(display) = Display::start([640, 360]) else { return };
    let mut scene = scene();
    scene.config["alarms"][MIRRORED] =
        json!({ "mirrored": true, "priority": "critical", "message": "Busbar protection" });
    std::fs::write(scene.path("window.c"), WINDOW).expect("the folder can be written");
    let mut compile = Command::new("gcc");
    compile.arg(scene.path("window.c")).arg("-o").arg(scene.path("window")).arg("-lX11");
    finish(&mut compile).expect_code(0);
    let mut window = Command::new(scene.path("window"));
    let window = Process::start(window.env("DISPLAY", &display.name));
    let number: u32 = window.wait_for_line(|line| line.parse().ok());

    let mut environment = Command::new("busbar");
    let program = program_with(&scene, environment.env("DISPLAY", &display.name));
    let mut host = Host::open_with(&scene, |options| {
        options.program = program.as_ptr();
        options.window_system = BusbarViewWindowSystem::X11 as u32;
        options.window = number.into();
    });
    host.wait_for(BusbarViewEventKind::Ready);
    assert!(host.frame().is_none(), "the picture is in the window");
    let alarm = CString::new(MIRRORED).expect("no zero byte in it");
    // SAFETY: an open view and a text.
    let mirror = |view| unsafe {
        busbar_view_mirror_alarm(view, alarm.as_ptr(), BusbarViewAlarmState::Unacknowledged as u32)
    };
    assert_eq!(host.call(mirror), BusbarStatus::Ok);
    let of_alarm = |e: &Happened| e.kind == BusbarViewEventKind::Alarm && e.id == MIRRORED;
    assert_eq!(host.wait("alarm", of_alarm).alarm_state, BusbarViewAlarmState::Unacknowledged);

    // The next alarm, and acknowledge it: until the keys get through.
    let keys = "search --onlyvisible --name ^Busbar$ windowfocus key F8 sleep 0.3 key F9";
    let mut hand = Command::new("sh");
    let loops = format!("while xdotool {keys}; do sleep 0.5; done");
    let hand = Process::start(hand.args(["-c", &loops]).env("DISPLAY", &display.name));
    let asked = host.wait_for(BusbarViewEventKind::ActionRequested);
    assert_eq!(
        (asked.id.as_str(), asked.alarm_action),
        (MIRRORED, BusbarViewAlarmAction::Acknowledge)
    );
    drop(hand);
    // It is the program's: nothing has changed before that says so.
    assert!(!host.events.iter().any(of_alarm), "{:?}", host.events);
    // SAFETY: an open view and a text.
    let mirror = |view| unsafe {
        busbar_view_mirror_alarm(view, alarm.as_ptr(), BusbarViewAlarmState::Acknowledged as u32)
    };
    assert_eq!(host.call(mirror), BusbarStatus::Ok);
    assert_eq!(host.wait("alarm", of_alarm).alarm_state, BusbarViewAlarmState::Acknowledged);
}
