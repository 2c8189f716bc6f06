//! Commands of the operator: camera, selection, alarms, charts, display.

use std::time::Duration;

use busbar_types::AlarmAction;
use egui::{Pos2, Rect, Vec2};

use crate::{AlarmList, ChartCommand};

/// Cameras that numbers go to.
pub const MAX_BOOKMARKS: usize = 9;

/// Navigation mode of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraMode {
    /// Orbit mode: the camera turns about its target.
    #[default]
    Orbit,
    /// Walk mode: the camera stays at eye height above the ground.
    Walk,
    /// Free flight in all directions.
    Fly,
}

/// Standard view of plans and elevations, orthographic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// Top view, from +y; -z is up on the screen.
    Top,
    /// Front view, from +z.
    Front,
    /// Right view, from +x.
    Right,
}

/// A plane that cuts the scene open, across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSection {
    /// 0 to 2: x, y or z.
    pub axis: usize,
    /// Position of the plane on its axis, metres.
    pub at: f32,
    /// True if the part below `at` is cut away instead of the part above.
    pub from_below: bool,
}

/// Command of an operator.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Set the theta of all instances of a model.
    SetTheta {
        /// Model index into [`ViewModel::models`](crate::ViewModel::models).
        model: usize,
        /// Simplified proportion, 0 to 1.
        theta: f64,
    },
    /// Let the configured policies choose the theta of a model's instances.
    UsePolicy {
        /// Model index into [`ViewModel::models`](crate::ViewModel::models).
        model: usize,
    },
    /// Something of the chart.
    Chart(ChartCommand),
    /// Set the factor on the thetas that policies choose.
    SetThetaScale(f64),
    /// Draw as wireframe, or not.
    SetWireframe(bool),
    /// Cut the scene open, or show all of it.
    SetSection(Option<AxisSection>),
    /// Go to a named camera.
    UseCamera(String),
    /// Store the camera under a number, 1 to [`MAX_BOOKMARKS`].
    StoreBookmark(usize),
    /// Go to the camera of a number.
    GoToBookmark(usize),
    /// Move the camera in another way.
    SetCameraMode(CameraMode),
    /// Look without perspective, or with it.
    SetOrthographic(bool),
    /// Show a standard view of the selection, or of the scene, in orthographic projection.
    UseStandardView(StandardView),
    /// Select and frame an equipment id.
    Focus(String),
    /// Select an equipment id and frame it from where nothing stands before it.
    Reveal(String),
    /// Choose an alarm, by its number.
    SelectAlarm(u32),
    /// Do something to an alarm.
    ActOnAlarm {
        /// Number of the alarm.
        alarm: u32,
        /// Action on the alarm.
        action: AlarmAction,
    },
    /// Show another list of alarms.
    ShowAlarmList(AlarmList),
    /// Search equipment by the words of the query; an empty query restores the tree.
    SearchEquipment(String),
    /// Open or close a branch of the tree, by the number of its row.
    ToggleBranch(u32),
    /// Filter tags by the words of the query; an empty query lists all.
    FilterTags(String),
    /// Show a value's trend on the faceplate, or show it no longer; by its tag's number.
    ToggleTrend(u32),
    /// Set the time span of trends.
    SetTrendSpan(Duration),
    /// Change to the dark theme, or the light one.
    SetDark(bool),
    /// Frame the whole scene.
    FitAll,
    /// Frame the selected equipment.
    FitSelection,
    /// Turn about the target, or the head; points of drag.
    Orbit(Vec2),
    /// Continue a drag by inertia from this pointer velocity, points a second.
    StartInertia(Vec2),
    /// Move sideways, points of drag.
    Pan(Vec2),
    /// Move to or from the target: factor on the distance. On foot or in the air, one
    /// over the factor on the speed.
    Zoom(f32),
    /// Walk or fly for a duration.
    Move {
        /// To the right, up and forward, -1 to 1 each.
        direction: [f32; 3],
        /// Duration of the movement, seconds.
        seconds: f32,
        /// True if the movement is fast (Shift).
        is_fast: bool,
    },
    /// Draw an overlay, or leave it out.
    SetLayer {
        /// Layer index into [`ViewModel::layers`](crate::ViewModel::layers).
        layer: usize,
        /// True if the layer is drawn.
        shown: bool,
    },
    /// Start a plugin again now, out of quarantine too.
    StartPlugin(String),
    /// Pick at a screen position: select the equipment there.
    Pick(Pos2),
    /// Select all that shows in a part of the screen.
    PickRectangle(Rect),
    /// Hover a screen position; none once the pointer has left the scene.
    Hover(Option<Pos2>),
    /// Begin measuring distances, or end it.
    SetMeasuring(bool),
    /// Measure to the surface at a point of the screen.
    Measure(Pos2),
    /// End the measurement, or else clear the selection.
    Escape,
}

impl Command {
    /// Reports whether the command comes with each pass and changes nothing by itself.
    pub(crate) fn is_idle(&self) -> bool {
        matches!(self, Self::Hover(_))
    }
}
