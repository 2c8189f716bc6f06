//! Check for a display that can show a window.

use std::env::var_os;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;

use super::finding::Finding;

const CHECK: &str = "display";

/// Checks the display; Wayland takes precedence over X11, as for windows.
pub(super) fn check() -> Finding {
    let named = |name| var_os(name).filter(|value| !value.is_empty());
    if let Some(name) = named("WAYLAND_DISPLAY") {
        let folder = named("XDG_RUNTIME_DIR").map(PathBuf::from).unwrap_or_default();
        let socket = folder.join(&name);
        return match UnixStream::connect(&socket) {
            Ok(_) => Finding::ok(CHECK, format!("Wayland at {}", socket.display())),
            Err(error) => Finding::fault(
                CHECK,
                format!("no Wayland display answers at {}: {error}", socket.display()),
                "start the compositor, or correct WAYLAND_DISPLAY and XDG_RUNTIME_DIR",
            ),
        };
    }
    let Some(name) = named("DISPLAY") else {
        return Finding::warning(
            CHECK,
            "neither WAYLAND_DISPLAY nor DISPLAY is set: there is no display for a window",
            "set DISPLAY, such as DISPLAY=:0; `busbar render` and `busbar check` need none",
        );
    };
    match x11rb::connect(None) {
        Ok(_) => Finding::ok(CHECK, format!("X11 at {}", name.display())),
        Err(error) => Finding::fault(
            CHECK,
            format!("no X11 display answers at {}: {error}", name.display()),
            "start the X server, correct DISPLAY, or allow this user by xhost or XAUTHORITY",
        ),
    }
}
