//! Events of the host program's window: size, visibility, end.

use anyhow::Context;
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{ChangeWindowAttributesAux, ConnectionExt, EventMask, Visibility};

/// Event of the parent window.
pub(super) enum ParentEvent {
    /// New size of the window, pixels.
    Resized([u32; 2]),
    /// New visibility of the window.
    Shown(bool),
    /// End of the window.
    Gone,
}

/// Reports events of a window to `tell`, from a thread of its own, until that returns false.
/// Returns the window's size.
///
/// # Errors
/// No display, or no such window.
pub(super) fn watch(
    window: u32,
    tell: impl Fn(ParentEvent) -> bool + Send + 'static,
) -> anyhow::Result<[u32; 2]> {
    let (connection, _) = x11rb::connect(None).context("no X11 display: set DISPLAY")?;
    let mask = EventMask::STRUCTURE_NOTIFY | EventMask::VISIBILITY_CHANGE;
    let wanted = ChangeWindowAttributesAux::new().event_mask(mask);
    let no_window = || format!("there is no X11 window {window:#x} on this display");
    connection.change_window_attributes(window, &wanted)?.check().with_context(no_window)?;
    let geometry = connection.get_geometry(window)?.reply().with_context(no_window)?;
    let size = [geometry.width, geometry.height].map(|side| u32::from(side).max(1));
    let work = move || {
        while let Ok(event) = connection.wait_for_event() {
            let happened = match event {
                Event::ConfigureNotify(event) if event.window == window => {
                    ParentEvent::Resized([event.width, event.height].map(|s| u32::from(s).max(1)))
                }
                Event::UnmapNotify(event) if event.window == window => ParentEvent::Shown(false),
                Event::MapNotify(event) if event.window == window => ParentEvent::Shown(true),
                // What lies over it may be our own window; only all of it hidden counts.
                Event::VisibilityNotify(event) if event.window == window => {
                    ParentEvent::Shown(event.state != Visibility::FULLY_OBSCURED)
                }
                Event::DestroyNotify(event) if event.window == window => ParentEvent::Gone,
                _ => continue,
            };
            if !tell(happened) {
                return;
            }
        }
        // The display has gone, and the window with it.
        tell(ParentEvent::Gone);
    };
    std::thread::Builder::new().name("host window".into()).spawn(work)?;
    Ok(size)
}
