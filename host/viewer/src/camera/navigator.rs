//! The operator's hands on the camera: modes, ways to other cameras, bookmarks.

use std::collections::BTreeMap;
use std::f32::consts::FRAC_PI_2;

use busbar_config::{CameraConfig, ViewConfig};
use busbar_geometry::Bounds;
use busbar_scene::SceneGraph;
use busbar_ui::{Bookmark, CameraMode, Command, MAX_BOOKMARKS, Side};
use egui::{Rect, Vec2};
use glam::{Vec3, vec3};

use super::transition::Transition;
use super::{Camera, Lens, reveal};

/// Height of the eye above the ground, metres: standing, as in ISO 7250-1 for men and
/// women together.
const EYE_HEIGHT: f32 = 1.6;
/// Metres a second.
const WALKING_SPEED: f32 = 1.6;
const FLYING_SPEED: f32 = 8.0;
const SPEED_RANGE: std::ops::RangeInclusive<f32> = 0.2..=500.0;
/// What haste multiplies that by.
const HASTE: f32 = 4.0;
/// The longest step that one frame makes, seconds: no leaps after a pause.
const MAX_STEP_SECONDS: f32 = 0.25;
/// Seconds in which what coasts slows down to 1/e.
const COASTING_SECONDS: f32 = 0.25;
/// Points a second below which it stands still.
const MIN_COASTING: f32 = 8.0;

/// A camera, and how it is moved.
pub(crate) struct Navigator {
    camera: Camera,
    mode: CameraMode,
    /// Metres a second.
    speed: f32,
    transition: Option<Transition>,
    /// Whether it came to another camera since it was last asked.
    has_arrived: bool,
    transition_seconds: f32,
    has_inertia: bool,
    /// Points of drag a second.
    coasting: Vec2,
    /// Those that the operator stored.
    stored: [Option<Camera>; MAX_BOOKMARKS],
    /// When the last frame was, seconds.
    time: Option<f64>,
}

/// What steering depends on.
pub(crate) struct Around<'a> {
    pub(crate) graph: &'a SceneGraph,
    /// Those of the configuration.
    pub(crate) cameras: &'a BTreeMap<String, CameraConfig>,
    /// Where panels leave room, points.
    pub(crate) viewport: Rect,
    /// Of what is selected.
    pub(crate) selection: Option<Bounds>,
}

impl Navigator {
    /// Without a window nothing takes time: pictures must not depend on it.
    pub(crate) fn new(camera: Camera, view: &ViewConfig, in_window: bool) -> Self {
        Self {
            camera,
            mode: CameraMode::Orbit,
            speed: FLYING_SPEED,
            transition: None,
            has_arrived: false,
            transition_seconds: if in_window { view.transition_seconds } else { 0.0 },
            has_inertia: in_window && view.inertia,
            coasting: Vec2::ZERO,
            stored: [None; MAX_BOOKMARKS],
            time: None,
        }
    }

    /// Moves as another configuration says.
    pub(crate) fn configure(&mut self, view: &ViewConfig, in_window: bool) {
        self.transition_seconds = if in_window { view.transition_seconds } else { 0.0 };
        self.has_inertia = in_window && view.inertia;
    }

    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    pub(crate) fn mode(&self) -> CameraMode {
        self.mode
    }

    pub(crate) fn is_orthographic(&self) -> bool {
        self.destination().lens == Lens::Orthographic
    }

    /// Metres a second, in the modes that have a speed.
    pub(crate) fn speed(&self) -> f32 {
        self.speed
    }

    /// Whether it moves by itself.
    pub(crate) fn is_moving(&self) -> bool {
        self.transition.is_some() || self.coasting != Vec2::ZERO
    }

    /// Whether it came to another camera since this was last asked.
    pub(crate) fn take_arrival(&mut self) -> bool {
        std::mem::take(&mut self.has_arrived)
    }

    /// Stands at a camera at once.
    pub(crate) fn jump_to(&mut self, camera: Camera) {
        self.stop();
        self.camera = camera;
        self.has_arrived = true;
    }

    /// The cameras that numbers go to: those stored, else those of the configuration.
    pub(crate) fn bookmarks(&self, cameras: &BTreeMap<String, CameraConfig>) -> Vec<Bookmark> {
        let name = |index: usize| cameras.keys().nth(index).cloned();
        let bookmark = |index: usize| {
            let is_stored = self.stored[index].is_some();
            let name = if is_stored { None } else { Some(name(index)?) };
            Some(Bookmark { number: index + 1, name })
        };
        (0..MAX_BOOKMARKS).filter_map(bookmark).collect()
    }

    /// Goes on by itself to a time in seconds.
    pub(crate) fn advance(&mut self, time: f64) {
        let last = self.time.replace(time).unwrap_or(time);
        let seconds = ((time - last) as f32).clamp(0.0, MAX_STEP_SECONDS);
        if let Some(transition) = &mut self.transition {
            let (camera, has_arrived) = transition.step(seconds);
            self.camera = camera;
            if has_arrived {
                (self.transition, self.has_arrived) = (None, true);
            }
        } else if self.coasting != Vec2::ZERO {
            let drag = self.coasting * seconds;
            self.coasting *= (-seconds / COASTING_SECONDS).exp();
            if self.coasting.length() < MIN_COASTING {
                self.coasting = Vec2::ZERO;
            }
            self.turn(drag);
        }
    }

    /// Moves the camera as the commands say.
    pub(crate) fn steer(&mut self, commands: &[Command], around: &Around<'_>) {
        for command in commands {
            self.obey(command, around);
        }
    }

    fn obey(&mut self, command: &Command, around: &Around<'_>) {
        match command {
            Command::Orbit(drag) => {
                self.stop();
                self.turn(*drag);
            }
            Command::Pan(drag) => {
                self.stop();
                self.camera.pan(*drag, around.viewport.size());
                self.keep_to_the_ground(around);
            }
            Command::Zoom(factor) if self.mode == CameraMode::Orbit => {
                self.stop();
                self.camera.zoom(*factor);
            }
            // Away from the hand is faster, as it is nearer in an orbit.
            Command::Zoom(factor) => {
                self.speed = (self.speed / factor).clamp(*SPEED_RANGE.start(), *SPEED_RANGE.end());
            }
            Command::Coast(speed) if self.has_inertia => self.coasting = *speed,
            Command::Move { direction, seconds, hasty } => {
                self.stop();
                self.walk(*direction, *seconds, *hasty);
                self.keep_to_the_ground(around);
            }
            Command::SetCameraMode(mode) => self.set_mode(*mode, around),
            Command::SetOrthographic(orthographic) => self.set_orthographic(*orthographic),
            Command::LookFrom(side) => self.look_from(*side, around),
            Command::FitAll => self.frame(around.graph.bounds(), around),
            Command::FitSelection => self.frame(around.selection, around),
            Command::Focus(id) => {
                let node = around.graph.find(id);
                self.frame(node.and_then(|node| around.graph.node(node).bounds()), around);
            }
            Command::Reveal(id) => self.reveal(id, around),
            Command::UseCamera(name) => {
                if let Some(config) = around.cameras.get(name) {
                    self.visit(Camera::from_config(config), around);
                }
            }
            Command::StoreBookmark(number) => {
                let camera = self.destination();
                let place = number.checked_sub(1).and_then(|index| self.stored.get_mut(index));
                place.into_iter().for_each(|place| *place = Some(camera));
            }
            Command::GoToBookmark(number) => self.go_to_bookmark(*number, around),
            _ => {}
        }
    }

    /// Where it is, or is going to be.
    fn destination(&self) -> Camera {
        self.transition.as_ref().map_or(self.camera, Transition::destination)
    }

    fn stop(&mut self) {
        self.transition = None;
        self.coasting = Vec2::ZERO;
    }

    fn turn(&mut self, drag: Vec2) {
        match self.mode {
            CameraMode::Orbit => self.camera.orbit(drag),
            CameraMode::Walk | CameraMode::Fly => self.camera.look_around(drag),
        }
    }

    /// `direction` is to the right, up and forward, -1 to 1 each.
    fn walk(&mut self, direction: [f32; 3], seconds: f32, hasty: bool) {
        let [sideways, up, ahead] = direction;
        let (back, right, _) = self.camera.axes();
        let (forward, speed) = match self.mode {
            CameraMode::Orbit => return,
            // Who walks looks up and down without leaving the ground.
            CameraMode::Walk => {
                let yaw = self.camera.yaw;
                (-vec3(yaw.sin(), 0.0, yaw.cos()), WALKING_SPEED)
            }
            CameraMode::Fly => (-back, self.speed),
        };
        let way = (right * sideways + Vec3::Y * up + forward * ahead).clamp_length_max(1.0);
        let speed = if hasty { speed * HASTE } else { speed };
        self.camera.target += way * speed * seconds.clamp(0.0, MAX_STEP_SECONDS);
    }

    fn keep_to_the_ground(&mut self, around: &Around<'_>) {
        if self.mode == CameraMode::Walk {
            self.camera = on_foot(self.camera, around.graph.bounds());
        }
    }

    fn set_mode(&mut self, mode: CameraMode, around: &Around<'_>) {
        self.mode = mode;
        let mut camera = self.destination();
        if mode != CameraMode::Orbit {
            camera.lens = Lens::Perspective;
        }
        if mode == CameraMode::Walk {
            camera = on_foot(camera, around.graph.bounds());
            // From above one would see nothing but one's feet.
            let eye = camera.eye();
            camera.pitch = 0.0;
            camera.stand_at(eye);
        }
        self.go_to(camera, around);
    }

    fn set_orthographic(&mut self, orthographic: bool) {
        self.camera = self.destination();
        self.stop();
        self.camera.lens = if orthographic { Lens::Orthographic } else { Lens::Perspective };
        if orthographic {
            self.mode = CameraMode::Orbit;
        }
    }

    fn look_from(&mut self, side: Side, around: &Around<'_>) {
        self.mode = CameraMode::Orbit;
        let mut camera = self.destination();
        camera.lens = Lens::Orthographic;
        (camera.yaw, camera.pitch) = match side {
            Side::Top => (0.0, FRAC_PI_2),
            Side::Front => (0.0, 0.0),
            Side::Right => (FRAC_PI_2, 0.0),
        };
        camera.frame(around.selection.or(around.graph.bounds()));
        self.go_to(camera, around);
    }

    fn frame(&mut self, bounds: Option<Bounds>, around: &Around<'_>) {
        let mut camera = self.destination();
        camera.frame(bounds);
        self.visit(camera, around);
    }

    fn reveal(&mut self, id: &str, around: &Around<'_>) {
        let node = around.graph.find(id);
        let Some(bounds) = node.and_then(|node| around.graph.node(node).bounds()) else { return };
        let camera = reveal::in_sight(self.destination(), bounds, &boxes_of(around.graph));
        self.visit(camera, around);
    }

    fn go_to_bookmark(&mut self, number: usize, around: &Around<'_>) {
        let Some(index) = number.checked_sub(1) else { return };
        let stored = self.stored.get(index).copied().flatten();
        let configured = || around.cameras.values().nth(index).map(Camera::from_config);
        if let Some(camera) = stored.or_else(configured) {
            self.visit(camera, around);
        }
    }

    /// Goes to a camera that need not stand on the ground.
    fn visit(&mut self, camera: Camera, around: &Around<'_>) {
        if self.mode == CameraMode::Walk {
            self.mode = CameraMode::Orbit;
        }
        self.go_to(camera, around);
    }

    fn go_to(&mut self, camera: Camera, around: &Around<'_>) {
        self.stop();
        let seconds = self.transition_seconds;
        if seconds > 0.0 {
            let equipment = boxes_of(around.graph);
            self.transition = Transition::between(self.camera, camera, seconds, &equipment);
        }
        if self.transition.is_none() {
            self.camera = camera;
            self.has_arrived = true;
        }
    }
}

/// The boxes of what a scene shows, as whoever looks for a way past them has them.
fn boxes_of(graph: &SceneGraph) -> Vec<Bounds> {
    graph.instances().filter_map(|instance| graph.bounds_of_mesh(&instance)).collect()
}

/// The camera with its eye as high above the ground as one who stands there.
fn on_foot(mut camera: Camera, scene: Option<Bounds>) -> Camera {
    let ground = scene.map_or(0.0, |bounds| bounds.min.y);
    let eye = camera.eye();
    camera.stand_at(vec3(eye.x, ground + EYE_HEIGHT, eye.z));
    camera
}

#[cfg(test)]
mod tests;
