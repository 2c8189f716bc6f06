//! Window of a viewer on an X display, input to it, and pixels of it.

use anyhow::{Context, Result};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ConfigureWindowAux, ConnectionExt as _, ImageFormat, InputFocus, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Beginning of the titles of viewers' windows.
const TITLE: &str = "Busbar";
const MAX_TITLE_WORDS: u32 = 64;
/// Codes of X's events of input.
const KEY_PRESS: u8 = 2;
const BUTTON_PRESS: u8 = 4;
const MOTION: u8 = 6;
/// Symbol of the left Ctrl key (X11 keysym definitions, `XK_Control_L`).
const CONTROL_SYMBOL: u32 = 0xffe3;
/// Bytes of a pixel.
const PIXEL_BYTES: usize = 4;
/// Difference of a channel from which pixels differ.
const DIFFERENCE: u8 = 12;
/// Size of the area that is looked at for a reaction, pixels.
const LOOK_SIZE: [u16; 2] = [96, 24];

/// Rectangle of a window, pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub(crate) at: [i16; 2],
    pub(crate) size: [u16; 2],
}

/// Window of a viewer at the upper left corner of its screen.
pub(crate) struct ViewerWindow {
    connection: RustConnection,
    root: Window,
    window: Window,
    size: std::cell::Cell<[u16; 2]>,
}

impl ViewerWindow {
    /// Finds the window of a viewer on the display of the environment.
    pub(crate) fn find() -> Result<Self> {
        let (connection, screen) = x11rb::connect(None).context("no X display")?;
        let root = connection.setup().roots[screen].root;
        let windows = connection.query_tree(root)?.reply()?.children;
        let has_title = |window: &Window| {
            let (name, text) = (AtomEnum::WM_NAME, AtomEnum::ANY);
            let title = connection.get_property(false, *window, name, text, 0, MAX_TITLE_WORDS);
            let title = title.ok().and_then(|title| title.reply().ok());
            title.is_some_and(|title| title.value.starts_with(TITLE.as_bytes()))
        };
        let window = windows.into_iter().find(has_title).context("no window of a viewer")?;
        let size = std::cell::Cell::new([0; 2]);
        Ok(Self { connection, root, window, size })
    }

    /// Moves the window to the corner of the screen, changes its size, and gives it the keyboard.
    pub(crate) fn resize(&self, size: [u16; 2]) -> Result<()> {
        let [width, height] = size.map(u32::from);
        let geometry = ConfigureWindowAux::new().x(0).y(0).width(width).height(height);
        self.connection.configure_window(self.window, &geometry)?.check()?;
        let focus = InputFocus::POINTER_ROOT;
        self.connection.set_input_focus(focus, self.window, x11rb::CURRENT_TIME)?.check()?;
        self.size.set(size);
        Ok(())
    }

    /// Returns width and height, pixels.
    pub(crate) fn size(&self) -> [u16; 2] {
        self.size.get()
    }

    /// Returns the area of the whole window.
    pub(crate) fn whole(&self) -> Area {
        Area { at: [0; 2], size: self.size() }
    }

    /// Moves the pointer on the screen.
    pub(crate) fn point_at(&self, [x, y]: [i16; 2]) -> Result<()> {
        self.send(MOTION, 0, [x, y])
    }

    /// Presses or releases the first button.
    pub(crate) fn press_button(&self, is_pressed: bool) -> Result<()> {
        self.send(if is_pressed { BUTTON_PRESS } else { BUTTON_PRESS + 1 }, 1, [0; 2])
    }

    /// Presses and releases the key of a letter together with Ctrl.
    pub(crate) fn press_with_control(&self, letter: char) -> Result<()> {
        let [control, key] = [CONTROL_SYMBOL, letter as u32].map(|symbol| self.key_of(symbol));
        let (control, key) = (control?, key?);
        for (kind, key) in
            [(KEY_PRESS, control), (KEY_PRESS, key), (KEY_PRESS + 1, key), (KEY_PRESS + 1, control)]
        {
            self.send(kind, key, [0; 2])?;
        }
        Ok(())
    }

    /// Returns the code of the key that has a symbol.
    fn key_of(&self, symbol: u32) -> Result<u8> {
        let setup = self.connection.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let mapping = self.connection.get_keyboard_mapping(first, last - first + 1)?.reply()?;
        let per_key = usize::from(mapping.keysyms_per_keycode).max(1);
        let index = mapping.keysyms.chunks(per_key).position(|of_key| of_key.contains(&symbol));
        let index = index.with_context(|| format!("no key has the symbol {symbol:#x}"))?;
        Ok(first + u8::try_from(index)?)
    }

    fn send(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) -> Result<()> {
        self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0)?.check()?;
        Ok(())
    }

    /// Returns the pixels of an area, four bytes each.
    pub(crate) fn pixels(
        &self,
        Area { at: [x, y], size: [width, height] }: Area,
    ) -> Result<Vec<u8>> {
        let format = ImageFormat::Z_PIXMAP;
        let image =
            self.connection.get_image(format, self.window, x, y, width, height, u32::MAX)?;
        Ok(image.reply()?.data)
    }

    /// Returns the area in which two pictures of the whole window differ most.
    pub(crate) fn most_different_area(&self, first: &[u8], second: &[u8]) -> Area {
        let [width, height] = self.size().map(usize::from);
        let [across, down] = LOOK_SIZE.map(usize::from);
        let mut best = (0, Area { at: [0; 2], size: LOOK_SIZE });
        for top in (0..height.saturating_sub(down)).step_by(down / 2) {
            for left in (0..width.saturating_sub(across)).step_by(across / 2) {
                let count = (top..top + down).flat_map(|row| {
                    (left..left + across).map(move |column| (row * width + column) * PIXEL_BYTES)
                });
                let differs = |&at: &usize| {
                    let pixel = at..at + PIXEL_BYTES;
                    are_different(&first[pixel.clone()], &second[pixel])
                };
                let count = count.filter(differs).count();
                if count > best.0 {
                    best = (count, Area { at: [left as i16, top as i16], size: LOOK_SIZE });
                }
            }
        }
        best.1
    }
}

fn are_different(first: &[u8], second: &[u8]) -> bool {
    first.iter().zip(second).any(|(one, other)| one.abs_diff(*other) > DIFFERENCE)
}

/// Returns the share of pixels in which two pictures of one size differ.
pub(crate) fn different_share(first: &[u8], second: &[u8]) -> f64 {
    let pixels = first.chunks(PIXEL_BYTES).zip(second.chunks(PIXEL_BYTES));
    let different = pixels.filter(|(one, other)| are_different(one, other)).count();
    different as f64 / (first.len() / PIXEL_BYTES).max(1) as f64
}
