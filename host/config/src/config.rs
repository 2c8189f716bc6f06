//! A configuration that can be used: references resolved, numbers in range.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::alarms::{AlarmConfig, AlarmHandlingConfig};
use crate::changes::Fingerprints;
use crate::equipment::EquipmentConfig;
use crate::plugins::{PluginConfig, SignatureConfig, SupervisionConfig};
use crate::scene::SceneConfig;
use crate::service::{LogConfig, MetricsConfig};
use crate::simulate::SimulateConfig;
use crate::{Diagnostic, Positions};

/// A valid configuration.
///
/// Each item keeps the JSON pointer of its value, so that a later fault (a
/// missing file, an unknown plugin) can be placed with
/// [`Positions::diagnostic`].
#[derive(Clone, Debug)]
pub struct Config {
    /// Directories that plugins are looked for in, in order of preference.
    pub plugin_directories: Vec<DirectoryConfig>,
    /// How plugins whose process died are started again.
    pub supervision: SupervisionConfig,
    /// Who must have signed every plugin library.
    pub signature: Option<SignatureConfig>,
    /// Plugin instances by the name that the rest of the configuration uses.
    pub plugins: BTreeMap<String, PluginConfig>,
    /// Models by name.
    pub models: BTreeMap<String, ModelConfig>,
    /// Scene nodes.
    pub scene: SceneConfig,
    /// What equipment is called, by id.
    pub equipment: BTreeMap<String, EquipmentConfig>,
    /// Tags by id.
    pub tags: BTreeMap<String, TagConfig>,
    /// Which tag shows at which node, in the order of the text.
    pub bindings: Vec<BindingConfig>,
    /// Alarms by id.
    pub alarms: BTreeMap<String, AlarmConfig>,
    /// How alarms are handled.
    pub alarm_handling: AlarmHandlingConfig,
    /// Overlay plugins, drawn in this order.
    pub overlays: Vec<OverlayConfig>,
    /// Plugins whose records faceplates show, in this order.
    pub records: Vec<RecordsConfig>,
    /// The chart that stands in the scene.
    pub chart: Option<ChartConfig>,
    /// Cameras by name.
    pub cameras: BTreeMap<String, CameraConfig>,
    /// How the first picture looks.
    pub view: ViewConfig,
    /// Where results of optimisers are kept.
    pub cache: CacheConfig,
    /// The log file of `busbar view`, if any.
    pub log: Option<LogConfig>,
    /// Where numbers about it are served, if anywhere.
    pub metrics: Option<MetricsConfig>,
    /// Of what goes once it is loaded.
    pub fingerprints: Fingerprints,
    /// Where everything stands in the text.
    pub positions: Positions,
    /// Faults that do not stop Busbar.
    pub warnings: Vec<Diagnostic>,
}

impl Config {
    /// Without what only loading needs, which is most of it: nodes, names and positions.
    pub fn loaded(self) -> Self {
        Self {
            scene: SceneConfig::default(),
            equipment: BTreeMap::new(),
            positions: Positions::default(),
            ..self
        }
    }
}

/// A directory that holds plugins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DirectoryConfig {
    /// Path as written: relative to the configuration file, or absolute.
    pub path: String,
    /// JSON pointer.
    pub pointer: String,
}

/// A model.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelConfig {
    /// Path as written: relative to the configuration file.
    pub file: String,
    /// Name of the plugin instance that simplifies it.
    pub optimizer: Option<String>,
    /// How much of it is collapsed, where a node does not say otherwise.
    pub theta: ThetaConfig,
    /// Parts of it that move with a switch.
    pub moving_parts: Vec<MovingPartConfig>,
    /// JSON pointer; the file is at its `/file`.
    pub pointer: String,
}

/// A part of a model that moves with a switch, in the part's own space.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingPartConfig {
    /// Name of the model's node.
    pub part: String,
    /// What moves it.
    pub mechanism: String,
    /// The position that the file shows.
    pub modelled: EndConfig,
    /// A point of the hinge's axis, metres.
    pub pivot: [f32; 3],
    /// Its direction; not all zero.
    pub axis: [f32; 3],
    /// By how much it turns, right-handed.
    pub degrees: f32,
    /// By how much it shifts, metres.
    pub travel: [f32; 3],
    /// Factors by which it folds.
    pub scale: [f32; 3],
    /// JSON pointer.
    pub pointer: String,
}

/// An end of a switch's way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "End")]
pub enum EndConfig {
    /// It conducts.
    #[default]
    Closed,
    /// It does not.
    Open,
}

/// How theta, the share of vertices collapsed, is chosen; all are 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub enum ThetaConfig {
    /// The same from everywhere.
    Fixed(f64),
    /// By the distance from the eye to an instance's bounds.
    Distance {
        /// The first begins at 0, the others in ascending order; theta does
        /// not fall. At least one, at most [`MAX_THETA_LEVELS`](crate::MAX_THETA_LEVELS).
        levels: Vec<ThetaLevelConfig>,
        /// Share of a distance by which the eye must come back before detail
        /// returns.
        hysteresis: f64,
    },
    /// By the error that shows on the screen.
    ScreenError {
        /// Pixels.
        max_pixels: f64,
        /// Share of it that must be to spare before detail goes.
        hysteresis: f64,
    },
}

/// One level of detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThetaLevelConfig {
    /// Metres beyond which it holds.
    pub beyond: f64,
    /// Share of vertices collapsed, 0 to 1.
    pub theta: f64,
}

/// A piece of equipment in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeConfig {
    /// Equipment id, used once in the scene.
    pub id: String,
    /// Index of the node it hangs under, an earlier one.
    pub parent: Option<usize>,
    /// Transform to the parent's space.
    pub transform: TransformConfig,
    /// Name of the model shown here.
    pub model: Option<String>,
    /// How much of it is collapsed here; none where the model says it.
    pub theta: Option<ThetaConfig>,
    /// JSON pointer.
    pub pointer: String,
}

/// Scale, then rotate about x, y and z in turn, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformConfig {
    /// Metres.
    pub translation: [f32; 3],
    /// Degrees about x, y and z.
    pub rotation_degrees: [f32; 3],
    /// Factors along x, y and z; none is zero.
    pub scale: [f32; 3],
}

/// A tag: one live value.
#[derive(Clone, Debug, PartialEq)]
pub struct TagConfig {
    /// What people call it; the id where the text gives no name.
    pub name: String,
    /// Type of its value.
    pub value_type: TagType,
    /// Unit, such as `°C`; may be empty.
    pub unit: String,
    /// Plausible measuring range: outside it, quality is uncertain.
    pub range: Band,
    /// Normal band: outside it, the value is abnormal.
    pub limits: Band,
    /// Age in milliseconds past which a value is stale.
    pub freshness_millis: u64,
    /// Factor and offset from the number that comes to the tag's unit.
    pub scale: Option<[f64; 2]>,
    /// A number nearer than this to the one before does not change it; 0 for none.
    pub dead_band: f64,
    /// Where it comes from.
    pub origin: OriginConfig,
    /// How it moves where its device is simulated.
    pub simulate: SimulateConfig,
    /// JSON pointer.
    pub pointer: String,
}

/// Where a tag comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum OriginConfig {
    /// A plugin reads it.
    Source(SourceConfig),
    /// It is worked out of other tags, whose ids stand in braces. Whether it can be
    /// read is not checked here.
    Expression(String),
    /// The program that embeds the viewer sets it.
    Host,
}

impl TagConfig {
    /// Where a plugin reads it, if one does.
    pub fn source(&self) -> Option<&SourceConfig> {
        match &self.origin {
            OriginConfig::Source(source) => Some(source),
            OriginConfig::Expression(_) | OriginConfig::Host => None,
        }
    }

    /// Whether the program that embeds the viewer sets it.
    pub fn is_host_written(&self) -> bool {
        self.origin == OriginConfig::Host
    }

    /// What it is worked out by, if it is derived.
    pub fn expression(&self) -> Option<&str> {
        match &self.origin {
            OriginConfig::Source(_) | OriginConfig::Host => None,
            OriginConfig::Expression(expression) => Some(expression),
        }
    }
}

/// Type of a tag's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TagType {
    /// A number with fraction.
    F64,
    /// A whole number.
    I64,
    /// On or off.
    Bool,
    /// A switch position: intermediate, off, on, or faulty.
    DoublePoint,
}

/// An interval, open where a bound is missing. `low` is less than `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Band {
    /// Least value inside.
    pub low: Option<f64>,
    /// Greatest value inside.
    pub high: Option<f64>,
}

/// Where a plugin reads a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceConfig {
    /// Name of the plugin instance that reads it.
    pub plugin: String,
    /// Address, which only the plugin understands.
    pub address: Value,
    /// JSON pointer; the address is at its `/address`.
    pub pointer: String,
}

/// A tag shown at a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BindingConfig {
    /// Tag id.
    pub tag: String,
    /// Equipment id: a scene node's, or `node/part` for a node of its model,
    /// whose existence is not checked here.
    pub node: String,
    /// What the tag is to the node.
    pub role: String,
    /// JSON pointer.
    pub pointer: String,
}

/// An overlay that is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OverlayConfig {
    /// Name of the plugin instance.
    pub plugin: String,
    /// JSON pointer.
    pub pointer: String,
}

/// Records that faceplates show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordsConfig {
    /// Name of the plugin instance.
    pub plugin: String,
    /// JSON pointer.
    pub pointer: String,
}

/// A chart that stands in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartConfig {
    /// Name of the plugin instance whose chart it is.
    pub plugin: String,
    /// Where the foot of its first axis stands, metres.
    pub position: [f64; 3],
    /// Turn about y, degrees; at 0 it is read from +z.
    pub yaw_degrees: f64,
    /// Width, height of axes, and depth of time, metres.
    pub size: [f64; 3],
    /// Whether the camera goes where a record becomes abnormal.
    pub follows: bool,
    /// JSON pointer.
    pub pointer: String,
}

/// A place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraConfig {
    /// Where the camera stands, in metres.
    pub eye: [f32; 3],
    /// What it looks at, in metres; never the eye itself.
    pub target: [f32; 3],
    /// Vertical field of view in degrees.
    pub fov_degrees: f32,
    /// How depth shows.
    pub projection: ProjectionConfig,
    /// JSON pointer.
    pub pointer: String,
}

/// How depth shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProjectionConfig {
    /// What is far is small.
    Perspective,
    /// All is as large as at the target.
    Orthographic {
        /// From the lower to the upper edge of a picture 16:9 or wider, metres; none
        /// for as much as a perspective view has at the target.
        height: Option<f32>,
    },
}

/// How the first picture looks.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewConfig {
    /// Name of the camera; none to frame the whole scene.
    pub camera: Option<String>,
    /// Background as sRGB red, green and blue.
    pub background: [u8; 3],
    /// What a picture may cost; none where that goes by the device.
    pub quality: Option<QualityConfig>,
    /// Samples a pixel, 1 or 4; none where they follow the quality.
    pub samples: Option<u32>,
    /// Shows a ground with a grid below the lowest point.
    pub ground: bool,
    /// Lets what is far fade into the background.
    pub fog: bool,
    /// Cuts open what lies before a plane.
    pub section: Option<SectionConfig>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Factor on the thetas of models and nodes.
    pub theta_scale: f64,
    /// What a frame in a window is to take, milliseconds; none where it may take what
    /// its detail does.
    pub target_frame_millis: Option<f64>,
    /// What a change of detail takes in a window, seconds; 0 is at once.
    pub morph_seconds: f64,
    /// What a window takes from one camera to another, seconds; 0 is at once.
    pub transition_seconds: f32,
    /// Whether a window's camera turns on for a moment after a drag.
    pub inertia: bool,
    /// Colours of panels and labels.
    pub theme: ThemeConfig,
    /// Factor on the size of panels and labels.
    pub scale: f32,
    /// Path of a font as written, relative to the configuration file; none for the one
    /// built in.
    pub font: Option<String>,
    /// Graphics device, by number or part of its name; none for the best.
    pub device: Option<String>,
    /// JSON pointer; of a view that may be absent.
    pub pointer: String,
}

/// Colours of panels and labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Theme")]
pub enum ThemeConfig {
    /// Light grey.
    #[default]
    Light,
    /// Dark grey, for night shifts.
    Dark,
}

/// What a picture may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityConfig {
    /// For remote desktops and software rasterisers: the shape of things, as cheap as
    /// can be.
    Low,
    /// Materials as they reflect light.
    Medium,
    /// The same with shadows and contact shades.
    High,
}

/// A plane that cuts equipment open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionConfig {
    /// Towards what is cut away, a unit vector; y is up.
    pub normal: [f32; 3],
    /// From the origin along the normal, metres.
    pub distance: f32,
}

/// Where results of optimisers are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CacheConfig {
    /// Path as written: relative to the configuration file, or absolute; none
    /// for the user's cache directory.
    pub directory: Option<String>,
    /// Size past which old results go, in 10^6 bytes; 0 for no cache.
    pub max_megabytes: u32,
    /// JSON pointer; of a cache that may be absent.
    pub pointer: String,
}

impl Default for TransformConfig {
    fn default() -> Self {
        Self { translation: [0.0; 3], rotation_degrees: [0.0; 3], scale: [1.0; 3] }
    }
}

impl Band {
    /// Whether a value lies inside.
    pub fn contains(&self, value: f64) -> bool {
        self.low.is_none_or(|low| value >= low) && self.high.is_none_or(|high| value <= high)
    }
}
