//! The host program's window, which is not ours: its size, whether it is seen, its end.

use anyhow::Context;
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{ChangeWindowAttributesAux, ConnectionExt, EventMask, Visibility};

/// What happened to it.
pub(super) enum Parent {
    /// It has this size, pixels.
    Resized([u32; 2]),
    /// It is seen, or is not.
    Shown(bool),
    /// It is there no more.
    Gone,
}

/// Tells `tell` what happens to a window, from a thread of its own, until that says no.
/// Gives the window's size.
///
/// # Errors
/// No display, or no such window.
pub(super) fn watch(
    window: u32,
    tell: impl Fn(Parent) -> bool + Send + 'static,
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
                    Parent::Resized([event.width, event.height].map(|s| u32::from(s).max(1)))
                }
                Event::UnmapNotify(event) if event.window == window => Parent::Shown(false),
                Event::MapNotify(event) if event.window == window => Parent::Shown(true),
                // What lies over it may be our own window; only all of it hidden counts.
                Event::VisibilityNotify(event) if event.window == window => {
                    Parent::Shown(event.state != Visibility::FULLY_OBSCURED)
                }
                Event::DestroyNotify(event) if event.window == window => Parent::Gone,
                _ => continue,
            };
            if !tell(happened) {
                return;
            }
        }
        // The display has gone, and the window with it.
        tell(Parent::Gone);
    };
    std::thread::Builder::new().name("host window".into()).spawn(work)?;
    Ok(size)
}
