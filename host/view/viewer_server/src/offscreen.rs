//! A live view without a window: its pictures go into shared memory.

use std::time::{Duration, Instant};

use busbar_protocol::pictures::{self, Area, PictureWriter};

use super::input::InputState;
use super::{FrameRequests, ViewerServer};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RenderError, ViewError, Viewer, renderer_options};

/// Longest period between frames without commands, since live values change.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
/// Frame period of an invisible picture: short enough for the liveness check.
const HIDDEN_PERIOD: Duration = Duration::from_millis(200);
/// Frames come no faster than this.
const BUSY_PERIOD: Duration = Duration::from_millis(16);

impl ViewerServer {
    /// Shows a scene until the host program closes the connection.
    ///
    /// # Errors
    /// Errors of a graphics device that cannot be recovered.
    pub fn run_offscreen(mut self, scene: LoadedScene) -> Result<(), ViewError> {
        let Some(memory) = self.memory.clone() else { return Ok(()) };
        let mut writer = PictureWriter::new(memory);
        let mut size = self.size();
        let mut viewer = self.open_viewer(|| open(scene, size))?;
        let (mut last, started) = (None, Instant::now());
        let (mut input_state, mut trouble) = (InputState::default(), None);
        loop {
            let Some(requests) = self.apply_commands(&mut viewer) else { return Ok(()) };
            let began = self.iteration.began;
            let FrameRequests { size: wanted, input: done, .. } = requests;
            size = wanted.unwrap_or(size);
            viewer.resize_offscreen(size);
            let mut input = viewer.headless_input(started.elapsed().as_secs_f64());
            input_state.apply(&mut input, done);
            let frame =
                viewer.frame(input).inspect_err(|error| self.report_failure(&error.to_string()))?;
            if frame.trouble.is_none() {
                match viewer.read_picture() {
                    Ok(picture) => {
                        if publish(
                            &mut writer,
                            &mut last,
                            picture,
                            self.iteration.began_at_boot_nanos,
                        ) {
                            self.report_picture();
                        }
                    }
                    // The device was lost in between: the next frame says so.
                    Err(ViewError::Render(RenderError::NoPicture)) => {}
                    Err(error) => {
                        self.report_failure(&error.to_string());
                        return Err(error);
                    }
                }
            } else if frame.trouble != trouble {
                self.report_trouble(frame.trouble.as_deref().unwrap_or_default());
            }
            trouble = frame.trouble;
            self.report_changes(&mut viewer);
            let period = if self.is_visible() { IDLE_PERIOD } else { HIDDEN_PERIOD };
            let at_least = if self.is_visible() { BUSY_PERIOD } else { HIDDEN_PERIOD };
            std::thread::sleep(BUSY_PERIOD.saturating_sub(began.elapsed()));
            self.channel.wait(began + frame.repaint_after.clamp(at_least, period));
        }
    }
}

fn open(scene: LoadedScene, size: [u32; 2]) -> Result<Viewer, ViewError> {
    let options = renderer_options(&scene);
    Viewer::new_offscreen(scene, options, size)
}

/// Publishes a picture unless it is the one before; whether it did. It was true at an
/// instant either way.
fn publish(
    writer: &mut PictureWriter,
    last: &mut Option<Picture>,
    mut picture: Picture,
    presented_at: u64,
) -> bool {
    let size = [picture.width, picture.height];
    for pixel in picture.rgba8.chunks_exact_mut(pictures::PIXEL_BYTES) {
        pixel.swap(0, 2);
    }
    let same_size = last.as_ref().filter(|last| [last.width, last.height] == size);
    let changed = same_size.map_or(Area { x: 0, y: 0, width: size[0], height: size[1] }, |last| {
        Area::from_difference(&last.rgba8, &picture.rgba8, size[0])
    });
    if changed.is_empty() {
        writer.memory().confirm(presented_at);
        return false;
    }
    let published = writer.publish(size, changed, presented_at, |room| {
        room.copy_from_slice(&picture.rgba8);
    });
    if let Err(error) = published {
        tracing::error!("a picture of {} x {} pixels: {error}", size[0], size[1]);
        return false;
    }
    *last = Some(picture);
    true
}
