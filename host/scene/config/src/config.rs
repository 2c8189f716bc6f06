//! A configuration that can be used: references resolved, numbers in range.

use std::collections::BTreeMap;

use busbar_types::ValueKind;
use serde_json::Value;

use crate::Band;
use crate::alarms::{AlarmConfig, AlarmHandlingConfig};
use crate::changes::Fingerprints;
use crate::equipment::EquipmentConfig;
use crate::model_scene::ModelSceneConfig;
use crate::moving_parts::MovingPartConfig;
use crate::plugins::{PluginConfig, SignatureConfig, SupervisionConfig};
use crate::scene::SceneConfig;
use crate::service::{LogConfig, MetricsConfig};
use crate::simulate::SimulateConfig;
use crate::theta::ThetaConfig;
use crate::view::{CameraConfig, ViewConfig};
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
    /// Plugins that tell people of alarms.
    pub notifications: Vec<NotificationConfig>,
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
    /// Scene of the file that is shown; the default scene of the file where missing.
    pub scene: Option<ModelSceneConfig>,
    /// Name of the plugin instance that simplifies it.
    pub optimizer: Option<String>,
    /// Theta, the share of vertices collapsed, where a node does not choose one.
    pub theta: ThetaConfig,
    /// Parts of it that move with a switch.
    pub moving_parts: Vec<MovingPartConfig>,
    /// JSON pointer; the file is at its `/file`.
    pub pointer: String,
}

/// A tag: one live value.
#[derive(Clone, Debug, PartialEq)]
pub struct TagConfig {
    /// Name shown to people; the id where the text gives no name.
    pub name: String,
    /// Type of its value.
    pub value_type: ValueKind,
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

/// Plugin that tells people of alarms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotificationConfig {
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
