//! The resolution in motion on machines of several kinds, without a device.

use super::*;

const SIZE: [u32; 2] = [1600, 900];
const TARGET: f64 = 33.3;

/// A machine: what a frame takes whatever its resolution, and what its pixels take at full
/// resolution, milliseconds.
#[derive(Clone, Copy)]
struct Machine {
    fixed: f64,
    pixels: f64,
}

impl Machine {
    fn frame(self, resolution: f32) -> FrameStats {
        let millis = self.fixed + self.pixels * f64::from(resolution * resolution);
        FrameStats { gpu_millis: Some(millis), draw_calls: 1, ..FrameStats::default() }
    }
}

struct View {
    motion: MotionResolution,
    machine: Machine,
    size: [u32; 2],
    seconds: f64,
    /// Frames whose times are still to come, as the device is behind.
    late: Vec<FrameStats>,
}

impl View {
    fn new(machine: Machine) -> Self {
        let motion = MotionResolution::new(Some(TARGET));
        Self { motion, machine, size: SIZE, seconds: 0.0, late: Vec::new() }
    }

    /// Draws a frame; returns its resolution and time in milliseconds.
    fn draw(&mut self, has_moved: bool) -> (f32, f64) {
        self.motion.advance(self.seconds, self.size, has_moved);
        let resolution = self.motion.resolution();
        let frame = self.machine.frame(resolution);
        let millis = frame.gpu_millis.expect("a machine measures");
        self.late.push(frame);
        // The device finishes a frame while the next one is prepared.
        let known = if self.late.len() > 2 { self.late.remove(0) } else { self.late[0] };
        self.motion.note_frame(&known);
        self.seconds += millis / 1e3;
        (resolution, millis)
    }

    fn drag(&mut self, frames: usize) {
        for _ in 0..frames {
            self.draw(true);
        }
    }

    fn rest(&mut self, frames: usize) {
        (0..frames).for_each(|_| {
            self.draw(false);
            self.seconds += 0.1;
        });
    }
}

#[test]
fn a_fast_machine_never_leaves_full_resolution() {
    let mut view = View::new(Machine { fixed: 5.0, pixels: 20.0 });
    assert!((0..500).all(|_| view.draw(true).0 == 1.0));
}

#[test]
fn frames_in_motion_keep_their_time_where_pixels_take_it() {
    for pixels in [40.0, 60.0, 90.0] {
        let mut view = View::new(Machine { fixed: 8.0, pixels });
        view.drag(20);
        for _ in 0..500 {
            let (_, millis) = view.draw(true);
            assert!(millis <= TARGET * OVERRUN_SHARE, "{millis} with {pixels}");
        }
    }
}

#[test]
fn the_resolution_does_not_swing() {
    for pixels in (0..400).step_by(7) {
        let mut view = View::new(Machine { fixed: 6.0, pixels: f64::from(pixels) });
        view.drag(30);
        let first = view.draw(true).0;
        assert!((0..300).all(|_| view.draw(true).0 == first), "{pixels}");
    }
}

#[test]
fn the_first_frame_in_motion_is_already_quick() {
    let mut view = View::new(Machine { fixed: 8.0, pixels: 90.0 });
    view.rest(8);
    assert_eq!(view.draw(true).0, MIN_SCENE_RESOLUTION);
}

#[test]
fn a_camera_at_rest_is_seen_in_full_soon() {
    let mut view = View::new(Machine { fixed: 8.0, pixels: 90.0 });
    view.drag(20);
    let moved = view.seconds;
    let wait = view.motion.full_in().expect("the frame is reduced");
    assert!(wait <= REST_SECONDS);
    view.seconds = moved + wait;
    assert_eq!(view.draw(false).0, 1.0);
    assert_eq!(view.motion.full_in(), None);
}

#[test]
fn small_pictures_and_views_without_a_target_stay_in_full() {
    let mut view = View::new(Machine { fixed: 8.0, pixels: 90.0 });
    view.drag(20);
    view.size = [320, 180];
    assert_eq!(view.draw(true).0, 1.0);
    view.size = SIZE;
    view.motion.set_target(None);
    (0..20).for_each(|_| assert_eq!(view.draw(true).0, 1.0));
}
