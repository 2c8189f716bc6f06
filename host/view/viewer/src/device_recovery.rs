//! Recovery from graphics failures: out of memory, device lost.
//!
//! All device work goes through [`DeviceRecovery::run`]. When memory runs out, caches are freed and
//! the work is tried once more. A lost device is recreated and all models are uploaded again from
//! memory. The number of tries is limited, with growing delays.

use std::time::{Duration, Instant};

use busbar_renderer::{RecoveryAction, RenderError, Renderer};

use crate::{ViewError, uploaded_models};
use busbar_scene_loader::LoadedScene;

/// Tries at a device, unless it worked for [`STABLE_TIME`] in between.
pub(crate) const MAX_TRIES: u32 = 8;
/// Delay before the third try; it doubles with each further try. The first two follow at once.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest delay between tries.
const MAX_DELAY: Duration = Duration::from_secs(5);
/// A device that worked for so long is as good as a new one.
const STABLE_TIME: Duration = Duration::from_secs(60);
/// The longest that a window shows an old picture for want of memory: then all
/// on the device is made anew.
const MAX_FROZEN: Duration = Duration::from_secs(10);

/// State of the graphics device and of its recovery.
pub(crate) struct DeviceRecovery {
    /// True if work waits for the device; otherwise it is skipped meanwhile.
    waits: bool,
    state: DeviceState,
    /// Tries since the device last worked for [`STABLE_TIME`].
    tries: u32,
    /// Instant at which the device was last created.
    made_at: Instant,
    /// Instant since which memory is lacking for frames.
    frozen_since: Option<Instant>,
    /// Devices that were lost and replaced.
    pub(crate) replaced: u64,
    /// Frames that were left out.
    pub(crate) skipped: u64,
}

enum DeviceState {
    Works,
    Lost { cause: String, due: Instant },
}

impl DeviceRecovery {
    /// Opens a renderer and uploads the models of a scene.
    ///
    /// # Errors
    /// An error that no further try can resolve, or that of the last of [`MAX_TRIES`].
    pub(crate) fn start(
        scene: &LoadedScene,
        waits: bool,
        open: impl Fn() -> Result<Renderer, RenderError>,
    ) -> Result<(Self, Renderer), ViewError> {
        let mut recovery = Self {
            // Until there is something to show.
            waits: true,
            state: DeviceState::Works,
            tries: 0,
            made_at: Instant::now(),
            frozen_since: None,
            replaced: 0,
            skipped: 0,
        };
        let mut renderer = loop {
            match open() {
                Ok(renderer) => break renderer,
                Err(error) if error.recovery_action() == RecoveryAction::None => {
                    return Err(error.into());
                }
                Err(error) => recovery.note_loss(error)?,
            }
            recovery.wait();
            recovery.tries += 1;
        };
        recovery.state = DeviceState::Works;
        let upload = |renderer: &mut Renderer| uploaded_models::upload(scene, renderer);
        recovery.run(&mut renderer, scene, upload)?;
        recovery.waits = waits;
        Ok((recovery, renderer))
    }

    /// Runs work on the device, and retries it after recovery. Returns `None` if the device is
    /// absent and the work does not wait.
    ///
    /// # Errors
    /// An error without recovery, or one that persists after [`MAX_TRIES`].
    pub(crate) fn run<T>(
        &mut self,
        renderer: &mut Renderer,
        scene: &LoadedScene,
        mut work: impl FnMut(&mut Renderer) -> Result<T, RenderError>,
    ) -> Result<Option<T>, ViewError> {
        let mut has_freed = false;
        loop {
            if !self.restore_device(renderer, scene)? {
                self.skipped += 1;
                return Ok(None);
            }
            let error = match work(renderer) {
                Ok(done) => {
                    self.resume_frames();
                    return Ok(Some(done));
                }
                Err(error) => error,
            };
            match error.recovery_action() {
                RecoveryAction::None => return Err(error.into()),
                RecoveryAction::RecreateDevice => self.note_loss(error)?,
                RecoveryAction::FreeMemory if !has_freed => {
                    has_freed = true;
                    tracing::warn!("{error}; what can be had again is given back");
                    if let Err(error) = renderer.free_memory() {
                        self.note_loss(error)?;
                    }
                }
                RecoveryAction::FreeMemory => {
                    if self.waits {
                        return Err(error.into());
                    }
                    self.skip_frame(error)?;
                    return Ok(None);
                }
            }
        }
    }

    /// Makes the device anew, for other options. After an error there is none.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub(crate) fn renew(
        &mut self,
        renderer: &mut Renderer,
        scene: &LoadedScene,
    ) -> Result<(), RenderError> {
        let renewed = renderer.renew().and_then(|()| uploaded_models::upload(scene, renderer));
        self.made_at = Instant::now();
        renewed.map(drop)
    }

    /// Notes that there is no device, for the next work to make one.
    pub(crate) fn mark_lost(&mut self, cause: RenderError) -> Result<(), ViewError> {
        self.note_loss(cause)
    }

    /// Returns the message for the operator while the picture is frozen.
    pub(crate) fn frozen_message(&self) -> Option<String> {
        match &self.state {
            DeviceState::Lost { cause, .. } => {
                Some(format!("picture frozen, graphics restart, try {}: {cause}", self.tries + 1))
            }
            DeviceState::Works => {
                self.frozen_since.map(|_| "picture frozen: no graphics memory".to_owned())
            }
        }
    }

    /// Returns the time until the next try to create a lost device; none while it works.
    pub(crate) fn next_try(&self) -> Option<Duration> {
        match &self.state {
            DeviceState::Works => None,
            DeviceState::Lost { due, .. } => Some(due.saturating_duration_since(Instant::now())),
        }
    }

    /// Leaves a frame out; the picture before it stays.
    fn skip_frame(&mut self, error: RenderError) -> Result<(), ViewError> {
        self.skipped += 1;
        let since = *self.frozen_since.get_or_insert_with(|| {
            tracing::error!("{error}; frames are left out until there is memory again");
            Instant::now()
        });
        if since.elapsed() >= MAX_FROZEN {
            self.frozen_since = None;
            self.note_loss(error)?;
        }
        Ok(())
    }

    fn resume_frames(&mut self) {
        if let Some(since) = self.frozen_since.take() {
            tracing::info!("there is memory again after {:.1} s", since.elapsed().as_secs_f64());
        }
    }

    /// Notes that the device is lost, and when the next may be tried.
    fn note_loss(&mut self, error: RenderError) -> Result<(), ViewError> {
        if self.made_at.elapsed() >= STABLE_TIME {
            self.tries = 0;
        }
        if self.tries >= MAX_TRIES {
            return Err(ViewError::NotRecovered { tries: self.tries, cause: error });
        }
        let delay = delay_before(self.tries);
        tracing::warn!(
            "{error}; it is started anew in {} ms (try {} of {MAX_TRIES})",
            delay.as_millis(),
            self.tries + 1
        );
        self.state = DeviceState::Lost { cause: error.to_string(), due: Instant::now() + delay };
        Ok(())
    }

    fn wait(&self) {
        std::thread::sleep(self.next_try().unwrap_or_default());
    }

    /// Makes a new device where the last is lost; false where that is not yet.
    fn restore_device(
        &mut self,
        renderer: &mut Renderer,
        scene: &LoadedScene,
    ) -> Result<bool, ViewError> {
        while let Some(left) = self.next_try() {
            if !left.is_zero() && !self.waits {
                return Ok(false);
            }
            self.wait();
            self.tries += 1;
            let started = Instant::now();
            let renewed = renderer.renew().and_then(|()| uploaded_models::upload(scene, renderer));
            match renewed {
                Ok(count) => {
                    self.state = DeviceState::Works;
                    self.made_at = Instant::now();
                    self.replaced += 1;
                    let millis = started.elapsed().as_millis();
                    let device = renderer.device_name();
                    tracing::info!("{device} works: {count} models uploaded again in {millis} ms");
                }
                Err(error) => self.note_loss(error)?,
            }
        }
        Ok(true)
    }
}

/// Returns the delay before a try, by the number of tries so far.
fn delay_before(tries: u32) -> Duration {
    match tries {
        0 | 1 => Duration::ZERO,
        tries => FIRST_DELAY.saturating_mul(1 << (tries - 2).min(16)).min(MAX_DELAY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_grow_up_to_their_limit() {
        let millis: Vec<_> = (0..MAX_TRIES).map(|n| delay_before(n).as_millis()).collect();
        assert_eq!(millis, [0, 0, 100, 200, 400, 800, 1600, 3200]);
        assert_eq!(delay_before(u32::MAX), MAX_DELAY);
    }
}
