//! Camera of a view: pose and projection, navigation by the operator's commands, and paths between
//! poses that keep clear of the equipment.
//!
//! [`Navigator`] owns the camera of a view. [`Camera::view`] gives the renderer its matrices, and
//! [`Projection`] leads from the world to the screen.
//!
//! Invariant: a camera knows bounds of equipment, and nothing of tags, plugins or panels' contents.
#![doc = include_str!("../DESIGN.md")]

mod collision_free_path;
mod navigator;
mod transition;
mod unoccluded_view;

use busbar_config::{CameraConfig, ProjectionConfig};
use busbar_geometry::Bounds;
use busbar_lod::PixelSize;
use busbar_renderer::CameraView;
use busbar_scene::SceneGraph;
use egui::{Pos2, Rect, Vec2, pos2};
use glam::{Mat4, Vec3, Vec4, vec3};

pub use navigator::{NavigationContext, Navigator};

/// Radians a point of drag.
const ORBIT_SPEED: f32 = 0.006;
/// Largest pitch by hand, just below the poles, radians.
const MAX_PITCH: f32 = 1.55;
/// Permitted distances between eye and target, metres.
const DISTANCE_RANGE: std::ops::RangeInclusive<f32> = 0.2..=100_000.0;
const DEFAULT_FOV_DEGREES: f32 = 45.0;
/// A viewport narrower than this sees as much sideways as this one would, so
/// that panels do not crop what a configured camera frames.
const FULL_ASPECT: f32 = 16.0 / 9.0;
/// Margin factor around framed bounds.
const FRAME_MARGIN: f32 = 1.12;

/// Projection of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProjectionMode {
    /// Perspective projection by the angle of view.
    #[default]
    Perspective,
    /// Orthographic projection at the scale that a perspective view has at the target.
    Orthographic,
}

/// A camera that looks at a target from a distance and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    target: Vec3,
    distance: f32,
    /// About y, radians; 0 looks along -z.
    yaw: f32,
    /// Above the horizon, radians.
    pitch: f32,
    fov_y: f32,
    projection_mode: ProjectionMode,
}

/// World to screen, for labels.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    clip_from_world: Mat4,
    screen: Rect,
}

impl Camera {
    /// A camera as configured, in a scene. Where an orthographic one has a height, it stands as far
    /// from the target as a perspective one that sees so much there.
    pub fn from_config(config: &CameraConfig, graph: &SceneGraph) -> Self {
        let fov_y = config.fov_degrees.to_radians();
        let [eye, target] = [config.eye, config.target].map(|point| graph.point_from_world(point));
        let mut camera = Self::look_at(eye, target, fov_y);
        if let ProjectionConfig::Orthographic { height } = config.projection {
            camera.projection_mode = ProjectionMode::Orthographic;
            if let Some(height) = height {
                camera.distance = height * 0.5 / (fov_y * 0.5).tan();
            }
        }
        camera
    }

    /// A camera at `eye` that looks at `target`, with the angle of this one.
    pub fn moved_to(&self, eye: Vec3, target: Vec3) -> Self {
        Self::look_at(eye, target, self.fov_y)
    }

    /// Returns the camera with orthographic or perspective projection.
    pub fn with_projection(self, is_orthographic: bool) -> Self {
        let projection_mode = if is_orthographic {
            ProjectionMode::Orthographic
        } else {
            ProjectionMode::Perspective
        };
        Self { projection_mode, ..self }
    }

    /// Returns the target position, metres.
    pub fn target(&self) -> Vec3 {
        self.target
    }

    fn look_at(eye: Vec3, target: Vec3, fov_y: f32) -> Self {
        let offset = eye - target;
        let distance = offset.length().max(*DISTANCE_RANGE.start());
        Self {
            target,
            distance,
            yaw: offset.x.atan2(offset.z),
            pitch: (offset.y / distance).clamp(-1.0, 1.0).asin(),
            fov_y,
            projection_mode: ProjectionMode::Perspective,
        }
    }

    /// Returns the eye position, metres.
    pub fn eye(&self) -> Vec3 {
        self.target + self.direction() * self.distance
    }

    /// Returns the viewing direction, a unit vector.
    pub fn forward(&self) -> Vec3 {
        -self.direction()
    }

    /// A camera that has all of a box in view, from above a corner.
    pub fn framing(bounds: Option<Bounds>) -> Self {
        let mut camera = Self {
            target: Vec3::ZERO,
            distance: 10.0,
            yaw: 0.6,
            pitch: 0.35,
            fov_y: DEFAULT_FOV_DEGREES.to_radians(),
            projection_mode: ProjectionMode::Perspective,
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
                let nearer = match self.projection_mode {
                    ProjectionMode::Perspective => offset.dot(back),
                    ProjectionMode::Orthographic => 0.0,
                };
                sideways * FRAME_MARGIN + nearer
            });
            self.set_distance(needed.into_iter().fold(0.0, f32::max));
        }
    }

    fn set_distance(&mut self, distance: f32) {
        self.distance = distance.clamp(*DISTANCE_RANGE.start(), *DISTANCE_RANGE.end());
    }

    fn orbit(&mut self, drag: Vec2) {
        self.yaw -= drag.x * ORBIT_SPEED;
        self.pitch = (self.pitch + drag.y * ORBIT_SPEED).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// Turns the head: the eye stays where it is.
    fn look_around(&mut self, drag: Vec2) {
        let eye = self.eye();
        // What is seen follows the hand, as in an orbit.
        self.orbit(drag);
        self.move_eye_to(eye);
    }

    fn move_eye_to(&mut self, eye: Vec3) {
        self.target = eye - self.direction() * self.distance;
    }

    /// Moves the target by a drag, so that the point under the pointer stays there.
    fn pan(&mut self, drag: Vec2, viewport: Vec2) {
        let half_angle = self.fov_y(viewport.x / viewport.y.max(1.0)) * 0.5;
        let metres_per_point = 2.0 * self.distance * half_angle.tan() / viewport.y.max(1.0);
        let (_, right, up) = self.axes();
        self.target += (up * drag.y - right * drag.x) * metres_per_point;
    }

    fn zoom(&mut self, factor: f32) {
        self.set_distance(self.distance * factor);
    }

    /// The view whose middle is that of `viewport`, in a picture as large as
    /// `screen`; both in points. `around` holds what an orthographic view must show.
    pub fn view(&self, viewport: Rect, screen: Rect, around: Option<Bounds>) -> CameraView {
        let eye = self.eye();
        let viewport = if viewport.is_positive() { viewport } else { screen };
        let aspect = viewport.width() / viewport.height().max(1.0);
        let fov_y = self.fov_y(aspect);
        let (_, _, up) = self.axes();
        let mut view = match self.projection_mode {
            ProjectionMode::Perspective => {
                let near = (self.distance * 0.005).clamp(0.01, 1.0);
                // Up is only needed where the camera looks along it.
                let up = if self.pitch.abs() > MAX_PITCH { up } else { Vec3::Y };
                CameraView::look_at(eye, self.target, up, fov_y, aspect, near)
            }
            ProjectionMode::Orthographic => {
                let height = 2.0 * self.distance * (fov_y * 0.5).tan();
                let farthest = around
                    .map_or(0.0, |bounds| self.target.distance(bounds.center()) + bounds.radius());
                let reach = farthest * 1.01 + 1.0;
                CameraView::orthographic(eye, self.target, up, height, aspect, reach)
            }
        };
        view.projection = into_viewport(viewport, screen) * view.projection;
        view
    }

    /// Returns the size of a pixel in a viewport of this size in pixels.
    pub fn pixel_size(&self, viewport: Vec2) -> PixelSize {
        let aspect = viewport.x / viewport.y.max(1.0);
        let tan_y = (self.fov_y(aspect) * 0.5).tan();
        let in_the_middle = 2.0 * tan_y / viewport.y.max(1.0);
        match self.projection_mode {
            ProjectionMode::Perspective => {
                let tan_diagonal = tan_y * aspect.hypot(1.0);
                PixelSize::PerMetre { ahead: in_the_middle, corner: 1.0 / tan_diagonal.hypot(1.0) }
            }
            ProjectionMode::Orthographic => PixelSize::Metres(in_the_middle * self.distance),
        }
    }

    /// The vertical angle in a viewport of this aspect, radians.
    fn fov_y(&self, aspect: f32) -> f32 {
        let widening = (FULL_ASPECT / aspect.max(0.1)).max(1.0);
        2.0 * ((self.fov_y * 0.5).tan() * widening).atan()
    }

    /// Towards the eye, to the right, and up, as the camera sees them.
    fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let back = self.direction();
        // By yaw alone, so that it holds when looking straight down too.
        let right = vec3(self.yaw.cos(), 0.0, -self.yaw.sin());
        (back, right, back.cross(right))
    }

    /// Returns the direction from the target to the eye.
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

impl Projection {
    /// Creates the projection of a camera view on a screen, points.
    pub fn new(view: &CameraView, screen: Rect) -> Self {
        Self { clip_from_world: view.clip_from_world(), screen }
    }

    /// Projects a world position to the screen, points; `None` behind the camera.
    pub fn to_screen(self, world: Vec3) -> Option<Pos2> {
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
mod tests;
