//! A view that has a screen of its own: full-screen, on a monitor by name, wherever that
//! goes and comes back; nobody leaves it by mistake.

use std::time::{Duration, Instant};

use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, WindowEvent};
use winit::keyboard::{Key, ModifiersState};
use winit::monitor::MonitorHandle;
use winit::window::{Fullscreen, Window};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConnectionExt, ScreenSaver};
use x11rb::rust_connection::RustConnection;

/// How long the pointer is seen after it moved last.
const POINTER_SHOWN: Duration = Duration::from_secs(5);
/// How often monitors are looked at.
const LOOK_PERIOD: Duration = Duration::from_secs(1);
/// How often the screen saver is put off.
const AWAKE_PERIOD: Duration = Duration::from_secs(30);

/// Keeps a window on its monitor.
pub(crate) struct Kiosk {
    wanted: Option<String>,
    shown_on: Option<Place>,
    looked_at: Option<Instant>,
    moved_at: Instant,
    is_pointer_shown: bool,
    modifiers: ModifiersState,
    /// None on Wayland, whose compositors have settings of their own for that.
    display: Option<RustConnection>,
    kept_awake_at: Option<Instant>,
}

/// Where a monitor is, and how large.
#[derive(Clone, Debug, PartialEq)]
struct Place {
    name: Option<String>,
    position: PhysicalPosition<i32>,
    size: PhysicalSize<u32>,
}

impl Place {
    fn of(monitor: &MonitorHandle) -> Self {
        let (name, position, size) = (monitor.name(), monitor.position(), monitor.size());
        Self { name, position, size }
    }
}

impl Kiosk {
    /// On this monitor, or the first one while there is none of that name.
    pub(crate) fn on(monitor: Option<String>) -> Self {
        Self {
            wanted: monitor,
            shown_on: None,
            looked_at: None,
            moved_at: Instant::now(),
            is_pointer_shown: true,
            modifiers: ModifiersState::empty(),
            display: x11rb::connect(None).ok().map(|(display, _)| display),
            kept_awake_at: None,
        }
    }

    /// Whether an event is the chord that ends it: Ctrl+Alt+Shift+Q.
    pub(crate) fn ends_it(&mut self, event: &WindowEvent) -> bool {
        match event {
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::CursorMoved { .. } => self.moved_at = Instant::now(),
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                let chord = ModifiersState::CONTROL | ModifiersState::ALT | ModifiersState::SHIFT;
                let is_q = matches!(&event.logical_key, Key::Character(key) if key.eq_ignore_ascii_case("q"));
                return is_q && self.modifiers.contains(chord);
            }
            _ => {}
        }
        false
    }

    /// Follows the monitors, hides the pointer that rests, and keeps the screen on.
    pub(crate) fn step(&mut self, window: &Window) {
        let is_shown = self.moved_at.elapsed() < POINTER_SHOWN;
        if is_shown != self.is_pointer_shown {
            self.is_pointer_shown = is_shown;
            window.set_cursor_visible(is_shown);
        }
        if self.kept_awake_at.is_none_or(|at| at.elapsed() >= AWAKE_PERIOD) {
            self.kept_awake_at = Some(Instant::now());
            if let Some(display) = &self.display {
                // A display that has gone takes the window with it.
                let _ = display.force_screen_saver(ScreenSaver::RESET);
                let _ = display.flush();
            }
        }
        if self.looked_at.is_none_or(|at| at.elapsed() >= LOOK_PERIOD) {
            self.looked_at = Some(Instant::now());
            self.follow_monitors(window);
        }
    }

    fn follow_monitors(&mut self, window: &Window) {
        let mut monitors = window.available_monitors();
        let wanted = monitors.find(|monitor| monitor.name() == self.wanted && self.wanted.is_some());
        let monitor = wanted.or_else(|| window.primary_monitor());
        let Some(monitor) = monitor.or_else(|| window.available_monitors().next()) else { return };
        let place = Place::of(&monitor);
        let is_covered = window.inner_size() == place.size;
        if self.shown_on.as_ref() == Some(&place) && is_covered {
            return;
        }
        if self.shown_on.as_ref() != Some(&place) {
            tracing::info!("the view is on monitor {place:?}");
        }
        window.set_fullscreen(None);
        window.set_fullscreen(Some(Fullscreen::Borderless(Some(monitor))));
        // Without a window manager nobody else does.
        window.set_outer_position(place.position);
        let _ = window.request_inner_size(place.size);
        self.shown_on = Some(place);
    }
}
