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

/// Validated configuration of a view.
///
/// Each item keeps the JSON pointer of its value. So a later fault (a missing file, an unknown
/// plugin) can be placed with [`Positions::diagnostic`].
///
/// Each item keeps the JSON pointer of its value, so that a later fault (a
/// missing file, an unknown plugin) can be placed with
/// [`Positions::diagnostic`].
#[derive(Clone, Debug)]
pub struct Config {
    /// Directories that plugins are looked for in, in order of preference.
    pub plugin_directories: Vec<DirectoryConfig>,
    /// Restart policy of plugins whose process crashed.
    pub supervision: SupervisionConfig,
    /// Key that must have signed every plugin library.
    pub signature: Option<SignatureConfig>,
    /// Plugin instances by the name that the rest of the configuration uses.
    pub plugins: BTreeMap<String, PluginConfig>,
    /// Models, by their names.
    pub models: BTreeMap<String, ModelConfig>,
    /// Nodes of the scene.
    pub scene: SceneConfig,
    /// Names of equipment, by id.
    pub equipment: BTreeMap<String, EquipmentConfig>,
    /// Tags, by their ids.
    pub tags: BTreeMap<String, TagConfig>,
    /// Bindings of tags to nodes, in the order of the text.
    pub bindings: Vec<BindingConfig>,
    /// Alarms, by their ids.
    pub alarms: BTreeMap<String, AlarmConfig>,
    /// Settings of all alarms.
    pub alarm_handling: AlarmHandlingConfig,
    /// Overlay plugins, drawn in this order.
    pub overlays: Vec<OverlayConfig>,
    /// Plugins whose records faceplates show, in this order.
    pub records: Vec<RecordsConfig>,
    /// Chart in the scene.
    pub chart: Option<ChartConfig>,
    /// Cameras, by their names.
    pub cameras: BTreeMap<String, CameraConfig>,
    /// Settings of the first picture.
    pub view: ViewConfig,
    /// Location of the cache for optimizer results.
    pub cache: CacheConfig,
    /// The log file of `busbar view`, if any.
    pub log: Option<LogConfig>,
    /// Address on which metrics are served, if any.
    pub metrics: Option<MetricsConfig>,
    /// Hashes of the parts that are dropped after loading.
    pub fingerprints: Fingerprints,
    /// Positions of all values in the text.
    pub positions: Positions,
    /// Faults that do not stop Busbar.
    pub warnings: Vec<Diagnostic>,
}

impl Config {
    /// Drops what only loading needs, which is most of it: nodes, names and positions.
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
    /// JSON pointer of the folder.
    pub pointer: String,
}

/// Model of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelConfig {
    /// Path as written: relative to the configuration file.
    pub file: String,
    /// Name of the plugin instance that simplifies it.
    pub optimizer: Option<String>,
    /// Theta, the share of vertices collapsed, where a node does not choose one.
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
    /// Name of the mechanism that moves it.
    pub mechanism: String,
    /// The position that the file shows.
    pub modelled: EndConfig,
    /// A point of the hinge's axis, metres.
    pub pivot: [f32; 3],
    /// Direction of the axis; not all zero.
    pub axis: [f32; 3],
    /// Angle of the rotation, degrees, right-handed.
    pub degrees: f32,
    /// Translation of the part, metres.
    pub travel: [f32; 3],
    /// Factors by which it folds.
    pub scale: [f32; 3],
    /// JSON pointer of the part.
    pub pointer: String,
}

/// An end of a switch's way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "End")]
pub enum EndConfig {
    /// The contact is closed and conducts.
    #[default]
    Closed,
    /// The contact is open.
    Open,
}

/// Choice of theta, the share of vertices collapsed, 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub enum ThetaConfig {
    /// The same from everywhere.
    Fixed(f64),
    /// Levels by the distance from the eye to an instance's bounds.
    Distance {
        /// The first begins at 0, the others in ascending order; theta does
        /// not fall. At least one, at most [`MAX_THETA_LEVELS`](crate::MAX_THETA_LEVELS).
        levels: Vec<ThetaLevelConfig>,
        /// Share of a distance by which the eye must come back before detail
        /// returns.
        hysteresis: f64,
    },
    /// Limit of the screen-space error.
    ScreenError {
        /// Largest screen-space error, pixels.
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
    /// Theta of the node; none where the model's applies.
    pub theta: Option<ThetaConfig>,
    /// JSON pointer of the node.
    pub pointer: String,
}

/// Scale, then rotate about x, y and z in turn, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformConfig {
    /// Translation of the node, metres.
    pub translation: [f32; 3],
    /// Degrees about x, y and z.
    pub rotation_degrees: [f32; 3],
    /// Factors along x, y and z; none is zero.
    pub scale: [f32; 3],
}

/// A tag: one live value.
#[derive(Clone, Debug, PartialEq)]
pub struct TagConfig {
    /// Name shown to people; the id where the text gives no name.
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
    /// Origin of its value.
    pub origin: OriginConfig,
    /// Movement of the value where its device is simulated.
    pub simulate: SimulateConfig,
    /// JSON pointer of the tag.
    pub pointer: String,
}

/// Origin of a tag's value.
#[derive(Clone, Debug, PartialEq)]
pub enum OriginConfig {
    /// A plugin reads it.
    Source(SourceConfig),
    /// Expression over other tags, whose ids stand in braces. Its syntax is not checked here.
    Expression(String),
    /// The program that embeds the viewer sets it.
    Host,
}

impl TagConfig {
    /// Returns the source at a plugin, if there is one.
    pub fn source(&self) -> Option<&SourceConfig> {
        match &self.origin {
            OriginConfig::Source(source) => Some(source),
            OriginConfig::Expression(_) | OriginConfig::Host => None,
        }
    }

    /// Reports whether the embedding program writes the tag.
    pub fn is_host_written(&self) -> bool {
        self.origin == OriginConfig::Host
    }

    /// Returns the expression of a derived tag.
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
    /// Type of whole numbers.
    I64,
    /// Type of on and off.
    Bool,
    /// A switch position: intermediate, off, on, or faulty.
    DoublePoint,
}

/// An interval, open where a bound is missing. `low` is less than `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Band {
    /// Least value within the band.
    pub low: Option<f64>,
    /// Greatest value within the band.
    pub high: Option<f64>,
}

/// Source of a tag at a plugin.
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
    /// Id of the tag.
    pub tag: String,
    /// Equipment id: a scene node's, or `node/part` for a node of its model,
    /// whose existence is not checked here.
    pub node: String,
    /// Role of the value for the node.
    pub role: String,
    /// JSON pointer of the binding.
    pub pointer: String,
}

/// Overlay that is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OverlayConfig {
    /// Name of the plugin instance.
    pub plugin: String,
    /// JSON pointer of the overlay.
    pub pointer: String,
}

/// Records that faceplates show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordsConfig {
    /// Name of the plugin instance.
    pub plugin: String,
    /// JSON pointer of the entry.
    pub pointer: String,
}

/// Chart in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartConfig {
    /// Name of the plugin instance whose chart it is.
    pub plugin: String,
    /// Position of the first axis's foot, metres.
    pub position: [f64; 3],
    /// Turn about y, degrees; at 0 it is read from +z.
    pub yaw_degrees: f64,
    /// Width, height of axes, and depth of time, metres.
    pub size: [f64; 3],
    /// True where the camera moves to equipment whose record becomes abnormal.
    pub follows: bool,
    /// JSON pointer of the chart.
    pub pointer: String,
}

/// A place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraConfig {
    /// Position of the camera, metres.
    pub eye: [f32; 3],
    /// Point that the camera looks at, metres; never the eye itself.
    pub target: [f32; 3],
    /// Vertical field of view in degrees.
    pub fov_degrees: f32,
    /// Projection of the camera.
    pub projection: ProjectionConfig,
    /// JSON pointer of the camera.
    pub pointer: String,
}

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProjectionConfig {
    /// Perspective projection: distant objects are smaller.
    Perspective,
    /// Orthographic projection: no perspective.
    Orthographic {
        /// Visible height of a picture 16:9 or wider, metres; none for as much as a perspective
        /// view shows at the target.
        height: Option<f32>,
    },
}

/// Settings of the first picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewConfig {
    /// Name of the camera; none to frame the whole scene.
    pub camera: Option<String>,
    /// Background as sRGB red, green and blue.
    pub background: [u8; 3],
    /// Rendering quality; none where it follows the device.
    pub quality: Option<QualityConfig>,
    /// Samples a pixel, 1 or 4; none where they follow the quality.
    pub samples: Option<u32>,
    /// Shows a ground with a grid below the lowest point.
    pub ground: bool,
    /// Fades distant objects into the background.
    pub fog: bool,
    /// Section plane that cuts the scene open.
    pub section: Option<SectionConfig>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Factor on the thetas of models and nodes.
    pub theta_scale: f64,
    /// Target time of a frame in a window, milliseconds; none for no target.
    pub target_frame_millis: Option<f64>,
    /// Duration of a change of detail in a window, seconds; 0 is at once.
    pub morph_seconds: f64,
    /// Duration of a camera transition in a window, seconds; 0 is at once.
    pub transition_seconds: f32,
    /// True where a window's camera turns on for a moment after a drag.
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
}

/// Colours of panels and labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Theme")]
pub enum ThemeConfig {
    /// Theme of light grey.
    #[default]
    Light,
    /// Dark grey, for night shifts.
    Dark,
}

/// Rendering quality of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityConfig {
    /// Lowest cost, for remote desktops and software rasterizers: shapes alone.
    Low,
    /// Materials as they reflect light.
    Medium,
    /// The same with shadows and contact shades.
    High,
}

/// A plane that cuts equipment open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionConfig {
    /// Normal towards the part that is cut away, a unit vector; y is up.
    pub normal: [f32; 3],
    /// Distance of the plane from the origin along the normal, metres.
    pub distance: f32,
}

/// Cache of optimizer results.
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
    /// Reports whether a value lies within the band.
    pub fn contains(&self, value: f64) -> bool {
        self.low.is_none_or(|low| value >= low) && self.high.is_none_or(|high| value <= high)
    }
}
