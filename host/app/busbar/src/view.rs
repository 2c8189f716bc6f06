//! Subcommand `busbar view`: a window.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader};
use busbar_viewer::{RendererOptions, Viewer, renderer_options};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::arguments::ViewOptions;
use crate::kiosk::Kiosk;
use crate::log::Log;
use crate::metrics::ServedMetrics;
use crate::systemd::Watchdog;
use crate::window_watch::{WindowWatch, boot_nanos, x11_id};
use crate::x11_window_events::{self, X11WindowEvent};
use crate::{check, output, render};

const TITLE: &str = "Busbar";
/// Period of frames with live values, without any input.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
/// Environment variable with the operator of alarms, where the session has another name than the
/// account.
const OPERATOR_VARIABLE: &str = "BUSBAR_OPERATOR";
/// Period of steps while nobody sees the window: alarms, values and logs go on.
const UNSEEN_PERIOD: Duration = Duration::from_millis(300);
/// Shortest period of frames with input or motion, from beginning to beginning: a display may not
/// pace them.
const BUSY_PERIOD: Duration = Duration::from_millis(16);

pub(crate) fn run(options: &ViewOptions, log: Option<Log>) -> anyhow::Result<ExitCode> {
    let metrics = ServedMetrics::start(options.metrics, options.metrics_public)?;
    let scene = check::load(&options.config)?;
    let mut log_and_metrics = LogAndMetrics { log, metrics };
    log_and_metrics.follow(&scene);
    let event_loop = EventLoop::<Wake>::with_user_event().build().map_err(|error| {
        // Its own text names source files of the build machine.
        tracing::debug!("{error}");
        anyhow!("no display: set DISPLAY or WAYLAND_DISPLAY, or use `busbar render` for a picture")
    })?;
    let proxy = event_loop.create_proxy();
    let woken = proxy.clone();
    let wake = move || drop(woken.send_event(Wake::Configuration));
    let reloader = Reloader::start(&options.config, wake)
        .inspect_err(|error| tracing::warn!("the configuration is not watched: {error}"));
    let mut application = Application {
        options,
        scene: Some(scene),
        proxy,
        window: None,
        reloader: reloader.ok(),
        log_and_metrics,
        kiosk: options.kiosk.then(|| Kiosk::new(options.monitor.clone())),
        watchdog: Watchdog::default(),
        started: Instant::now(),
        last_step: Instant::now(),
        next_frame: Instant::now(),
        result: Ok(ExitCode::SUCCESS),
    };
    event_loop.run_app(&mut application)?;
    application.result
}

/// Wake-up of the event loop by another event than those that it tells of.
enum Wake {
    /// Change of the configuration.
    Configuration,
    /// Event of the window.
    Window(X11WindowEvent),
}

/// Log and metrics, by arguments or else by the configuration.
struct LogAndMetrics {
    log: Option<Log>,
    metrics: ServedMetrics,
}

impl LogAndMetrics {
    fn follow(&mut self, scene: &LoadedScene) {
        if let Some(log) = &mut self.log {
            log.follow(scene.log());
        }
        self.metrics.follow(scene.metrics());
    }
}

struct Application<'a> {
    options: &'a ViewOptions,
    /// Loaded scene, until the window exists.
    scene: Option<LoadedScene>,
    proxy: EventLoopProxy<Wake>,
    window: Option<OpenWindow>,
    reloader: Option<Reloader>,
    log_and_metrics: LogAndMetrics,
    kiosk: Option<Kiosk>,
    /// Watchdog of systemd, fed by frames.
    watchdog: Watchdog,
    started: Instant,
    /// Beginning of the last step.
    last_step: Instant,
    next_frame: Instant,
    result: anyhow::Result<ExitCode>,
}

struct OpenWindow {
    // The viewer holds the window too, and goes first.
    viewer: Viewer,
    egui: egui_winit::State,
    window: Arc<Window>,
    announced: bool,
    /// Watcher that hatches the window where this hangs; none on Wayland.
    watch: Option<WindowWatch>,
    /// Id of the X11 window; none on Wayland.
    x11_id: Option<u32>,
    /// False while the X11 window is not mapped.
    is_mapped: bool,
    is_iconified: bool,
    /// False while nobody sees the window.
    is_seen: bool,
    /// Frame that was drawn and may not be shown yet.
    unshown: Option<UnshownFrame>,
    /// True after a step that gave the window no frame: Wayland answers none of its requests.
    awaits_commit: bool,
    /// Reason for an older picture, as in the window's title.
    trouble: Option<String>,
}

/// Frame that was drawn and may not be shown yet.
struct UnshownFrame {
    /// Number of the frame among those of the window.
    number: u64,
    /// Instant of the values in it; none where it is no proof of life, since it shows a trouble.
    true_at: Option<u64>,
}

impl ApplicationHandler<Wake> for Application<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(scene) = self.scene.take() {
            match OpenWindow::open(event_loop, scene, self.options.validation) {
                Ok(window) => {
                    window.watch_events(self.proxy.clone());
                    self.window = Some(window);
                }
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, wake: Wake) {
        if let (Wake::Window(event), Some(open)) = (wake, &mut self.window) {
            open.follow(event);
        }
        self.next_frame = self.next_frame.min(Instant::now());
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let next_busy_frame = self.last_step + BUSY_PERIOD;
        let Some(open) = &mut self.window else { return };
        let response = open.egui.on_window_event(&open.window, &event);
        if response.repaint {
            self.next_frame = self.next_frame.min(next_busy_frame);
        }
        if self.kiosk.as_mut().is_some_and(|kiosk| kiosk.is_exit_chord(&event)) {
            return self.close(event_loop);
        }
        match event {
            // Nobody leaves a kiosk by mistake.
            WindowEvent::CloseRequested if self.kiosk.is_some() => {}
            WindowEvent::CloseRequested => self.close(event_loop),
            WindowEvent::Resized(size) => {
                open.viewer.resize([size.width, size.height]);
                self.next_frame = self.next_frame.min(Instant::now());
            }
            // On X11 that is all of the window behind others, which may still show as a thumbnail.
            WindowEvent::Occluded(is_occluded) if open.x11_id.is_none() => {
                open.set_seen(!is_occluded);
                self.next_frame = self.next_frame.min(Instant::now());
            }
            // Steps ask for none on X11: the window was uncovered, and has lost its picture.
            WindowEvent::RedrawRequested if open.steps_directly() => {
                open.viewer.invalidate_shown();
                self.next_frame = self.next_frame.min(Instant::now());
            }
            WindowEvent::RedrawRequested => self.step(event_loop),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let elapsed = self.started.elapsed();
        if self.options.seconds.is_some_and(|seconds| elapsed >= seconds) {
            return self.close(event_loop);
        }
        if Instant::now() >= self.next_frame
            && let Some(open) = &self.window
        {
            match open.steps_directly() {
                true => self.step(event_loop),
                false => {
                    open.window.request_redraw();
                    // The window system answers in its time, or never while nothing is seen.
                    self.next_frame = Instant::now() + IDLE_PERIOD;
                }
            }
        } else if let Some(open) = &mut self.window {
            // Nothing is to be drawn that could be prepared meanwhile.
            open.show_frame();
        }
        let is_unshown = self.window.as_ref().is_some_and(|open| open.unshown.is_some());
        event_loop.set_control_flow(match is_unshown {
            true => ControlFlow::Poll,
            false => ControlFlow::WaitUntil(self.next_frame),
        });
    }
}

impl Application<'_> {
    /// Steps the view, and all that follows it.
    fn step(&mut self, event_loop: &ActiveEventLoop) {
        self.last_step = Instant::now();
        let Some(open) = &mut self.window else { return };
        if let Some(reloader) = &mut self.reloader
            && reloader.step(&mut open.viewer) == Some(ReloadOutcome::Shown)
        {
            self.log_and_metrics.follow(open.viewer.scene());
        }
        match open.step() {
            Ok((repaint_after, is_drawn)) => {
                self.log_and_metrics.metrics.note(&open.viewer, is_drawn);
                if let Some(kiosk) = &mut self.kiosk {
                    kiosk.step(&open.window);
                }
                self.watchdog.feed();
                let now = Instant::now();
                self.next_frame = match open.is_seen {
                    true => {
                        (now + repaint_after.min(IDLE_PERIOD)).max(self.last_step + BUSY_PERIOD)
                    }
                    false => now + UNSEEN_PERIOD,
                };
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn close(&mut self, event_loop: &ActiveEventLoop) {
        self.watchdog.end();
        if let Some(open) = self.window.take() {
            let stats = open.viewer.stats();
            self.result = match &self.options.stats {
                Some(path) => output::write_json(path, &stats),
                None => Ok(()),
            }
            .map(|()| render::verdict(&stats.validation_messages));
        }
        event_loop.exit();
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        self.window = None;
        self.result = Err(error);
        event_loop.exit();
    }
}

impl OpenWindow {
    fn open(
        event_loop: &ActiveEventLoop,
        scene: LoadedScene,
        validation: bool,
    ) -> anyhow::Result<Self> {
        let [width, height] = scene.size();
        let attributes = Window::default_attributes()
            .with_title(TITLE)
            .with_inner_size(PhysicalSize::new(width, height));
        let window =
            Arc::new(event_loop.create_window(attributes).context("cannot open a window")?);
        let size = window.inner_size();
        let options = RendererOptions { validation, ..renderer_options(&scene) };
        let mut viewer =
            Viewer::new_in_window(scene, options, window.clone(), [size.width, size.height])?;
        viewer.set_operator(&operator());
        let x11_id = x11_id(&window);
        if x11_id.is_some() {
            viewer.defer_presentation();
        }
        let egui = egui_winit::State::new(
            viewer.egui_context().clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            None,
        );
        Ok(Self {
            watch: WindowWatch::new(&window),
            x11_id,
            is_mapped: true,
            is_iconified: false,
            is_seen: true,
            viewer,
            egui,
            window,
            announced: false,
            unshown: None,
            awaits_commit: false,
            trouble: None,
        })
    }

    /// Has events of an X11 window sent to the event loop that it does not tell of by itself.
    fn watch_events(&self, proxy: EventLoopProxy<Wake>) {
        let Some(id) = self.x11_id else { return };
        let tell = move |event| proxy.send_event(Wake::Window(event)).is_ok();
        if let Err(error) = x11_window_events::watch(id, tell) {
            tracing::warn!("the view is drawn while nobody sees it, too: {error:#}");
        }
    }

    /// Follows an event of an X11 window.
    fn follow(&mut self, event: X11WindowEvent) {
        match event {
            X11WindowEvent::Mapped(is_mapped) => self.is_mapped = is_mapped,
            X11WindowEvent::Iconified(is_iconified) => self.is_iconified = is_iconified,
            // The event loop tells of these; what is covered may show as a thumbnail.
            X11WindowEvent::Resized(_) | X11WindowEvent::Covered(_) | X11WindowEvent::Gone => {}
        }
        self.set_seen(self.is_mapped && !self.is_iconified);
    }

    fn set_seen(&mut self, is_seen: bool) {
        if !std::mem::replace(&mut self.is_seen, is_seen) && is_seen {
            self.viewer.invalidate_shown();
        }
        self.viewer.set_seen(is_seen);
    }

    /// Reports whether steps come at their time. Otherwise the window system paces frames: on
    /// Wayland, while the window is seen and gets frames.
    fn steps_directly(&self) -> bool {
        self.x11_id.is_some() || !self.is_seen || self.awaits_commit
    }

    /// Shows the last frame drawn if it is not shown yet.
    fn show_frame(&mut self) {
        if self.unshown.is_some() {
            self.viewer.present_deferred();
            self.note_shown();
            // One that the window did not take never will be shown: it is drawn again.
            self.unshown = None;
        }
    }

    /// Notes the last frame drawn if the window has taken it.
    fn note_shown(&mut self) {
        let shown = self.viewer.window_frames().shown;
        let true_at =
            self.unshown.take_if(|frame| frame.number <= shown).and_then(|frame| frame.true_at);
        if let (Some(true_at), Some(watch)) = (true_at, &mut self.watch) {
            watch.note_frame(true_at);
        }
    }

    /// Steps the view; returns when the panels want the next step, and whether a frame was drawn.
    fn step(&mut self) -> anyhow::Result<(Duration, bool)> {
        let input = self.egui.take_egui_input(&self.window);
        self.window.pre_present_notify();
        let true_at = boot_nanos();
        let before = self.viewer.window_frames().submitted;
        let frame = self.viewer.frame(input)?;
        let number = self.viewer.window_frames().submitted;
        self.awaits_commit = number == before;
        let is_healthy = frame.trouble.is_none();
        // The frame before was shown when this one was submitted.
        self.note_shown();
        if number > before {
            self.unshown = Some(UnshownFrame { number, true_at: is_healthy.then_some(true_at) });
            self.note_shown();
        } else {
            self.show_frame();
        }
        let is_shown = self.viewer.window_frames().shown == number;
        if !frame.is_drawn
            && let Some(watch) = self.watch.as_mut().filter(|_| is_healthy)
        {
            if frame.is_current && is_shown {
                watch.note_unchanged(true_at, self.viewer.has_finished_frame());
            } else if !self.is_mapped {
                watch.note_unmapped(true_at);
            }
        }
        if let Some(platform) = frame.platform {
            self.egui.handle_platform_output(&self.window, platform);
        }
        if self.trouble != frame.trouble {
            let title = frame.trouble.as_ref().map(|trouble| format!("{TITLE}: {trouble}"));
            self.window.set_title(title.as_deref().unwrap_or(TITLE));
            self.trouble = frame.trouble;
        }
        if !self.announced {
            self.show_frame();
            output::result("ready");
            self.announced = true;
        }
        Ok((frame.repaint_after, frame.is_drawn))
    }
}

/// Returns the operator: that of `BUSBAR_OPERATOR`, else the account.
fn operator() -> String {
    let name = |variable| std::env::var(variable).ok().filter(|name| !name.trim().is_empty());
    name(OPERATOR_VARIABLE).or_else(|| name("USER")).or_else(|| name("LOGNAME")).unwrap_or_default()
}
