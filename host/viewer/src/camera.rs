//! The operator's camera: it orbits a target.

use busbar_config::CameraConfig;
use busbar_geometry::Bounds;
use busbar_renderer::CameraView;
use busbar_ui::Command;
use egui::{Pos2, Rect, Vec2, pos2};
use glam::{Mat4, Vec3, Vec4, vec3};

use crate::load::LoadedScene;

/// Radians a point of drag.
const ORBIT_SPEED: f32 = 0.006;
/// As close as the poles may be approached, radians.
const MAX_PITCH: f32 = 1.55;
/// Metres.
const DISTANCE_RANGE: std::ops::RangeInclusive<f32> = 0.2..=100_000.0;
const DEFAULT_FOV_DEGREES: f32 = 45.0;
/// A viewport narrower than this sees as much sideways as this one would, so
/// that panels do not crop what a configured camera frames.
const FULL_ASPECT: f32 = 16.0 / 9.0;
/// Room left around what is framed.
const FRAME_MARGIN: f32 = 1.12;

/// A camera that looks at a target from a distance and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OrbitCamera {
    target: Vec3,
    distance: f32,
    /// About y, radians; 0 looks along -z.
    yaw: f32,
    /// Above the horizon, radians.
    pitch: f32,
    fov_y: f32,
}

/// World to screen, for labels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    clip_from_world: Mat4,
    screen: Rect,
}

impl OrbitCamera {
    /// A camera as configured.
    pub(crate) fn from_config(config: &CameraConfig) -> Self {
        let fov_y = config.fov_degrees.to_radians();
        Self::looking(config.eye.into(), config.target.into(), fov_y)
    }

    /// A camera at `eye` that looks at `target`, with the angle of this one.
    pub(crate) fn moved_to(&self, eye: Vec3, target: Vec3) -> Self {
        Self::looking(eye, target, self.fov_y)
    }

    fn looking(eye: Vec3, target: Vec3, fov_y: f32) -> Self {
        let offset = eye - target;
        let distance = offset.length().max(*DISTANCE_RANGE.start());
        Self {
            target,
            distance,
            yaw: offset.x.atan2(offset.z),
            pitch: (offset.y / distance).clamp(-1.0, 1.0).asin(),
            fov_y,
        }
    }

    /// Where it stands, metres.
    pub(crate) fn eye(&self) -> Vec3 {
        self.target + self.direction() * self.distance
    }

    /// A camera that has all of a box in view, from above a corner.
    pub(crate) fn framing(bounds: Option<Bounds>) -> Self {
        let mut camera = Self {
            target: Vec3::ZERO,
            distance: 10.0,
            yaw: 0.6,
            pitch: 0.35,
            fov_y: DEFAULT_FOV_DEGREES.to_radians(),
        };
        camera.frame(bounds);
        camera
    }

    /// Moves so that a box is in view, keeping the direction.
    fn frame(&mut self, bounds: Option<Bounds>) {
        if let Some(bounds) = bounds {
            self.target = bounds.center();
            let (back, right, up) = self.axes();
            let tan_y = (self.fov_y * 0.5).tan();
            let tan_x = tan_y * FULL_ASPECT;
            // As far as the corner that is outermost from here.
            let needed = bounds.corners().map(|corner| {
                let offset = corner - self.target;
                let sideways = (offset.dot(right).abs() / tan_x).max(offset.dot(up).abs() / tan_y);
                sideways * FRAME_MARGIN + offset.dot(back)
            });
            let distance = needed.into_iter().fold(0.0, f32::max);
            self.distance = distance.clamp(*DISTANCE_RANGE.start(), *DISTANCE_RANGE.end());
        }
    }

    fn orbit(&mut self, drag: Vec2) {
        self.yaw -= drag.x * ORBIT_SPEED;
        self.pitch = (self.pitch + drag.y * ORBIT_SPEED).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// Moves the target with the pointer: what is under it stays under it.
    fn pan(&mut self, drag: Vec2, viewport: Vec2) {
        let half_angle = self.fov_y(viewport.x / viewport.y.max(1.0)) * 0.5;
        let metres_per_point = 2.0 * self.distance * half_angle.tan() / viewport.y.max(1.0);
        let (_, right, up) = self.axes();
        self.target += (up * drag.y - right * drag.x) * metres_per_point;
    }

    fn zoom(&mut self, factor: f32) {
        let distance = self.distance * factor;
        self.distance = distance.clamp(*DISTANCE_RANGE.start(), *DISTANCE_RANGE.end());
    }

    /// The view whose middle is that of `viewport`, in a picture as large as
    /// `screen`; both in points.
    pub(crate) fn view(&self, viewport: Rect, screen: Rect) -> CameraView {
        let eye = self.eye();
        let viewport = if viewport.is_positive() { viewport } else { screen };
        let aspect = viewport.width() / viewport.height().max(1.0);
        let near = (self.distance * 0.005).clamp(0.01, 1.0);
        let fov_y = self.fov_y(aspect);
        let mut view = CameraView::look_at(eye, self.target, Vec3::Y, fov_y, aspect, near);
        view.projection = into_viewport(viewport, screen) * view.projection;
        view
    }

    /// What a pixel covers at least of what is a metre away, metres, in a viewport of
    /// this size in pixels: at its corners, where things are farther than they are deep.
    pub(crate) fn pixel(&self, viewport: Vec2) -> f32 {
        let aspect = viewport.x / viewport.y.max(1.0);
        let tan_y = (self.fov_y(aspect) * 0.5).tan();
        let tan_diagonal = tan_y * aspect.hypot(1.0);
        2.0 * tan_y / viewport.y.max(1.0) / tan_diagonal.hypot(1.0)
    }

    /// The vertical angle in a viewport of this aspect, radians.
    fn fov_y(&self, aspect: f32) -> f32 {
        let widening = (FULL_ASPECT / aspect.max(0.1)).max(1.0);
        2.0 * ((self.fov_y * 0.5).tan() * widening).atan()
    }

    /// Towards the eye, to the right, and up, as the camera sees them.
    fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let back = self.direction();
        let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
        (back, right, back.cross(right))
    }

    /// From the target to the eye.
    fn direction(&self) -> Vec3 {
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        vec3(sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch)
    }
}

/// Clip space of a viewport to clip space of the screen that it is part of.
fn into_viewport(viewport: Rect, screen: Rect) -> Mat4 {
    let scale = viewport.size() / screen.size();
    let shift = (viewport.center() - screen.center()) * 2.0 / screen.size();
    let mut matrix = Mat4::from_scale(vec3(scale.x, scale.y, 1.0));
    matrix.w_axis = Vec4::new(shift.x, shift.y, 0.0, 1.0);
    matrix
}

impl OrbitCamera {
    /// Moves the camera as the commands say.
    pub(crate) fn steer(&mut self, commands: &[Command], viewport: Rect, scene: &LoadedScene) {
        for command in commands {
            match command {
                Command::Orbit(drag) => self.orbit(*drag),
                Command::Pan(drag) => self.pan(*drag, viewport.size()),
                Command::Zoom(factor) => self.zoom(*factor),
                Command::FitAll => self.frame(scene.graph.bounds()),
                Command::Focus(id) => {
                    let node = scene.graph.find(id);
                    self.frame(node.and_then(|node| scene.graph.node(node).bounds()));
                }
                Command::UseCamera(name) => {
                    if let Some(config) = scene.config.cameras.get(name) {
                        *self = Self::from_config(config);
                    }
                }
                Command::SetTheta { .. }
                | Command::UsePolicy { .. }
                | Command::SetThetaScale(_)
                | Command::SetWireframe(_)
                | Command::StartPlugin(_)
                | Command::Pick(_) => {}
            }
        }
    }
}

impl Projection {
    pub(crate) fn new(view: &CameraView, screen: Rect) -> Self {
        Self { clip_from_world: view.clip_from_world(), screen }
    }

    /// Where a world point is on the screen, points; `None` behind the camera.
    pub(crate) fn to_screen(self, world: Vec3) -> Option<Pos2> {
        let clip = self.clip_from_world * world.extend(1.0);
        if clip.w <= 1e-6 {
            return None;
        }
        let half = self.screen.size() * 0.5;
        let center = self.screen.center();
        Some(pos2(center.x + clip.x / clip.w * half.x, center.y + clip.y / clip.w * half.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn screen() -> Rect {
        Rect::from_min_size(Pos2::ZERO, egui::vec2(800.0, 600.0))
    }

    #[test]
    fn a_configured_eye_and_target_come_back() {
        let config = CameraConfig {
            eye: [12.0, 6.0, 14.0],
            target: [0.0, 3.0, 0.0],
            fov_degrees: 45.0,
            pointer: String::new(),
        };
        let camera = OrbitCamera::from_config(&config);
        let eye = camera.view(screen(), screen()).eye;
        assert!((eye - Vec3::from(config.eye)).length() < 1e-4);
    }

    #[test]
    fn the_target_is_in_the_middle_of_the_viewport() {
        let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(3.0) };
        let camera = OrbitCamera::framing(Some(bounds));
        let viewport = Rect::from_min_max(pos2(400.0, 0.0), pos2(800.0, 580.0));
        let projection = Projection::new(&camera.view(viewport, screen()), screen());
        let middle = projection.to_screen(Vec3::splat(1.0)).unwrap();
        assert!(middle.distance(viewport.center()) < 0.01, "{middle:?}");
        for corner in bounds.corners() {
            assert!(viewport.contains(projection.to_screen(corner).unwrap()));
        }
    }

    #[test]
    fn nothing_a_pixel_large_is_seen_larger_than_that() {
        let camera = OrbitCamera::framing(None);
        let (viewport, view) = (screen(), camera.view(screen(), screen()));
        let projection = Projection::new(&view, viewport);
        let (back, right, up) = camera.axes();
        for (x, y) in [(0.0, 0.0), (0.7, 0.0), (0.7, 0.4), (-0.5, -0.35)] {
            let at = view.eye + 20.0 * (right * x + up * y - back).normalize();
            let size = 20.0 * camera.pixel(viewport.size());
            let [from, to] = [at, at + right * size].map(|p| projection.to_screen(p).unwrap());
            let apart = from.distance(to);
            assert!(apart <= 1.0 + 1e-3 && apart > 0.5, "{apart} at {x}, {y}");
        }
    }

    #[test]
    fn panning_keeps_the_point_under_the_pointer() {
        let mut camera = OrbitCamera::framing(None);
        let at = |camera: &OrbitCamera| {
            Projection::new(&camera.view(screen(), screen()), screen()).to_screen(Vec3::ZERO)
        };
        let before = at(&camera).unwrap();
        camera.pan(egui::vec2(30.0, -20.0), screen().size());
        let moved = at(&camera).unwrap() - before;
        assert!((moved - egui::vec2(30.0, -20.0)).length() < 0.5, "{moved:?}");
    }

    #[test]
    fn what_is_behind_the_camera_has_no_place() {
        let camera = OrbitCamera::framing(None);
        let view = camera.view(screen(), screen());
        let behind = view.eye + camera.direction();
        assert_eq!(Projection::new(&view, screen()).to_screen(behind), None);
    }
}
