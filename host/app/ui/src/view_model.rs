//! View model: everything that the panels show in a frame.

use std::borrow::Cow;

use busbar_types::Origin;
use egui::Pos2;

use crate::{Age, AlarmModel, AxisSection, CameraMode, ChartModel, Faceplate, LayerRow, ValueMark};

/// Everything that the panels show in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewModel {
    /// Models with their collapse stacks.
    pub models: Vec<ModelRow>,
    /// Plugin instances with their links.
    pub plugins: Vec<PluginRow>,
    /// Overlays, in the order in which they are drawn.
    pub layers: Vec<LayerRow>,
    /// Names of the configuration's cameras.
    pub cameras: Vec<String>,
    /// Cameras that number keys lead to.
    pub bookmarks: Vec<Bookmark>,
    /// Navigation mode and projection of the camera.
    pub navigation: Navigation,
    /// True if the scene is drawn as wireframe.
    pub wireframe: bool,
    /// Factor on the thetas that policies choose.
    pub theta_scale: f64,
    /// The greatest that it may be.
    pub max_theta_scale: f64,
    /// The plane that cuts the scene open.
    pub section: Option<AxisSection>,
    /// The least and greatest coordinates of the scene, metres.
    pub extent: [[f32; 3]; 2],
    /// Alarm model; none without configured alarms.
    pub alarms: Option<AlarmModel>,
    /// The chart that stands in the scene; none where there is none.
    pub chart: Option<ChartModel>,
    /// Times of a recent frame.
    pub frame_times: FrameTimes,
    /// The line at the bottom.
    pub status: StatusBarModel,
    /// Equipment id of the selection, or the number of selected pieces.
    pub selected: Option<String>,
    /// Faceplate of the selected equipment; none unless exactly one is selected.
    pub faceplate: Option<Faceplate>,
    /// Measurement as text; none while nothing is measured.
    pub measuring: Option<String>,
    /// Origins of what the view shows, for the band over the scene; live without any.
    pub origin: Origin,
}

/// Navigation state of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Navigation {
    /// Navigation mode of the camera.
    pub mode: CameraMode,
    /// True for orthographic projection.
    pub orthographic: bool,
    /// Flying speed, metres a second.
    pub speed: f32,
}

/// A camera that a number goes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bookmark {
    /// Bookmark number, 1 to [`MAX_BOOKMARKS`](crate::MAX_BOOKMARKS).
    pub number: usize,
    /// Name of a configured camera; none for a stored one.
    pub name: Option<String>,
}

/// A model and where the cursors of its instances stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelRow {
    /// Name of the model.
    pub name: String,
    /// Proportion of vertices simplified, 0 to 1: the least and the greatest
    /// of its instances.
    pub theta: [f64; 2],
    /// True if the configured policies choose theta instead of the slider.
    pub by_policy: bool,
    /// Entries to be collapsed, summed over instances.
    pub s1: u64,
    /// Entries collapsed, summed over instances.
    pub s2: u64,
    /// Live triangles, summed over instances.
    pub triangles: u64,
    /// Instances in the scene.
    pub instances: usize,
}

/// Rows of the tag table; only visible rows are requested.
pub trait TagRows {
    /// Number of tags that are listed.
    fn len(&self) -> usize;

    /// Returns the total number of tags.
    fn total(&self) -> usize;

    /// Reports whether more tags match the filter than are listed.
    fn is_truncated(&self) -> bool;

    /// Reports whether no tag is listed.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns one row of the table.
    fn row(&self, index: usize) -> TagRow;
}

/// Row of the tag table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TagRow {
    /// Tag id of the configuration.
    pub id: String,
    /// Descriptive name of the tag.
    pub name: String,
    /// Last value as text.
    pub value: String,
    /// Unit of the value.
    pub unit: String,
    /// Mark of the value.
    pub mark: ValueMark,
    /// Time since the value came.
    pub age: Option<Age>,
    /// Equipment it is bound to.
    pub node: Option<String>,
    /// Origin of the value, live or not.
    pub origin: Origin,
}

/// A label at a piece of equipment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Label<'a> {
    /// Equipment id of the label.
    pub title: String,
    /// Screen position of the equipment, points.
    pub anchor: Pos2,
    /// Distance from the camera, metres: nearer labels come first.
    pub distance: f32,
    /// Lines of the label.
    pub lines: Vec<LabelLine<'a>>,
    /// True if the equipment is selected.
    pub selected: bool,
    /// True if the equipment is in alarm; its label takes precedence.
    pub alarmed: bool,
    /// True if the equipment is occluded.
    pub hidden: bool,
}

/// A line of a label.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelLine<'a> {
    /// Caption of the line.
    pub caption: Cow<'a, str>,
    /// Value with its unit.
    pub text: Cow<'a, str>,
    /// Mark of the value.
    pub mark: ValueMark,
    /// Time since the value came.
    pub age: Option<Age>,
    /// Origin of the value, live or not.
    pub origin: Origin,
}

impl LabelLine<'_> {
    /// Returns the line with texts of its own.
    fn into_owned(self) -> LabelLine<'static> {
        let Self { caption, text, mark, age, origin } = self;
        let (caption, text) = (caption.into_owned().into(), text.into_owned().into());
        LabelLine { caption, text, mark, age, origin }
    }
}

impl Label<'_> {
    /// Returns the label with texts of its own.
    pub(crate) fn into_owned(self) -> Label<'static> {
        let Self { title, anchor, distance, lines, selected, alarmed, hidden } = self;
        let lines = lines.into_iter().map(LabelLine::into_owned).collect();
        Label { title, anchor, distance, lines, selected, alarmed, hidden }
    }
}

/// State of a plugin's link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkIndicator {
    /// Plugin without a link.
    #[default]
    None,
    /// Link that is up.
    Up,
    /// Link is being established.
    Waiting,
    /// Down, or the plugin failed.
    Down,
}

/// Row of a plugin instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PluginRow {
    /// Name in the configuration.
    pub name: String,
    /// Plugin id and version.
    pub plugin: String,
    /// State of the link.
    pub link_indicator: LinkIndicator,
    /// Last message of the plugin.
    pub message: String,
    /// Process state as text.
    pub process: String,
    /// True if a restart is pending or the plugin is quarantined.
    pub can_start: bool,
    /// Origin that all its values have.
    pub origin: Origin,
}

/// Times of a recent frame, for diagnosis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// Time from the beginning of the frame until its submission, milliseconds.
    pub frame: f64,
    /// GPU time of the frame and its stages, milliseconds; empty on devices without timestamps.
    pub gpu_stages: Vec<(&'static str, f64)>,
}

/// The line at the bottom.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StatusBarModel {
    /// Time of day with seconds, which reveals a frozen picture; none in unattended pictures.
    pub clock: Option<String>,
    /// True if the clock stays visible while the panels are hidden.
    pub keeps_clock: bool,
    /// Number of triangles drawn.
    pub triangles: u64,
    /// Triangles at full detail.
    pub triangles_full: u64,
    /// Name of the graphics device.
    pub device: String,
    /// Tags of good quality.
    pub good: usize,
    /// Tags of uncertain quality.
    pub uncertain: usize,
    /// Tags of bad quality.
    pub bad: usize,
    /// Faults of the configuration file on the disk, which therefore is not shown.
    pub fault: Option<String>,
}
