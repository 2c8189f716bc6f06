//! Draws 200 frames into a window while its size changes every tenth frame, with the validation
//! layer on; the second half of them is shown deferred. Fails if the layer says anything.

mod yard;

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use busbar_renderer::{
    CameraView, DrawInstance, EguiFrame, Frame, Renderer, RendererOptions, ValidationLog,
};
use glam::Vec3;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

const FRAMES: u32 = 200;
const FRAMES_PER_SIZE: u32 = 10;
/// First frame whose presentation is deferred, and the period of those that are shown before the
/// next one is drawn.
const FIRST_DEFERRED: u32 = FRAMES / 2;
const SHOWN_PERIOD: u32 = 7;

/// At least so many frames must have been shown, not skipped.
const MIN_SHOWN: u32 = FRAMES / 2;

/// Stays on screen at the end, for a screenshot.
const LAST_LOOK: Duration = Duration::from_millis(1500);

#[derive(Default)]
struct App {
    view: Option<View>,
    log: Option<ValidationLog>,
    drawn: u32,
    shown: u32,
    outcome: Option<Result<()>>,
}

struct View {
    renderer: Renderer,
    instances: Vec<DrawInstance>,
    window: Arc<Window>,
    context: egui::Context,
}

impl View {
    fn open(event_loop: &ActiveEventLoop) -> Result<Self> {
        let attributes = Window::default_attributes()
            .with_title("busbar")
            .with_inner_size(PhysicalSize::new(800, 500));
        let window = Arc::new(event_loop.create_window(attributes)?);
        let size = window.inner_size().into();
        let options = RendererOptions { validation: true, ..Default::default() };
        let mut renderer = Renderer::for_window(options, window.clone(), size)?;
        let instances = yard::build(&mut renderer)?;
        Ok(Self { renderer, instances, window, context: egui::Context::default() })
    }

    /// Draws a frame; false if it was skipped.
    fn draw(&mut self, number: u32) -> Result<bool> {
        let PhysicalSize { width, height } = self.window.inner_size();
        let angle = number as f32 * 0.01;
        let eye = Vec3::new(8.0 * angle.cos(), 3.4, 8.0 * angle.sin());
        let aspect = width as f32 / height.max(1) as f32;
        let target = Vec3::new(0.0, 1.9, 0.0);
        let screen = egui::vec2(width as f32, height as f32);
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, screen)),
            ..Default::default()
        };
        let mut output = self.context.run_ui(input, |ui| {
            ui.heading(format!("frame {number} at {width} x {height}"));
        });
        let primitives = self.context.tessellate(output.shapes, 1.0);
        let camera = CameraView::look_at(eye, target, Vec3::Y, 0.7, aspect, 0.05);
        let drawn = self.renderer.draw(&Frame {
            wireframe: number % 50 == 49,
            background: [0.68, 0.70, 0.72],
            overlay: Some(EguiFrame {
                textures_delta: &output.textures_delta,
                primitives: &primitives,
                pixels_per_point: 1.0,
            }),
            ..Frame::new(camera, &self.instances)
        });
        output.textures_delta.clear();
        Ok(drawn?.triangles > 0)
    }
}

impl App {
    fn step(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some(view) = &mut self.view else {
            return Ok(());
        };
        if self.drawn == FRAMES {
            view.renderer.present_deferred()?;
            std::thread::sleep(LAST_LOOK);
            event_loop.exit();
            return Ok(());
        }
        if self.drawn % FRAMES_PER_SIZE == FRAMES_PER_SIZE - 1 {
            let step = self.drawn / FRAMES_PER_SIZE;
            let size = PhysicalSize::new(300 + step * 97 % 600, 200 + step * 61 % 400);
            if let Some(size) = view.window.request_inner_size(size) {
                view.renderer.resize(size.into());
            }
        }
        if self.drawn == FIRST_DEFERRED {
            view.renderer.defer_presentation();
        }
        self.shown += u32::from(view.draw(self.drawn)?);
        if self.drawn >= FIRST_DEFERRED && self.drawn.is_multiple_of(SHOWN_PERIOD) {
            view.renderer.present_deferred()?;
        }
        self.drawn += 1;
        view.window.request_redraw();
        Ok(())
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        match View::open(event_loop) {
            Ok(view) => {
                self.log = Some(view.renderer.validation_log());
                view.window.request_redraw();
                self.view = Some(view);
            }
            Err(error) => {
                self.outcome = Some(Err(error));
                event_loop.exit();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let stepped = match (event, &mut self.view) {
            (WindowEvent::Resized(size), Some(view)) => {
                view.renderer.resize(size.into());
                Ok(())
            }
            (WindowEvent::RedrawRequested, _) => self.step(event_loop),
            (WindowEvent::CloseRequested, _) => {
                event_loop.exit();
                Ok(())
            }
            _ => Ok(()),
        };
        if stepped.is_err() {
            self.outcome = Some(stepped);
            event_loop.exit();
        }
    }
}

fn main() -> Result<()> {
    let mut app = App::default();
    EventLoop::new()?.run_app(&mut app)?;
    // Destroys the renderer: the layer may still have something to say.
    drop(app.view);
    if let Some(outcome) = app.outcome {
        outcome?;
    }
    let said = app.log.context("no window came")?.messages();
    ensure!(said.is_empty(), "the validation layer says: {said:#?}");
    if app.drawn < FRAMES || app.shown < MIN_SHOWN {
        bail!("only {} of {FRAMES} frames were drawn, {} shown", app.drawn, app.shown);
    }
    Ok(())
}
