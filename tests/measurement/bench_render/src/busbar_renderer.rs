//! Busbar as a renderer of the bench, in a process of its own.

use std::fs;
use std::io::{BufRead, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Quality, RendererOptions, Viewer};
use serde_json::json;

use crate::camera::{Camera, FOV_DEGREES};
use crate::render_protocol::{RenderReply, RenderRequest};

/// Serves requests until the input ends.
pub(crate) fn serve() -> Result<()> {
    // As the program does.
    busbar_process_heap::configure_allocator();
    let mut ours = BusbarRenderer { viewer: None, seconds: 0.0 };
    for line in stdin().lock().lines() {
        let answer = ours.answer(serde_json::from_str(&line?)?)?;
        let mut out = stdout().lock();
        writeln!(out, "{}", serde_json::to_string(&answer)?)?;
        out.flush()?;
    }
    Ok(())
}

struct BusbarRenderer {
    viewer: Option<Viewer>,
    /// Time of the views' clock, seconds.
    seconds: f64,
}

impl BusbarRenderer {
    fn answer(&mut self, wanted: RenderRequest) -> Result<RenderReply> {
        match wanted {
            RenderRequest::Load { path, size, samples } => {
                let scene = LoadedScene::load(&configuration_of(&path)?, &|_, _, _| ())?;
                let options =
                    RendererOptions { quality: Quality::Low, samples, ..Default::default() };
                self.viewer = Some(Viewer::new_headless(scene, options, size)?);
                Ok(RenderReply::default())
            }
            RenderRequest::Frames { cameras } => {
                let mut answer = RenderReply::default();
                for camera in &cameras {
                    let start = Instant::now();
                    let viewer = self.draw(camera)?;
                    answer.millis.push(start.elapsed().as_secs_f64() * 1e3);
                    let stats = viewer.stats();
                    answer.cpu_millis.push(stats.cpu_ms);
                    answer.hide_millis.push(stats.hide_ms);
                    answer.triangles = stats.triangles;
                }
                Ok(answer)
            }
            RenderRequest::Picture { camera, path } => {
                let picture = self.draw(&camera)?.read_picture()?;
                let [width, height] = [picture.width, picture.height];
                image::RgbaImage::from_raw(width, height, picture.rgba8)
                    .context("a picture of another size")?
                    .save(path)?;
                Ok(RenderReply::default())
            }
        }
    }

    fn draw(&mut self, camera: &Camera) -> Result<&mut Viewer> {
        let viewer = self.viewer.as_mut().context("nothing is loaded yet")?;
        if camera.fov_degrees != FOV_DEGREES {
            bail!("a view's angle is that of its configuration, {FOV_DEGREES} degrees");
        }
        viewer.look_from(camera.eye, camera.target);
        self.seconds += 1.0 / 60.0;
        viewer.frame(viewer.headless_input(self.seconds))?;
        Ok(viewer)
    }
}

/// Writes a configuration that shows a model alone, beside it; a path of a configuration is
/// returned unchanged.
fn configuration_of(path: &Path) -> Result<PathBuf> {
    if path.extension().is_some_and(|extension| extension == "json") {
        return Ok(path.to_owned());
    }
    let file = path.file_name().and_then(|name| name.to_str()).context("a file without a name")?;
    let configuration = path.with_extension("json");
    fs::write(
        &configuration,
        json!({
            "version": 1,
            "models": { "model": { "file": file } },
            "scene": [{ "id": "model", "model": "model" }],
        })
        .to_string(),
    )?;
    Ok(configuration)
}
