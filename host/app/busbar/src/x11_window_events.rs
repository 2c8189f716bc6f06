//! Events of an X11 window that the event loop does not tell of: size, visibility, end.

use anyhow::Context;
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ChangeWindowAttributesAux, ConnectionExt, EventMask, Visibility,
};
use x11rb::rust_connection::RustConnection;

/// State of an iconified window in its property `WM_STATE` (ICCCM, 4.1.3.1).
const ICONIC_STATE: u32 = 3;

/// Event of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum X11WindowEvent {
    /// New size of the window, pixels.
    Resized([u32; 2]),
    /// True once the window is mapped; one that is not mapped has no pixels.
    Mapped(bool),
    /// True once the window is iconified, whether its window manager unmaps it or not.
    Iconified(bool),
    /// True once all of the window is covered by others.
    Covered(bool),
    /// End of the window.
    Gone,
}

/// Reports events of a window to `tell`, from a thread of its own, until that returns false.
/// Returns the window's size.
///
/// # Errors
/// No display, or no such window.
pub(crate) fn watch(
    window: u32,
    tell: impl Fn(X11WindowEvent) -> bool + Send + 'static,
) -> anyhow::Result<[u32; 2]> {
    let (connection, _) = x11rb::connect(None).context("no X11 display: set DISPLAY")?;
    let mask =
        EventMask::STRUCTURE_NOTIFY | EventMask::VISIBILITY_CHANGE | EventMask::PROPERTY_CHANGE;
    let wanted = ChangeWindowAttributesAux::new().event_mask(mask);
    let no_window = || format!("there is no X11 window {window:#x} on this display");
    connection.change_window_attributes(window, &wanted)?.check().with_context(no_window)?;
    let geometry = connection.get_geometry(window)?.reply().with_context(no_window)?;
    let state_atom = connection.intern_atom(false, b"WM_STATE")?.reply()?.atom;
    let size = [geometry.width, geometry.height].map(|side| u32::from(side).max(1));
    let work = move || {
        while let Ok(event) = connection.wait_for_event() {
            let happened = match event {
                Event::ConfigureNotify(event) if event.window == window => {
                    let size = [event.width, event.height].map(|side| u32::from(side).max(1));
                    X11WindowEvent::Resized(size)
                }
                Event::UnmapNotify(event) if event.window == window => {
                    X11WindowEvent::Mapped(false)
                }
                Event::MapNotify(event) if event.window == window => X11WindowEvent::Mapped(true),
                Event::VisibilityNotify(event) if event.window == window => {
                    X11WindowEvent::Covered(event.state == Visibility::FULLY_OBSCURED)
                }
                Event::PropertyNotify(event)
                    if event.window == window && event.atom == state_atom =>
                {
                    X11WindowEvent::Iconified(is_iconic(&connection, window, state_atom))
                }
                Event::DestroyNotify(event) if event.window == window => X11WindowEvent::Gone,
                _ => continue,
            };
            if !tell(happened) {
                return;
            }
        }
        // The display has gone, and the window with it.
        tell(X11WindowEvent::Gone);
    };
    std::thread::Builder::new().name("window events".into()).spawn(work)?;
    Ok(size)
}

/// Reports whether a window manager says that a window is iconified.
fn is_iconic(connection: &RustConnection, window: u32, state_atom: Atom) -> bool {
    let asked = connection.get_property(false, window, state_atom, AtomEnum::ANY, 0, 1);
    let answer = asked.ok().and_then(|asked| asked.reply().ok());
    answer.and_then(|answer| answer.value32()?.next()) == Some(ICONIC_STATE)
}
