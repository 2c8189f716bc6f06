//! A live view without a window: its pictures go into shared memory.

use std::time::{Duration, Instant};

use busbar_protocol::pictures::{self, Area, PictureWriter};

use super::input::InputState;
use super::{FrameRequests, ViewerServer};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RenderError, ViewError, Viewer, renderer_options};

/// Longest period between frames without commands, since live values change.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
/// Period of steps while nobody sees the picture: short enough for the liveness check.
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
        let (mut last, mut is_published, started) = (None, true, Instant::now());
        let (mut input_state, mut trouble) = (InputState::default(), None);
        loop {
            let Some(requests) = self.apply_commands(&mut viewer) else { return Ok(()) };
            let began = self.iteration.began;
            let FrameRequests { size: wanted, input: done, .. } = requests;
            size = wanted.unwrap_or(size);
            viewer.resize_offscreen(size);
            viewer.set_seen(self.is_visible());
            let mut input = viewer.headless_input(started.elapsed().as_secs_f64());
            input_state.apply(&mut input, done);
            let frame =
                viewer.frame(input).inspect_err(|error| self.report_failure(&error.to_string()))?;
            is_published &= !frame.is_drawn;
            if frame.trouble.is_none() && !frame.is_current {
                // Nobody sees the picture, which is of earlier values: nothing confirms it.
            } else if frame.trouble.is_none() && is_published && last.is_some() {
                // It agrees with the values of this turn as well.
                writer.memory().confirm(self.iteration.began_at_boot_nanos);
            } else if frame.trouble.is_none() {
                match viewer.read_picture() {
                    Ok(picture) => {
                        let true_at = self.iteration.began_at_boot_nanos;
                        let published = publish(&mut writer, &mut last, picture, true_at);
                        is_published = published != PublishOutcome::Failed;
                        if published == PublishOutcome::New {
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

/// Outcome of publishing a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PublishOutcome {
    /// Picture that differs from the one before.
    New,
    /// Picture equal to the one before, which was confirmed.
    Confirmed,
    /// Picture without room in the shared memory.
    Failed,
}

/// Publishes a picture unless it is the one before. It was true at an instant either way.
fn publish(
    writer: &mut PictureWriter,
    last: &mut Option<Picture>,
    mut picture: Picture,
    presented_at: u64,
) -> PublishOutcome {
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
        return PublishOutcome::Confirmed;
    }
    let published = writer.publish(size, changed, presented_at, |room| {
        room.copy_from_slice(&picture.rgba8);
    });
    if let Err(error) = published {
        tracing::error!("a picture of {} x {} pixels: {error}", size[0], size[1]);
        return PublishOutcome::Failed;
    }
    *last = Some(picture);
    PublishOutcome::New
}
