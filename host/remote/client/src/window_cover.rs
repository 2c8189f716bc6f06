//! X11 cover: a hatched child window over a picture that is not live, by core X drawing alone.
//!
//! The cover belongs to the process that watches the viewer, and not to the viewer: it stays
//! whatever becomes of that. Its hatching is a background pixmap, which the X server repaints by
//! itself. It stays above all other children of the window, those of a new viewer included.

use std::os::fd::{AsFd, BorrowedFd};

use x11rb::connection::Connection;
use x11rb::errors::{ConnectError, ConnectionError, ReplyError, ReplyOrIdError};
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    ChangeGCAux, ChangeWindowAttributesAux, ConfigureWindowAux, ConnectionExt, CreateGCAux,
    CreateWindowAux, EventMask, Rectangle, StackMode, Visualtype, WindowClass,
};
use x11rb::rust_connection::RustConnection;

use crate::bitmap_font::{GLYPH_COLUMNS, GLYPH_ROWS, glyph};

/// Columns from stripe to stripe, and of a stripe, as in pictures in memory.
const PERIOD: u16 = 24;
const STRIPE: u16 = 4;
/// Shades of grey: between stripes, of stripes, of the box of the text, and of the text.
const GROUND: u8 = 0x48;
const LIGHT: u8 = 0xc0;
const BOX: u8 = 0x10;
const TEXT: u8 = 0xff;
/// Pixels of the screen a pixel of a glyph, at most.
const MAX_SCALE: u16 = 4;
/// Characters of the text at most.
const MAX_CHARACTERS: usize = 80;
/// Events that one step takes at most.
const MAX_EVENTS_A_STEP: usize = 256;

/// Fault of a cover.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CoverError {
    /// No X display by this name can be reached, or it has no such window.
    Unreachable(String),
    /// The covered window is there no more, or its display has gone.
    Gone,
}

/// A hatched window with a text over all of another window, shown and hidden at will.
pub struct WindowCover {
    connection: RustConnection,
    covered: u32,
    cover: u32,
    context: u32,
    shades: Shades,
    size: [u16; 2],
    text: String,
    is_shown: bool,
}

/// Pixel values of shades of grey.
#[derive(Clone, Copy, Debug)]
struct Shades {
    masks: [u32; 3],
    /// Bits of a pixel that are no colour: opacity, where there is any.
    rest: u32,
}

impl WindowCover {
    /// Makes a cover for a window, not shown yet. `display` is as the variable `DISPLAY`; none
    /// takes that.
    ///
    /// # Errors
    /// [`CoverError::Unreachable`].
    pub fn open(display: Option<&str>, window: u32) -> Result<Self, CoverError> {
        let no_display = |error: ConnectError| {
            let name =
                display.map_or_else(|| std::env::var("DISPLAY").unwrap_or_default(), Into::into);
            CoverError::Unreachable(format!("no X11 display '{name}': {error}"))
        };
        let (connection, _) = RustConnection::connect(display).map_err(no_display)?;
        Self::with_connection(connection, window).map_err(|error| {
            CoverError::Unreachable(format!("there is no X11 window {window:#x}: {error}"))
        })
    }

    fn with_connection(connection: RustConnection, covered: u32) -> Result<Self, ReplyOrIdError> {
        // Before its size is read, so that no change goes unnoticed.
        let mask = EventMask::STRUCTURE_NOTIFY | EventMask::SUBSTRUCTURE_NOTIFY;
        let wanted = ChangeWindowAttributesAux::new().event_mask(mask);
        connection.change_window_attributes(covered, &wanted)?.check()?;
        let geometry = connection.get_geometry(covered)?.reply()?;
        let attributes = connection.get_window_attributes(covered)?.reply()?;
        let visual = visual_of(&connection, attributes.visual);
        let shades = Shades::new(visual.as_ref(), geometry.depth);
        let size = [geometry.width, geometry.height].map(|side| side.max(1));
        let [cover, pixmap, context] =
            [connection.generate_id()?, connection.generate_id()?, connection.generate_id()?];
        connection.create_pixmap(geometry.depth, pixmap, covered, PERIOD, PERIOD)?;
        let values = CreateGCAux::new().foreground(shades.pixel(GROUND)).graphics_exposures(0);
        connection.create_gc(context, pixmap, &values)?;
        let tile = [Rectangle { x: 0, y: 0, width: PERIOD, height: PERIOD }];
        connection.poly_fill_rectangle(pixmap, context, &tile)?;
        let light = ChangeGCAux::new().foreground(shades.pixel(LIGHT));
        connection.change_gc(context, &light)?;
        connection.poly_fill_rectangle(pixmap, context, &stripes())?;
        let wanted = CreateWindowAux::new()
            .background_pixmap(pixmap)
            .border_pixel(0)
            .event_mask(EventMask::EXPOSURE);
        // Depth and visual are those of the covered window.
        let [width, height] = size;
        let class = WindowClass::INPUT_OUTPUT;
        let created = connection.create_window(
            x11rb::COPY_DEPTH_FROM_PARENT,
            cover,
            covered,
            0,
            0,
            width,
            height,
            0,
            class,
            x11rb::COPY_FROM_PARENT,
            &wanted,
        )?;
        created.check()?;
        connection.free_pixmap(pixmap)?;
        let text = String::new();
        Ok(Self { connection, covered, cover, context, shades, size, text, is_shown: false })
    }

    /// Covers the window with hatching and a text.
    ///
    /// # Errors
    /// [`CoverError::Gone`].
    pub fn show(&mut self, text: &str) -> Result<(), CoverError> {
        let is_same = self.is_shown && self.text == text;
        if !is_same {
            self.text = text.chars().take(MAX_CHARACTERS).collect();
            self.signal()?;
            self.connection.map_window(self.cover)?;
            self.connection.clear_area(true, self.cover, 0, 0, 0, 0)?;
            self.draw_text()?;
            self.is_shown = true;
        }
        self.step()
    }

    /// Hides the cover, so that the window is visible again.
    ///
    /// # Errors
    /// [`CoverError::Gone`].
    pub fn hide(&mut self) -> Result<(), CoverError> {
        if std::mem::replace(&mut self.is_shown, false) {
            self.connection.unmap_window(self.cover)?;
        }
        self.step()
    }

    /// Reports whether the window is covered.
    pub fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// Descriptor that is readable when [`WindowCover::step`] has something to do.
    pub fn descriptor(&self) -> BorrowedFd<'_> {
        self.connection.stream().as_fd()
    }

    /// Follows the window's size and stays above its other children, without waiting.
    ///
    /// # Errors
    /// [`CoverError::Gone`].
    pub fn step(&mut self) -> Result<(), CoverError> {
        let (mut is_raised, mut is_exposed) = (true, false);
        for _ in 0..MAX_EVENTS_A_STEP {
            let Some(event) = self.connection.poll_for_event()? else { break };
            match event {
                Event::ConfigureNotify(event) if event.window == self.covered => {
                    self.resize([event.width, event.height])?;
                }
                Event::DestroyNotify(event) if event.window == self.covered => {
                    return Err(CoverError::Gone);
                }
                Event::Expose(event) => is_exposed |= event.count == 0,
                // A child that came, or went up.
                Event::CreateNotify(event) => is_raised &= event.window == self.cover,
                Event::MapNotify(event) => is_raised &= event.window == self.cover,
                Event::ReparentNotify(event) => is_raised &= event.window == self.cover,
                Event::CirculateNotify(event) => is_raised &= event.window == self.cover,
                Event::ConfigureNotify(event) => is_raised &= event.window == self.cover,
                _ => {}
            }
        }
        if self.is_shown && !is_raised {
            self.signal()?;
        }
        if self.is_shown && is_exposed {
            self.draw_text()?;
        }
        self.connection.flush()?;
        Ok(())
    }

    fn signal(&self) -> Result<(), CoverError> {
        let above = ConfigureWindowAux::new().stack_mode(StackMode::ABOVE);
        self.connection.configure_window(self.cover, &above)?;
        Ok(())
    }

    fn resize(&mut self, size: [u16; 2]) -> Result<(), CoverError> {
        let size = size.map(|side| side.max(1));
        if std::mem::replace(&mut self.size, size) != size {
            let [width, height] = size.map(u32::from);
            let wanted = ConfigureWindowAux::new().width(width).height(height);
            self.connection.configure_window(self.cover, &wanted)?;
            // The text moves to the new middle.
            self.connection.clear_area(true, self.cover, 0, 0, 0, 0)?;
        }
        Ok(())
    }

    fn draw_text(&self) -> Result<(), CoverError> {
        let (ground, glyphs) = text_rectangles(&self.text, self.size);
        self.fill(BOX, &[ground])?;
        self.fill(TEXT, &glyphs)
    }

    fn fill(&self, shade: u8, rectangles: &[Rectangle]) -> Result<(), CoverError> {
        let color = ChangeGCAux::new().foreground(self.shades.pixel(shade));
        self.connection.change_gc(self.context, &color)?;
        self.connection.poly_fill_rectangle(self.cover, self.context, rectangles)?;
        Ok(())
    }
}

impl From<ConnectionError> for CoverError {
    fn from(_: ConnectionError) -> Self {
        Self::Gone
    }
}

impl From<ReplyError> for CoverError {
    fn from(_: ReplyError) -> Self {
        Self::Gone
    }
}

impl std::fmt::Display for CoverError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unreachable(words) => formatter.write_str(words),
            Self::Gone => formatter.write_str("the window or its display is there no more"),
        }
    }
}

impl std::error::Error for CoverError {}

impl Shades {
    /// Creates the shades of a visual. A visual without masks, as one with a palette, has black and
    /// white alone.
    fn new(visual: Option<&Visualtype>, depth: u8) -> Self {
        let masks = visual.map_or([0; 3], |v| [v.red_mask, v.green_mask, v.blue_mask]);
        let all = if depth >= 32 { u32::MAX } else { (1 << depth) - 1 };
        Self { masks, rest: all & !(masks[0] | masks[1] | masks[2]) }
    }

    /// Pixel value of a shade.
    fn pixel(self, shade: u8) -> u32 {
        if self.masks == [0; 3] {
            return u32::from(shade > 0x80);
        }
        let part = |mask: u32| {
            let most = mask.checked_shr(mask.trailing_zeros()).unwrap_or(0);
            let part = (u64::from(most) * u64::from(shade) + 127) / 255;
            (part as u32).checked_shl(mask.trailing_zeros()).unwrap_or(0) & mask
        };
        self.masks.into_iter().map(part).fold(self.rest, |pixel, part| pixel | part)
    }
}

fn visual_of(connection: &RustConnection, id: u32) -> Option<Visualtype> {
    let screens = connection.setup().roots.iter();
    let depths = screens.flat_map(|screen| &screen.allowed_depths);
    depths.flat_map(|depth| &depth.visuals).find(|visual| visual.visual_id == id).copied()
}

/// Diagonal stripes of one tile, row by row.
fn stripes() -> Vec<Rectangle> {
    let pixel = |x: u16, y: u16| Rectangle { x: x as i16, y: y as i16, width: 1, height: 1 };
    let row = |y: u16| (0..PERIOD).filter(move |x| (x + y) % PERIOD < STRIPE).map(move |x| (x, y));
    (0..PERIOD).flat_map(row).map(|(x, y)| pixel(x, y)).collect()
}

/// A box in the middle of a window, and the pixels of a text in it.
fn text_rectangles(text: &str, [width, height]: [u16; 2]) -> (Rectangle, Vec<Rectangle>) {
    let advance = GLYPH_COLUMNS + 1;
    let columns = (text.chars().count() as u16).max(1) * advance + 1;
    let rows = GLYPH_ROWS + 4;
    let scale = (width / (columns + 2)).min(height / (rows + 2)).clamp(1, MAX_SCALE);
    let (box_width, box_height) = (columns * scale, rows * scale);
    let middle = |side: u16, part: u16| (i32::from(side) - i32::from(part)) / 2;
    let (left, top) = (middle(width, box_width), middle(height, box_height));
    let (scale, at) = (i32::from(scale), |x: i32| x as i16);
    let mut pixels = Vec::new();
    for (place, character) in text.chars().enumerate() {
        for (row, bits) in glyph(character).into_iter().enumerate() {
            for column in (0..GLYPH_COLUMNS).filter(|column| bits >> column & 1 == 1) {
                let column = i32::from(GLYPH_COLUMNS - 1 - column);
                pixels.push(Rectangle {
                    x: at(left + (1 + place as i32 * i32::from(advance) + column) * scale),
                    y: at(top + (2 + row as i32) * scale),
                    width: scale as u16,
                    height: scale as u16,
                });
            }
        }
    }
    (Rectangle { x: at(left), y: at(top), width: box_width, height: box_height }, pixels)
}

#[cfg(test)]
#[path = "window_cover_tests.rs"]
mod tests;
