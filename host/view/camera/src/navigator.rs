//! Camera navigation: modes, transitions to other cameras, inertia, bookmarks.

use std::collections::BTreeMap;
use std::f32::consts::FRAC_PI_2;

use busbar_config::{CameraConfig, ViewConfig};
use busbar_geometry::Bounds;
use busbar_scene::SceneGraph;
use busbar_ui::{Bookmark, CameraMode, Command, MAX_BOOKMARKS, StandardView};
use egui::{Rect, Vec2};
use glam::{Vec3, vec3};

use super::transition::Transition;
use super::{Camera, ProjectionMode, unoccluded_view};

/// Height of the eye above the ground, metres: standing, as in ISO 7250-1 for men and
/// women together.
const EYE_HEIGHT: f32 = 1.6;
/// Speeds of walking and flying, metres a second, and the permitted range.
const WALKING_SPEED: f32 = 1.6;
const FLYING_SPEED: f32 = 8.0;
const SPEED_RANGE: std::ops::RangeInclusive<f32> = 0.2..=500.0;
/// Factor of fast movement on the speed.
const FAST_FACTOR: f32 = 4.0;
/// The longest step that one frame makes, seconds: no leaps after a pause.
const MAX_STEP_SECONDS: f32 = 0.25;
/// Seconds in which what coasts slows down to 1/e.
const INERTIA_SECONDS: f32 = 0.25;
/// Points a second below which it stands still.
const MIN_INERTIA_SPEED: f32 = 8.0;

/// A camera, and how it is moved.
pub struct Navigator {
    camera: Camera,
    mode: CameraMode,
    /// Flying speed, metres a second.
    speed: f32,
    transition: Option<Transition>,
    /// True if the camera has arrived at another position since the last query.
    has_arrived: bool,
    transition_seconds: f32,
    has_inertia: bool,
    /// Points of drag a second.
    inertia_velocity: Vec2,
    /// Cameras that the operator stored.
    stored: [Option<Camera>; MAX_BOOKMARKS],
    /// Time of the last frame, seconds.
    time: Option<f64>,
}

/// Scene and viewport that camera commands refer to.
pub struct NavigationContext<'a> {
    /// Scene that is shown.
    pub graph: &'a SceneGraph,
    /// Cameras of the configuration.
    pub cameras: &'a BTreeMap<String, CameraConfig>,
    /// Area that panels leave free, points.
    pub viewport: Rect,
    /// Bounds of the selection.
    pub selection: Option<Bounds>,
}

impl Navigator {
    /// Creates a navigator. Without a window every movement is instant, so that pictures do not
    /// depend on time.
    pub fn new(camera: Camera, view: &ViewConfig, in_window: bool) -> Self {
        Self {
            camera,
            mode: CameraMode::Orbit,
            speed: FLYING_SPEED,
            transition: None,
            has_arrived: false,
            transition_seconds: if in_window { view.transition_seconds } else { 0.0 },
            has_inertia: in_window && view.inertia,
            inertia_velocity: Vec2::ZERO,
            stored: [None; MAX_BOOKMARKS],
            time: None,
        }
    }

    /// Moves as another configuration says.
    pub fn configure(&mut self, view: &ViewConfig, in_window: bool) {
        self.transition_seconds = if in_window { view.transition_seconds } else { 0.0 };
        self.has_inertia = in_window && view.inertia;
    }

    /// Returns the camera as it is now.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the mode of navigation.
    pub fn mode(&self) -> CameraMode {
        self.mode
    }

    /// Reports whether the projection is orthographic.
    pub fn is_orthographic(&self) -> bool {
        self.destination().projection_mode == ProjectionMode::Orthographic
    }

    /// Metres a second, in the modes that have a speed.
    pub fn speed(&self) -> f32 {
        self.speed
    }

    /// Reports whether the camera moves by itself.
    pub fn is_moving(&self) -> bool {
        self.transition.is_some() || self.inertia_velocity != Vec2::ZERO
    }

    /// Reports whether the camera has arrived at another position, as
    /// [`Navigator::take_arrival`] does.
    pub fn has_arrived(&self) -> bool {
        self.has_arrived
    }

    /// Takes the flag that the camera has arrived at another position.
    pub fn take_arrival(&mut self) -> bool {
        std::mem::take(&mut self.has_arrived)
    }

    /// Stands at a camera at once.
    pub fn jump_to(&mut self, camera: Camera) {
        self.stop();
        self.camera = camera;
        self.has_arrived = true;
    }

    /// Keeps all cameras where they are while the scene is expressed relative to another origin.
    pub fn shift(&mut self, offset: Vec3) {
        if offset == Vec3::ZERO {
            return;
        }
        self.stop();
        let stored = self.stored.iter_mut().flatten();
        std::iter::once(&mut self.camera).chain(stored).for_each(|camera| camera.target += offset);
    }

    /// The cameras that numbers go to: those stored, else those of the configuration.
    pub fn bookmarks(&self, cameras: &BTreeMap<String, CameraConfig>) -> Vec<Bookmark> {
        let name = |index: usize| cameras.keys().nth(index).cloned();
        let bookmark = |index: usize| {
            let is_stored = self.stored[index].is_some();
            let name = if is_stored { None } else { Some(name(index)?) };
            Some(Bookmark { number: index + 1, name })
        };
        (0..MAX_BOOKMARKS).filter_map(bookmark).collect()
    }

    /// Advances transitions and inertia to a time in seconds.
    pub fn advance(&mut self, time: f64) {
        let last = self.time.replace(time).unwrap_or(time);
        let seconds = ((time - last) as f32).clamp(0.0, MAX_STEP_SECONDS);
        if let Some(transition) = &mut self.transition {
            let (camera, has_arrived) = transition.step(seconds);
            self.camera = camera;
            if has_arrived {
                (self.transition, self.has_arrived) = (None, true);
            }
        } else if self.inertia_velocity != Vec2::ZERO {
            let drag = self.inertia_velocity * seconds;
            self.inertia_velocity *= (-seconds / INERTIA_SECONDS).exp();
            if self.inertia_velocity.length() < MIN_INERTIA_SPEED {
                self.inertia_velocity = Vec2::ZERO;
            }
            self.turn(drag);
        }
    }

    /// Moves the camera as the commands say.
    pub fn steer(&mut self, commands: &[Command], context: &NavigationContext<'_>) {
        for command in commands {
            self.apply(command, context);
        }
    }

    fn apply(&mut self, command: &Command, context: &NavigationContext<'_>) {
        match command {
            Command::Orbit(drag) => {
                self.stop();
                self.turn(*drag);
            }
            Command::Pan(drag) => {
                self.stop();
                self.camera.pan(*drag, context.viewport.size());
                self.constrain_to_ground(context);
            }
            Command::Zoom(factor) if self.mode == CameraMode::Orbit => {
                self.stop();
                self.camera.zoom(*factor);
            }
            // Away from the hand is faster, as it is nearer in an orbit.
            Command::Zoom(factor) => {
                self.speed = (self.speed / factor).clamp(*SPEED_RANGE.start(), *SPEED_RANGE.end());
            }
            Command::StartInertia(speed) if self.has_inertia => self.inertia_velocity = *speed,
            Command::Move { direction, seconds, is_fast } => {
                self.stop();
                self.walk(*direction, *seconds, *is_fast);
                self.constrain_to_ground(context);
            }
            Command::SetCameraMode(mode) => self.set_mode(*mode, context),
            Command::SetOrthographic(orthographic) => self.set_orthographic(*orthographic),
            Command::UseStandardView(side) => self.use_standard_view(*side, context),
            Command::FitAll => self.frame(context.graph.bounds(), context),
            Command::FitSelection => self.frame(context.selection, context),
            Command::Focus(id) => {
                let node = context.graph.find(id);
                self.frame(node.and_then(|node| context.graph.node(node).bounds()), context);
            }
            Command::Reveal(id) => self.reveal(id, context),
            Command::UseCamera(name) => {
                if let Some(config) = context.cameras.get(name) {
                    let camera = Camera::from_config(config, context.graph);
                    self.go_to_free_camera(camera, context);
                }
            }
            Command::StoreBookmark(number) => {
                let camera = self.destination();
                let place = number.checked_sub(1).and_then(|index| self.stored.get_mut(index));
                place.into_iter().for_each(|place| *place = Some(camera));
            }
            Command::GoToBookmark(number) => self.go_to_bookmark(*number, context),
            _ => {}
        }
    }

    /// Returns the camera's destination, or its present state while it rests.
    fn destination(&self) -> Camera {
        self.transition.as_ref().map_or(self.camera, Transition::destination)
    }

    fn stop(&mut self) {
        self.transition = None;
        self.inertia_velocity = Vec2::ZERO;
    }

    fn turn(&mut self, drag: Vec2) {
        match self.mode {
            CameraMode::Orbit => self.camera.orbit(drag),
            CameraMode::Walk | CameraMode::Fly => self.camera.look_around(drag),
        }
    }

    /// `direction` is to the right, up and forward, -1 to 1 each.
    fn walk(&mut self, direction: [f32; 3], seconds: f32, is_fast: bool) {
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
        let speed = if is_fast { speed * FAST_FACTOR } else { speed };
        self.camera.target += way * speed * seconds.clamp(0.0, MAX_STEP_SECONDS);
    }

    fn constrain_to_ground(&mut self, context: &NavigationContext<'_>) {
        if self.mode == CameraMode::Walk {
            self.camera = at_eye_height(self.camera, context.graph.bounds());
        }
    }

    fn set_mode(&mut self, mode: CameraMode, context: &NavigationContext<'_>) {
        self.mode = mode;
        let mut camera = self.destination();
        if mode != CameraMode::Orbit {
            camera.projection_mode = ProjectionMode::Perspective;
        }
        if mode == CameraMode::Walk {
            camera = at_eye_height(camera, context.graph.bounds());
            // From above one would see nothing but one's feet.
            let eye = camera.eye();
            camera.pitch = 0.0;
            camera.move_eye_to(eye);
        }
        self.go_to(camera, context);
    }

    fn set_orthographic(&mut self, orthographic: bool) {
        self.camera = self.destination();
        self.stop();
        self.camera.projection_mode =
            if orthographic { ProjectionMode::Orthographic } else { ProjectionMode::Perspective };
        if orthographic {
            self.mode = CameraMode::Orbit;
        }
    }

    fn use_standard_view(&mut self, side: StandardView, context: &NavigationContext<'_>) {
        self.mode = CameraMode::Orbit;
        let mut camera = self.destination();
        camera.projection_mode = ProjectionMode::Orthographic;
        (camera.yaw, camera.pitch) = match side {
            StandardView::Top => (0.0, FRAC_PI_2),
            StandardView::Front => (0.0, 0.0),
            StandardView::Right => (FRAC_PI_2, 0.0),
        };
        camera.frame(context.selection.or(context.graph.bounds()));
        self.go_to(camera, context);
    }

    fn frame(&mut self, bounds: Option<Bounds>, context: &NavigationContext<'_>) {
        let mut camera = self.destination();
        camera.frame(bounds);
        self.go_to_free_camera(camera, context);
    }

    fn reveal(&mut self, id: &str, context: &NavigationContext<'_>) {
        let node = context.graph.find(id);
        let Some(bounds) = node.and_then(|node| context.graph.node(node).bounds()) else { return };
        let camera = unoccluded_view::find_unoccluded_view(
            self.destination(),
            bounds,
            &boxes_of(context.graph),
        );
        self.go_to_free_camera(camera, context);
    }

    fn go_to_bookmark(&mut self, number: usize, context: &NavigationContext<'_>) {
        let Some(index) = number.checked_sub(1) else { return };
        let stored = self.stored.get(index).copied().flatten();
        let camera = |config| Camera::from_config(config, context.graph);
        let configured = || context.cameras.values().nth(index).map(camera);
        if let Some(camera) = stored.or_else(configured) {
            self.go_to_free_camera(camera, context);
        }
    }

    /// Goes to a camera that need not stand on the ground.
    fn go_to_free_camera(&mut self, camera: Camera, context: &NavigationContext<'_>) {
        if self.mode == CameraMode::Walk {
            self.mode = CameraMode::Orbit;
        }
        self.go_to(camera, context);
    }

    fn go_to(&mut self, camera: Camera, context: &NavigationContext<'_>) {
        self.stop();
        let seconds = self.transition_seconds;
        if seconds > 0.0 {
            let equipment = boxes_of(context.graph);
            self.transition = Transition::between(self.camera, camera, seconds, &equipment);
        }
        if self.transition.is_none() {
            self.camera = camera;
            self.has_arrived = true;
        }
    }
}

/// Returns the bounds of all mesh instances, as obstacles for camera paths.
fn boxes_of(graph: &SceneGraph) -> Vec<Bounds> {
    graph.instances().filter_map(|instance| graph.bounds_of_mesh(&instance)).collect()
}

/// Returns the camera with its eye at standing height above the ground.
fn at_eye_height(mut camera: Camera, scene: Option<Bounds>) -> Camera {
    let ground = scene.map_or(0.0, |bounds| bounds.min.y);
    let eye = camera.eye();
    camera.move_eye_to(vec3(eye.x, ground + EYE_HEIGHT, eye.z));
    camera
}

#[cfg(test)]
mod tests;
