//! Subcommand `busbar render`: a picture without a display.

use std::io::Cursor;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Context;
use busbar_viewer::{Picture, RendererOptions, Viewer, renderer_options};
use image::{ImageFormat, RgbaImage};

use crate::arguments::{Pixel, RenderOptions};
use crate::exit_codes::EXIT_INTERNAL;
use crate::{check, output};

/// Frames before a picture with panels or labels, so that they have their sizes, and before one
/// with timing, so that it has a median.
const SETTLING_FRAMES: u32 = 3;

pub(crate) fn run(options: &RenderOptions) -> anyhow::Result<ExitCode> {
    let scene = check::load(&options.config)?;
    let size = options.size.map_or(scene.size(), |size| size.0);
    let renderer = RendererOptions { validation: options.validation, ..renderer_options(&scene) };
    let mut viewer = Viewer::new_headless(scene, renderer, size)?;
    if let Some(camera) = &options.camera {
        viewer.use_camera(camera)?;
    }
    if let Some(theta) = options.theta {
        viewer.set_theta(theta);
    }
    viewer.set_wireframe(options.wireframe);

    let is_timed = options.stats.is_some();
    draw(&mut viewer, options.seconds, is_timed)?;
    if let Some(Pixel(pixel)) = options.pick {
        let picked = viewer.pick(pixel)?;
        output::result(picked.as_deref().unwrap_or("nothing"));
        draw(&mut viewer, Duration::ZERO, is_timed)?;
    }
    let stats = viewer.stats();
    output::write_file(&options.out, &png(viewer.read_picture()?)?)?;
    if let Some(path) = &options.stats {
        output::write_json(path, &stats)?;
    }
    Ok(verdict(&stats.validation_messages))
}

/// Draws for as long as asked, and until another frame would show the same.
fn draw(viewer: &mut Viewer, wanted: Duration, is_timed: bool) -> anyhow::Result<()> {
    let start = Instant::now();
    let mut frames = 0;
    let is_done = |viewer: &Viewer, frames| {
        let settles = is_timed || viewer.has_content_over_scene();
        frames >= if settles { SETTLING_FRAMES } else { 1 }
    };
    while !is_done(viewer, frames) || start.elapsed() < wanted {
        let input = viewer.headless_input(start.elapsed().as_secs_f64());
        viewer.frame(input)?;
        frames += 1;
    }
    Ok(())
}

/// Returns the exit code: a silent validation layer is success, any message a fault of Busbar.
pub(crate) fn verdict(validation_messages: &[String]) -> ExitCode {
    for message in validation_messages {
        output::line(&format!("validation: {message}"));
    }
    if validation_messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INTERNAL) }
}

fn png(picture: Picture) -> anyhow::Result<Vec<u8>> {
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.rgba8)
        .context("the picture has another size than it says")?;
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
