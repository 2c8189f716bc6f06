//! What an operator can ask for.

use std::time::Duration;

use egui::{Pos2, Rect, Vec2};

use crate::{AlarmAction, AlarmList, ChartCommand};

/// Cameras that numbers go to.
pub const MAX_BOOKMARKS: usize = 9;

/// How the camera is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraMode {
    /// About what it looks at.
    #[default]
    Orbit,
    /// On foot, at the height of the eyes.
    Walk,
    /// Anywhere.
    Fly,
}

/// From where plans and elevations are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From above; -z is up.
    Top,
    /// From +z.
    Front,
    /// From +x.
    Right,
}

/// A plane that cuts the scene open, across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSection {
    /// 0 to 2: x, y or z.
    pub axis: usize,
    /// Where it lies on the axis, metres.
    pub at: f32,
    /// Whether what is below `at` is cut away, and not what is beyond.
    pub from_below: bool,
}

/// What an operator asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Set the theta of all instances of a model.
    SetTheta {
        /// Index into [`ViewModel::models`](crate::ViewModel::models).
        model: usize,
        /// 0 to 1.
        theta: f64,
    },
    /// Let the configured policies choose the theta of a model's instances.
    UsePolicy {
        /// Index into [`ViewModel::models`](crate::ViewModel::models).
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
    /// Look at the scene, or what is selected, from a side, without perspective.
    UseStandardView(StandardView),
    /// Select and frame an equipment id.
    Focus(String),
    /// Select an equipment id and frame it from where nothing stands before it.
    Reveal(String),
    /// Choose an alarm, by its number.
    SelectAlarm(u32),
    /// Do something to an alarm.
    ActOnAlarm {
        /// Its number.
        alarm: u32,
        /// What.
        action: AlarmAction,
    },
    /// Show another list of alarms.
    ShowAlarmList(AlarmList),
    /// List the equipment that has these words in its names; all of it as a tree where
    /// there are none.
    SearchEquipment(String),
    /// Open or close a branch of the tree, by the number of its row.
    ToggleBranch(u32),
    /// List the tags that have these words in their names; all where there are none.
    FilterTags(String),
    /// Show a value's trend on the faceplate, or show it no longer; by its tag's number.
    ToggleTrend(u32),
    /// How far back trends go.
    SetTrendSpan(Duration),
    /// Change to the dark theme, or the light one.
    SetDark(bool),
    /// Frame the whole scene.
    FitAll,
    /// Frame what is selected.
    FitSelection,
    /// Turn about the target, or the head; points of drag.
    Orbit(Vec2),
    /// Go on turning after a drag that ended at this speed, points a second.
    StartInertia(Vec2),
    /// Move sideways, points of drag.
    Pan(Vec2),
    /// Move to or from the target: factor on the distance. On foot or in the air, one
    /// over the factor on the speed.
    Zoom(f32),
    /// Walk or fly.
    Move {
        /// To the right, up and forward, -1 to 1 each.
        direction: [f32; 3],
        /// For how long.
        seconds: f32,
        /// Whether in haste.
        is_fast: bool,
    },
    /// Draw an overlay, or leave it out.
    SetLayer {
        /// Index into [`ViewModel::layers`](crate::ViewModel::layers).
        layer: usize,
        /// Whether it is drawn.
        shown: bool,
    },
    /// Start a plugin again now, out of quarantine too.
    StartPlugin(String),
    /// Name and select what is at a point of the screen.
    Pick(Pos2),
    /// Select all that shows in a part of the screen.
    PickRectangle(Rect),
    /// Name what is under the pointer; none where it has left the scene.
    Hover(Option<Pos2>),
    /// Begin measuring distances, or end it.
    SetMeasuring(bool),
    /// Measure to the surface at a point of the screen.
    Measure(Pos2),
    /// End what is going on: measuring, else the selection.
    Escape,
}
