//! Kiosk mode: a full-screen view on a monitor by name, also when that goes and comes back; nobody
//! leaves it by mistake.

use std::time::{Duration, Instant};

use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, WindowEvent};
use winit::keyboard::{Key, ModifiersState};
use winit::monitor::MonitorHandle;
use winit::window::{Fullscreen, Window};
use x11rb::connection::Connection;
use x11rb::protocol::randr::{ConnectionExt as _, MonitorInfo};
use x11rb::protocol::xproto::{ConnectionExt as _, ScreenSaver};
use x11rb::rust_connection::RustConnection;

/// Time for which the pointer stays visible after its last movement.
const POINTER_SHOWN: Duration = Duration::from_secs(5);
/// Period at which monitors are polled.
const POLL_PERIOD: Duration = Duration::from_secs(1);
/// Period at which the screen saver is reset.
const AWAKE_PERIOD: Duration = Duration::from_secs(30);

/// Keeps a window on its monitor.
pub(crate) struct Kiosk {
    wanted: Option<String>,
    shown_on: Option<MonitorArea>,
    looked_at: Option<Instant>,
    moved_at: Instant,
    is_pointer_shown: bool,
    modifiers: ModifiersState,
    /// X11 display; none on Wayland, whose compositors have settings of their own for that.
    display: Option<Display>,
    kept_awake_at: Option<Instant>,
}

/// Position and size of a monitor, pixels.
#[derive(Clone, Debug, PartialEq)]
struct MonitorArea {
    name: Option<String>,
    position: PhysicalPosition<i32>,
    size: PhysicalSize<u32>,
}

impl MonitorArea {
    fn from_monitor(monitor: &MonitorHandle) -> Self {
        let (name, position, size) = (monitor.name(), monitor.position(), monitor.size());
        Self { name, position, size }
    }
}

impl Kiosk {
    /// Creates the kiosk for this monitor, or the first one while there is none of that name.
    pub(crate) fn new(monitor: Option<String>) -> Self {
        Self {
            wanted: monitor,
            shown_on: None,
            looked_at: None,
            moved_at: Instant::now(),
            is_pointer_shown: true,
            modifiers: ModifiersState::empty(),
            display: Display::open(),
            kept_awake_at: None,
        }
    }

    /// Reports whether an event is the chord that ends the kiosk: Ctrl+Alt+Shift+Q.
    pub(crate) fn is_exit_chord(&mut self, event: &WindowEvent) -> bool {
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
            self.display.iter().for_each(Display::keep_awake);
        }
        if self.looked_at.is_none_or(|at| at.elapsed() >= POLL_PERIOD) {
            self.looked_at = Some(Instant::now());
            self.follow_monitors(window);
        }
    }

    fn follow_monitors(&mut self, window: &Window) {
        let places = match &self.display {
            Some(display) => display.monitors(),
            None => window
                .available_monitors()
                .map(|monitor| MonitorArea::from_monitor(&monitor))
                .collect(),
        };
        let wanted = |place: &&MonitorArea| self.wanted.is_some() && place.name == self.wanted;
        let Some(place) = places.iter().find(wanted).or(places.first()).cloned() else { return };
        let is_covered = window.inner_size() == place.size;
        if self.shown_on.as_ref() == Some(&place) && is_covered {
            return;
        }
        if self.shown_on.as_ref() != Some(&place) {
            tracing::info!("the view is on monitor {place:?}");
        }
        let monitor = window.available_monitors().find(|monitor| monitor.name() == place.name);
        window.set_fullscreen(None);
        window.set_fullscreen(Some(Fullscreen::Borderless(monitor)));
        // Without a window manager nobody else does.
        window.set_outer_position(place.position);
        let _ = window.request_inner_size(place.size);
        self.shown_on = Some(place);
    }
}

/// X11 display, queried anew each time: winit remembers monitors that are gone.
struct Display {
    connection: RustConnection,
    root: u32,
}

impl Display {
    fn open() -> Option<Self> {
        let (connection, screen) = x11rb::connect(None).ok()?;
        let root = connection.setup().roots.get(screen)?.root;
        Some(Self { connection, root })
    }

    /// Returns the monitors that are on, the primary one first.
    fn monitors(&self) -> Vec<MonitorArea> {
        let asked = self.connection.randr_get_monitors(self.root, true);
        let Some(answer) = asked.ok().and_then(|asked| asked.reply().ok()) else {
            return Vec::new();
        };
        let mut monitors = answer.monitors;
        monitors.sort_by_key(|monitor| !monitor.primary);
        let place = |monitor: &MonitorInfo| MonitorArea {
            name: self.name(monitor.name),
            position: PhysicalPosition::new(monitor.x.into(), monitor.y.into()),
            size: PhysicalSize::new(monitor.width.into(), monitor.height.into()),
        };
        monitors.iter().map(place).filter(|place| place.size.width > 0).collect()
    }

    fn name(&self, atom: u32) -> Option<String> {
        let name = self.connection.get_atom_name(atom).ok()?.reply().ok()?.name;
        String::from_utf8(name).ok()
    }

    /// Resets the screen saver. A display that has gone takes the window with it, and needs no
    /// report.
    fn keep_awake(&self) {
        let _ = self.connection.force_screen_saver(ScreenSaver::RESET);
        let _ = self.connection.flush();
    }
}
