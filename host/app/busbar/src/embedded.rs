//! Subcommand `busbar embedded`: the view of a host program, in its window or offscreen.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Viewer, renderer_options};
use busbar_viewer_server::{Target, ViewerServer};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::platform::x11::{EventLoopBuilderExtX11, WindowAttributesExtX11};
use winit::window::{Window, WindowId};

use crate::x11_window_events::{self, X11WindowEvent};

/// Period of frames without input, as in a window of the program's own.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
const BUSY_PERIOD: Duration = Duration::from_millis(16);
/// Period of steps while nobody sees the window: short enough that the viewer is never taken for
/// dead.
const HIDDEN_PERIOD: Duration = Duration::from_millis(300);

pub(crate) fn run() -> anyhow::Result<ExitCode> {
    let mut embedded = ViewerServer::accept().map_err(|error| anyhow!(error))?;
    let scene = embedded.load()?;
    match embedded.target() {
        Target::Offscreen => embedded.run_offscreen(scene)?,
        Target::Window(window) => in_window(embedded, scene, window)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Event that wakes the event loop.
enum Wake {
    /// Command of the host program.
    Command,
    /// Event of the host program's window.
    Window(X11WindowEvent),
}

fn in_window(mut embedded: ViewerServer, scene: LoadedScene, window: u32) -> anyhow::Result<()> {
    let mut builder = EventLoop::<Wake>::with_user_event();
    let event_loop = builder.with_x11().build();
    let event_loop = event_loop.map_err(|error| anyhow!("no X11 display: {error}"));
    let event_loop = event_loop.inspect_err(|error| embedded.report_failure(&error.to_string()))?;
    let proxy = event_loop.create_proxy();
    embedded.set_waker(move || drop(proxy.send_event(Wake::Command)));
    let proxy = event_loop.create_proxy();
    let tell = move |event| proxy.send_event(Wake::Window(event)).is_ok();
    let size = x11_window_events::watch(window, tell);
    let size = size.inspect_err(|error| embedded.report_failure(&format!("{error:#}")))?;
    let mut application = Application {
        embedded,
        scene: Some(scene),
        parent: window,
        size,
        pane: None,
        is_mapped: true,
        is_covered: false,
        next_frame: Instant::now(),
        result: Ok(()),
    };
    event_loop.run_app(&mut application)?;
    application.result
}

struct Application {
    embedded: ViewerServer,
    /// Loaded scene, until the window exists.
    scene: Option<LoadedScene>,
    parent: u32,
    /// Size of the host program's window, pixels.
    size: [u32; 2],
    pane: Option<Pane>,
    /// False while the host program's window is not mapped, and nobody sees it.
    is_mapped: bool,
    /// True while others cover the host program's window.
    is_covered: bool,
    next_frame: Instant,
    result: anyhow::Result<()>,
}

/// Child window in that of the host program.
struct Pane {
    // The viewer holds the window too, and goes first.
    viewer: Viewer,
    egui: egui_winit::State,
    window: Arc<Window>,
    /// Reason for an older picture, as the host program was told.
    trouble: Option<String>,
}

impl ApplicationHandler<Wake> for Application {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(scene) = self.scene.take() {
            match self.open(event_loop, scene) {
                Ok(pane) => self.pane = Some(pane),
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, wake: Wake) {
        match wake {
            Wake::Command => self.next_frame = self.next_frame.min(Instant::now() + BUSY_PERIOD),
            Wake::Window(event) => self.follow_window(event_loop, event),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(pane) = &mut self.pane else { return };
        if pane.egui.on_window_event(&pane.window, &event).repaint {
            self.next_frame = self.next_frame.min(Instant::now() + BUSY_PERIOD);
        }
        match event {
            // The host program's window took ours along.
            WindowEvent::CloseRequested | WindowEvent::Destroyed => event_loop.exit(),
            WindowEvent::Resized(size) => pane.viewer.resize([size.width, size.height]),
            // Steps ask for none: the window was uncovered, and has lost its picture.
            WindowEvent::RedrawRequested => {
                pane.viewer.invalidate_shown();
                self.next_frame = self.next_frame.min(Instant::now());
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if Instant::now() >= self.next_frame && self.pane.is_some() {
            if let Err(error) = self.step() {
                self.fail(event_loop, error);
            } else if self.pane.is_none() {
                event_loop.exit();
            }
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(self.next_frame));
    }
}

impl Application {
    fn open(&mut self, event_loop: &ActiveEventLoop, scene: LoadedScene) -> anyhow::Result<Pane> {
        let [width, height] = self.size;
        let attributes = Window::default_attributes()
            .with_title("Busbar")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_embed_parent_window(self.parent);
        let window = event_loop.create_window(attributes);
        let window = Arc::new(window.context("no window in that of the host program")?);
        let options = renderer_options(&scene);
        let open = || Viewer::new_in_window(scene, options, window.clone(), [width, height]);
        let viewer = self.embedded.open_viewer(open)?;
        let egui = glue(&viewer, &window);
        Ok(Pane { viewer, egui, window, trouble: None })
    }

    /// Follows the host program's window.
    fn follow_window(&mut self, event_loop: &ActiveEventLoop, event: X11WindowEvent) {
        match event {
            X11WindowEvent::Resized(size) => self.resize(size),
            X11WindowEvent::Mapped(is_mapped) => self.is_mapped = is_mapped,
            X11WindowEvent::Covered(is_covered) => self.is_covered = is_covered,
            // Where it is no top-level window, no window manager tells.
            X11WindowEvent::Iconified(_) => {}
            X11WindowEvent::Gone => event_loop.exit(),
        }
        if let Some(pane) = &mut self.pane {
            pane.viewer.set_seen(self.is_mapped);
            self.next_frame = self.next_frame.min(Instant::now());
        }
    }

    fn resize(&mut self, [width, height]: [u32; 2]) {
        self.size = [width, height];
        if let Some(pane) = &self.pane {
            // Ours follows; its own event resizes the picture.
            let _ = pane.window.request_inner_size(PhysicalSize::new(width, height));
        }
    }

    /// Executes commands and draws one frame. Without a pane afterwards, the host program has
    /// detached.
    fn step(&mut self) -> anyhow::Result<()> {
        let Some(mut pane) = self.pane.take() else { return Ok(()) };
        if self.embedded.apply_commands(&mut pane.viewer).is_none() {
            return Ok(());
        }
        let input = pane.egui.take_egui_input(&pane.window);
        pane.window.pre_present_notify();
        let frame = pane.viewer.frame(input)?;
        if let Some(platform) = frame.platform {
            pane.egui.handle_platform_output(&pane.window, platform);
        }
        // One that is not drawn anew is shown once the device has drawn it. A window that is not
        // mapped shows nothing old.
        let is_shown = frame.is_drawn
            || frame.is_current && pane.viewer.has_finished_frame()
            || !self.is_mapped;
        self.embedded.note_frame_drawn(frame.trouble.is_none() && is_shown);
        if frame.trouble != pane.trouble {
            self.embedded.report_trouble(frame.trouble.as_deref().unwrap_or_default());
            pane.trouble = frame.trouble;
        }
        self.embedded.report_changes(&mut pane.viewer);
        // Unseen or not, alarms and values go on.
        let wait = match self.is_mapped && !self.is_covered && self.embedded.is_visible() {
            true => frame.repaint_after.clamp(BUSY_PERIOD, IDLE_PERIOD),
            false => HIDDEN_PERIOD,
        };
        self.next_frame = Instant::now() + wait;
        self.pane = Some(pane);
        Ok(())
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        self.embedded.report_failure(&format!("{error:#}"));
        self.pane = None;
        self.result = Err(error);
        event_loop.exit();
    }
}

fn glue(viewer: &Viewer, window: &Window) -> egui_winit::State {
    let scale = Some(window.scale_factor() as f32);
    let context = viewer.egui_context().clone();
    egui_winit::State::new(context, egui::ViewportId::ROOT, window, scale, None, None)
}
