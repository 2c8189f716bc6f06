//! What the panels show, and what they can ask for.

use std::time::Duration;

use busbar_tags::Origin;
use egui::Pos2;

use crate::{AlarmModel, AxisSection, CameraMode, ChartModel, Faceplate, LayerRow};

/// Everything that the panels show in one frame.
#[derive(Clone, Debug, Default)]
pub struct ViewModel {
    /// Models with their collapse stacks.
    pub models: Vec<ModelRow>,
    /// Plugins.
    pub plugins: Vec<PluginRow>,
    /// Overlays, in the order in which they are drawn.
    pub layers: Vec<LayerRow>,
    /// Names of the configuration's cameras.
    pub cameras: Vec<String>,
    /// What numbers go to.
    pub bookmarks: Vec<Bookmark>,
    /// How the camera is moved, and through what lens it looks.
    pub navigation: Navigation,
    /// Whether the scene is drawn as wireframe.
    pub wireframe: bool,
    /// Factor on the thetas that policies choose.
    pub theta_scale: f64,
    /// The greatest that it may be.
    pub max_theta_scale: f64,
    /// The plane that cuts the scene open.
    pub section: Option<AxisSection>,
    /// The least and greatest coordinates of the scene, metres.
    pub extent: [[f32; 3]; 2],
    /// What is said of alarms; none where there are none configured.
    pub alarms: Option<AlarmModel>,
    /// The chart that stands in the scene; none where there is none.
    pub chart: Option<ChartModel>,
    /// The line at the bottom.
    pub status: StatusBarModel,
    /// Equipment id of what is selected, or how many are.
    pub selected: Option<String>,
    /// What is said of the equipment that is selected; none where none or several are.
    pub faceplate: Option<Faceplate>,
    /// What is measured, in words; none when nothing is.
    pub measuring: Option<String>,
    /// Origins of what the view shows, for the band over the scene; live without any.
    pub origin: Origin,
}

/// How the camera is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Navigation {
    /// By what gestures.
    pub mode: CameraMode,
    /// Whether what is far is as large as what is near.
    pub orthographic: bool,
    /// Of flying, metres a second.
    pub speed: f32,
}

/// A camera that a number goes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bookmark {
    /// 1 to [`MAX_BOOKMARKS`](crate::MAX_BOOKMARKS).
    pub number: usize,
    /// Its name in the configuration; none for one that was stored.
    pub name: Option<String>,
}

/// A model and where the cursors of its instances stand.
#[derive(Clone, Debug, Default)]
pub struct ModelRow {
    /// Name.
    pub name: String,
    /// Proportion of vertices simplified, 0 to 1: the least and the greatest
    /// of its instances.
    pub theta: [f64; 2],
    /// Whether the configured policies choose theta, and not the slider.
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

/// How a value must be marked.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ValueMark {
    /// Good and in its normal band.
    #[default]
    Normal,
    /// Good, outside its normal band.
    Warning,
    /// Good, and needs action.
    Alarm,
    /// Doubtful.
    Uncertain {
        /// Why.
        reason: String,
    },
    /// Not to be relied on.
    Bad {
        /// Why.
        reason: String,
    },
    /// Drawn by an overlay that is late: what is shown is old, which says nothing of the value.
    LateDisplay,
}

/// The tags, as many as there may be: only rows in view are asked for.
pub trait TagRows {
    /// Number of tags that are listed.
    fn len(&self) -> usize;

    /// Number of tags.
    fn total(&self) -> usize;

    /// Whether more fit what was asked for than are listed.
    fn is_truncated(&self) -> bool;

    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One tag.
    fn row(&self, index: usize) -> TagRow;
}

/// A tag.
#[derive(Clone, Debug, Default)]
pub struct TagRow {
    /// Id.
    pub id: String,
    /// Name.
    pub name: String,
    /// Last value.
    pub value: String,
    /// Unit.
    pub unit: String,
    /// How it is marked.
    pub mark: ValueMark,
    /// Time since the value came.
    pub age: Option<Duration>,
    /// Equipment it is bound to.
    pub node: Option<String>,
    /// Origin of the value, live or not.
    pub origin: Origin,
}

/// A label at a piece of equipment.
#[derive(Clone, Debug, Default)]
pub struct Label<'a> {
    /// Equipment id.
    pub title: String,
    /// Where the equipment is on the screen, points.
    pub anchor: Pos2,
    /// Distance from the camera, metres: nearer labels come first.
    pub distance: f32,
    /// Lines.
    pub lines: Vec<LabelLine<'a>>,
    /// Whether the equipment is selected.
    pub selected: bool,
    /// Whether the equipment is in alarm: its label comes before others.
    pub alarmed: bool,
    /// Whether the equipment is behind other equipment.
    pub hidden: bool,
}

/// A line of a label.
#[derive(Clone, Debug, Default)]
pub struct LabelLine<'a> {
    /// Caption.
    pub caption: &'a str,
    /// Value with unit.
    pub text: &'a str,
    /// How it is marked.
    pub mark: ValueMark,
    /// Time since the value came.
    pub age: Option<Duration>,
    /// Origin of the value, live or not.
    pub origin: Origin,
}

/// State of a plugin's link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkIndicator {
    /// It has no link.
    #[default]
    None,
    /// Up.
    Up,
    /// Connecting.
    Waiting,
    /// Down, or the plugin failed.
    Down,
}

/// A plugin instance.
#[derive(Clone, Debug, Default)]
pub struct PluginRow {
    /// Name in the configuration.
    pub name: String,
    /// Plugin id and version.
    pub plugin: String,
    /// Link.
    pub link_indicator: LinkIndicator,
    /// What it last said.
    pub message: String,
    /// How its process is.
    pub process: String,
    /// Whether it waits for somebody or something to start it.
    pub can_start: bool,
    /// Origin that all its values have.
    pub origin: Origin,
}

/// The line at the bottom.
#[derive(Clone, Debug, Default)]
pub struct StatusBarModel {
    /// Time of day with seconds, so that a picture that stands still is noticed; none in
    /// pictures that nobody watches.
    pub clock: Option<String>,
    /// Tells whether the clock is shown where the panels are hidden.
    pub keeps_clock: bool,
    /// Triangles drawn.
    pub triangles: u64,
    /// Triangles at full detail.
    pub triangles_full: u64,
    /// Time of the last frame, milliseconds.
    pub frame_millis: f64,
    /// What the GPU took for a frame and its stages, milliseconds; empty where it cannot
    /// tell.
    pub gpu_millis: Vec<(&'static str, f64)>,
    /// Graphics device.
    pub device: String,
    /// Tags of good quality.
    pub good: usize,
    /// Tags of uncertain quality.
    pub uncertain: usize,
    /// Tags of bad quality.
    pub bad: usize,
    /// Faults of the configuration as it is on the disk, which is not what is shown.
    pub fault: Option<String>,
}

impl ValueMark {
    /// The more urgent of two: alarm, bad, warning, uncertain, normal.
    pub fn most_urgent(self, other: Self) -> Self {
        if other.urgency() > self.urgency() { other } else { self }
    }

    /// 0 is normal.
    pub fn urgency(&self) -> u8 {
        match self {
            Self::Normal => 0,
            Self::Uncertain { .. } => 1,
            Self::Warning => 2,
            Self::Bad { .. } | Self::LateDisplay => 3,
            Self::Alarm => 4,
        }
    }
}

/// An age in words: `0.4 s`, `12 s`, `3 min`, `5 h`.
pub fn age_text(age: Duration) -> String {
    match age.as_secs() {
        0..10 => format!("{:.1} s", age.as_secs_f64()),
        seconds @ 10..120 => format!("{seconds} s"),
        seconds @ 120..7200 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3600),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_read_well() {
        let check =
            |millis, expected| assert_eq!(age_text(Duration::from_millis(millis)), expected);
        check(400, "0.4 s");
        check(12_900, "12 s");
        check(180_000, "3 min");
        check(7_200_000, "2 h");
    }

    #[test]
    fn the_most_urgent_mark_wins() {
        let bad = ValueMark::Bad { reason: "stale".into() };
        assert_eq!(ValueMark::Warning.most_urgent(bad.clone()), bad);
        assert_eq!(ValueMark::Alarm.most_urgent(bad.clone()), ValueMark::Alarm);
        assert_eq!(ValueMark::Normal.most_urgent(ValueMark::Normal), ValueMark::Normal);
    }
}
