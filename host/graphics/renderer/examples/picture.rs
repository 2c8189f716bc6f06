//! Draws a small switchyard into PNG files: `picture FOLDER`.

mod yard;

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use busbar_renderer::{CameraView, Frame, Renderer, RendererOptions};
use glam::Vec3;

const SIZE: [u32; 2] = [1280, 720];

fn main() -> Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).context("usage: picture FOLDER")?);
    let options = RendererOptions { validation: true, ..Default::default() };
    let mut renderer = Renderer::headless(options, SIZE)?;
    let instances = yard::build(&mut renderer)?;
    let views = [
        ("front.png", Vec3::new(4.5, 3.4, 6.5), false),
        ("back.png", Vec3::new(-5.0, 2.2, -6.0), false),
        ("wireframe.png", Vec3::new(4.5, 3.4, 6.5), true),
    ];
    for (name, eye, wireframe) in views {
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let target = Vec3::new(0.0, 1.9, 0.0);
        let camera = CameraView::look_at(eye, target, Vec3::Y, 0.7, aspect, 0.05);
        let background = [0.68, 0.70, 0.72];
        let frame = Frame { wireframe, background, ..Frame::new(camera, &instances) };
        renderer.draw(&frame)?;
        let picture = renderer.read_picture()?;
        let path = folder.join(name);
        image::save_buffer(
            &path,
            &picture.rgba8,
            picture.width,
            picture.height,
            image::ColorType::Rgba8,
        )
        .with_context(|| format!("writing {}", path.display()))?;
    }
    let said = renderer.validation_messages();
    ensure!(said.is_empty(), "the validation layer says: {said:#?}");
    Ok(())
}
