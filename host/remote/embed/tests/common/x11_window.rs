//! A host program's window on a display in memory, and what is seen in it.
#![allow(dead_code)]

use std::ffi::CString;
use std::process::Command;

use busbar::abi::BusbarViewWindowSystem;
use e2e::Scene;
use e2e::display::Display;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::rust_connection::RustConnection;

use crate::common::judge::{Seen, Surface};
use crate::common::{Host, program_with};

/// Size of the window and of the screen, pixels.
pub(crate) const SIZE: [u16; 2] = [640, 360];

/// An X display with one window over all of it.
pub(crate) struct X11Window {
    pub(crate) display: Display,
    connection: RustConnection,
    pub(crate) window: u32,
}

impl X11Window {
    /// Makes the window; none where there is no Xvfb.
    pub(crate) fn open() -> Option<Self> {
        let display = Display::start(SIZE.map(u32::from))?;
        let (connection, screen) = RustConnection::connect(Some(&display.name)).expect("it runs");
        let root = connection.setup().roots[screen].root;
        let window = connection.generate_id().expect("there are ids");
        let wanted = CreateWindowAux::new().background_pixel(0x20_40_80).override_redirect(1);
        let ([width, height], class) = (SIZE, WindowClass::INPUT_OUTPUT);
        let created = connection.create_window(
            x11rb::COPY_DEPTH_FROM_PARENT,
            window,
            root,
            0,
            0,
            width,
            height,
            0,
            class,
            x11rb::COPY_FROM_PARENT,
            &wanted,
        );
        created.expect("it is sent").check().expect("the window is there");
        connection.map_window(window).expect("it is sent").check().expect("it is mapped");
        Some(Self { display, connection, window })
    }

    /// Returns the program with this display in its environment: the library finds it there.
    pub(crate) fn program(&self, scene: &Scene) -> CString {
        let mut environment = Command::new("busbar");
        environment.env("DISPLAY", &self.display.name).env("WINIT_X11_SCALE_FACTOR", "1");
        program_with(scene, &environment)
    }

    /// Opens a view in the window.
    pub(crate) fn host(&self, scene: &Scene) -> Host {
        let program = self.program(scene);
        Host::open_with(scene, |options| {
            options.program = program.as_ptr();
            options.window_system = BusbarViewWindowSystem::X11 as u32;
            options.window = self.window.into();
        })
    }

    /// Reads the pixels of the window, with all windows in it.
    pub(crate) fn pixels(&self) -> Seen {
        let [width, height] = SIZE;
        let root = self.connection.setup().roots[0].root;
        let image = self
            .connection
            .get_image(ImageFormat::Z_PIXMAP, root, 0, 0, width, height, u32::MAX)
            .expect("it is sent")
            .reply()
            .expect("the screen can be read");
        Seen { width: usize::from(width), pixels: image.data }
    }

    /// Sets the size of the window.
    pub(crate) fn resize(&self, [width, height]: [u16; 2]) {
        use x11rb::protocol::xproto::ConfigureWindowAux;
        let wanted = ConfigureWindowAux::new().width(u32::from(width)).height(u32::from(height));
        let configured = self.connection.configure_window(self.window, &wanted);
        configured.expect("it is sent").check().expect("it is there");
    }

    /// Makes a child of the window above all others, of one colour.
    pub(crate) fn put_child_above(&self) -> u32 {
        let child = self.connection.generate_id().expect("there are ids");
        let wanted = CreateWindowAux::new().background_pixel(0xff_00_00);
        let class = WindowClass::INPUT_OUTPUT;
        let ([width, height], depth) = (SIZE, x11rb::COPY_DEPTH_FROM_PARENT);
        let created = self.connection.create_window(
            depth,
            child,
            self.window,
            0,
            0,
            width,
            height,
            0,
            class,
            x11rb::COPY_FROM_PARENT,
            &wanted,
        );
        created.expect("it is sent").check().expect("it is there");
        self.connection.map_window(child).expect("it is sent").check().expect("it is mapped");
        child
    }

    pub(crate) fn destroy(&self) {
        self.connection.destroy_window(self.window).expect("it is sent").check().expect("it goes");
    }
}

impl Surface for X11Window {
    fn look(&mut self, _: &mut Host) -> Option<Seen> {
        Some(self.pixels())
    }
}
