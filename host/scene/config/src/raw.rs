//! The configuration as typed. The JSON Schema is generated from these types:
//! what they say here about shape and range is what is checked.

use std::collections::BTreeMap;

use busbar_types::ValueKind;
use schemars::{JsonSchema, Schema, json_schema};
use serde::Deserialize;
use serde_json::Value;

use crate::alarm_sources::RawAlarmSource;
use crate::alarms::{RawAlarm, RawAlarmHandling};
use crate::equipment::RawEquipment;
use crate::limits::*;
use crate::model_scene::RawModelScene;
use crate::moving_parts::RawMovingPart;
use crate::plugins::{Isolation, RawPlugin, RawSignature, RawSupervision};
use crate::service::{RawLog, RawMetrics};
use crate::simulate::RawSimulate;
use crate::theta::RawTheta;
use crate::view::ThemeConfig;

/// Configuration of a Busbar viewer: plugins, models, scene, tags and view.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Busbar configuration")]
pub(crate) struct RawConfig {
    /// The JSON Schema of this file, for editors.
    #[serde(rename = "$schema", default)]
    #[schemars(extend("examples" = ["busbar.schema.json"]))]
    pub(crate) _schema: String,
    /// Version of this format: 1.
    #[serde(rename = "version")]
    #[schemars(extend("const" = 1), extend("examples" = [1]))]
    pub(crate) _version: u32,
    /// Directories that plugins are looked for in, relative to this file or
    /// absolute, in order of preference.
    #[serde(default)]
    #[schemars(length(max = MAX_PLUGIN_DIRECTORIES), inner(length(min = 1, max = MAX_PATH_BYTES)))]
    #[schemars(extend("examples" = [["plugins"]]))]
    pub(crate) plugin_directories: Vec<String>,
    /// Isolation of plugins that do not choose one.
    #[serde(default)]
    #[schemars(extend("examples" = ["process"]))]
    pub(crate) isolation: Isolation,
    /// Restart policy of plugins whose process crashed.
    #[serde(default)]
    pub(crate) supervision: RawSupervision,
    /// Key that must have signed every plugin library; none for no requirement.
    #[serde(default)]
    #[schemars(with = "RawSignature")]
    pub(crate) signature: Option<RawSignature>,
    /// Plugin instances, by the name that the rest of this file uses.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_PLUGINS))]
    pub(crate) plugins: BTreeMap<String, RawPlugin>,
    /// Models, by their names.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_MODELS))]
    pub(crate) models: BTreeMap<String, RawModel>,
    /// Lists of nodes that many places of the scene have in common, by name.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_TEMPLATES))]
    pub(crate) templates: BTreeMap<String, Vec<RawNode>>,
    /// Equipment shown, as nodes.
    #[schemars(extend("examples" = [[]]))]
    pub(crate) scene: Vec<RawNode>,
    /// Names of equipment besides its id, by id.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_EQUIPMENT))]
    pub(crate) equipment: BTreeMap<String, RawEquipment>,
    /// Live values, by tag id.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_TAGS))]
    pub(crate) tags: BTreeMap<String, RawTag>,
    /// Bindings of tags to equipment.
    #[serde(default)]
    #[schemars(length(max = MAX_BINDINGS))]
    pub(crate) bindings: Vec<RawBinding>,
    /// Alarms, by their ids.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_ALARMS))]
    pub(crate) alarms: BTreeMap<String, RawAlarm>,
    /// Settings of all alarms.
    #[serde(default)]
    pub(crate) alarm_handling: RawAlarmHandling,
    /// Plugin instances with the alarms of other systems, which decide on them; they are shown
    /// beside those decided here.
    #[serde(default)]
    #[schemars(length(max = MAX_PLUGINS))]
    #[schemars(extend("x-busbar-formerly" = ["alarm_handling/sources"]))]
    pub(crate) alarm_sources: Vec<RawAlarmSource>,
    /// Plugin instances that tell people of alarms who are not in the room.
    #[serde(default)]
    #[schemars(length(max = MAX_PLUGINS))]
    #[schemars(extend("examples" = [[{"instance": "mail"}]]))]
    pub(crate) notifications: Vec<RawNotifications>,
    /// Names of the plugin instances whose overlays are drawn, in this order.
    #[serde(default)]
    #[schemars(length(max = MAX_PLUGINS), extend("uniqueItems" = true))]
    #[schemars(extend("examples" = [["labels"]]))]
    pub(crate) overlays: Vec<String>,
    /// Names of the plugin instances whose records of work and assets faceplates show, in this order.
    #[serde(default)]
    #[schemars(length(max = MAX_PLUGINS), extend("uniqueItems" = true))]
    #[schemars(extend("examples" = [["work", "register"]]))]
    pub(crate) records: Vec<String>,
    /// Chart in the scene.
    #[serde(default)]
    #[schemars(with = "RawChart")]
    pub(crate) chart: Option<RawChart>,
    /// Places to look from, by name.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_CAMERAS))]
    pub(crate) cameras: BTreeMap<String, RawCamera>,
    /// Camera of the first picture, and its movement.
    #[serde(default)]
    pub(crate) camera: RawCameraStart,
    /// Quality of pictures, and what they may cost.
    #[serde(default)]
    pub(crate) graphics: RawGraphics,
    /// Colors, size and font of panels and labels.
    #[serde(default)]
    pub(crate) theme: RawTheme,
    /// Size of the window.
    #[serde(default)]
    pub(crate) window: RawWindow,
    /// Cache of optimizer results, so that the next start is quick.
    #[serde(default)]
    pub(crate) cache: RawCache,
    /// The log file of `busbar view`.
    #[serde(default)]
    pub(crate) log: RawLog,
    /// Numbers about `busbar view` for Prometheus; where missing none are served.
    #[serde(default)]
    #[schemars(with = "RawMetrics")]
    pub(crate) metrics: Option<RawMetrics>,
}

/// Plugin instance that tells people of alarms.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Notifications")]
pub(crate) struct RawNotifications {
    /// Name of the plugin instance that sends messages.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES), extend("examples" = ["mail"]))]
    pub(crate) instance: String,
}

/// A model file and how it is simplified.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Model")]
pub(crate) struct RawModel {
    /// A .gltf or .glb file, relative to this file.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES))]
    #[schemars(extend("examples" = ["models/transformer.glb"]))]
    pub(crate) file: String,
    /// Scene of the file that is shown, by name or by index from 0; the file's default scene
    /// where missing.
    #[serde(default)]
    pub(crate) scene: Option<RawModelScene>,
    /// Name of the plugin instance that simplifies it.
    #[serde(default)]
    #[schemars(extend("examples" = ["optimizer"]))]
    pub(crate) optimizer: Option<String>,
    /// Theta, the share of vertices collapsed, where a node does not choose one.
    #[serde(default)]
    pub(crate) theta: RawTheta,
    /// Parts of it that move with a switch.
    #[serde(default)]
    #[schemars(length(max = MAX_MOVING_PARTS))]
    pub(crate) moving_parts: Vec<RawMovingPart>,
}

/// A piece of equipment: placed, with what hangs under it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Node")]
pub(crate) struct RawNode {
    /// Equipment id (IEC 81346), used once in the scene; in a template, what follows
    /// the id of the node that the template hangs under.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    #[schemars(extend("examples" = ["=S12D1T1-TA1"]))]
    pub(crate) id: String,
    /// Name of the model shown here; none for a node that only groups others.
    #[serde(default)]
    #[schemars(extend("examples" = ["transformer"]))]
    pub(crate) model: Option<String>,
    /// Theta of the model here, instead of the model's own.
    #[serde(default)]
    #[schemars(with = "RawTheta")]
    pub(crate) theta: Option<RawTheta>,
    /// Transform from this node to its parent.
    #[serde(default)]
    pub(crate) transform: RawTransform,
    /// Name of a template: its nodes hang under this one, and under each copy. Each
    /// is called by the id of the node it hangs under here, followed by its own.
    #[serde(default)]
    #[schemars(extend("examples" = ["bay"]))]
    pub(crate) template: Option<String>,
    /// Nodes that hang under this one.
    #[serde(default)]
    pub(crate) children: Vec<RawNode>,
    /// Further copies of this node under the same parent. A node with
    /// instances has no children.
    #[serde(default)]
    pub(crate) instances: Vec<RawInstance>,
}

/// A further copy of a node.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Instance")]
pub(crate) struct RawInstance {
    /// Equipment id of the copy.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    #[schemars(extend("examples" = ["=S12D1T1-TA2"]))]
    pub(crate) id: String,
    /// Theta of the copy, instead of the node's.
    #[serde(default)]
    #[schemars(with = "RawTheta")]
    pub(crate) theta: Option<RawTheta>,
    /// Transform from the copy to its parent.
    #[serde(default)]
    pub(crate) transform: RawTransform,
}

/// Scale, then rotate about x, y and z in turn, then translate.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Transform")]
pub(crate) struct RawTransform {
    /// Metres along x, y and z.
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    #[schemars(extend("examples" = [[0, 0, 0]]))]
    pub(crate) translation: [f64; 3],
    /// Degrees about x, y and z, applied in that order.
    #[schemars(inner(range(min = -360.0, max = 360.0)), extend("examples" = [[0, 90, 0]]))]
    pub(crate) rotation_degrees: [f32; 3],
    /// One factor, or three along x, y and z. Not zero.
    #[schemars(schema_with = "scale_schema")]
    pub(crate) scale: RawScale,
}

/// A scale as typed.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum RawScale {
    /// The same along all axes.
    Uniform(f32),
    /// Along x, y and z.
    PerAxis([f32; 3]),
}

/// Tag with a live value.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Tag")]
pub(crate) struct RawTag {
    /// Name shown to people; the id where missing.
    #[serde(default)]
    #[schemars(length(max = MAX_NAME_BYTES), extend("examples" = ["Top oil"]))]
    pub(crate) name: Option<String>,
    /// Type of the value.
    #[serde(rename = "type")]
    #[schemars(extend("examples" = ["f64"]))]
    pub(crate) value_type: ValueKind,
    /// Unit shown behind the value.
    #[serde(default)]
    #[schemars(length(max = 32), extend("examples" = ["°C"]))]
    pub(crate) unit: String,
    /// Plausible measuring range: outside it, quality becomes uncertain.
    #[serde(default)]
    pub(crate) range: RawBand,
    /// Normal band: outside it, the value is abnormal and drawn in colour.
    #[serde(default)]
    pub(crate) limits: RawBand,
    /// Age in seconds past which a value is stale.
    #[serde(default = "default_freshness_seconds")]
    #[schemars(range(min = 0.05, max = 86_400.0), extend("examples" = [3]))]
    #[schemars(extend("x-busbar-formerly" = ["freshness_millis"]))]
    pub(crate) freshness_seconds: f64,
    /// Conversion from the plugin's number to the tag's unit; for type f64 alone.
    #[serde(default)]
    #[schemars(with = "RawTagScale")]
    pub(crate) scale: Option<RawTagScale>,
    /// A number nearer than this to the one shown does not change it, in the tag's unit.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("examples" = [0.1]))]
    #[schemars(extend("x-busbar-formerly" = ["dead_band"]))]
    pub(crate) deadband: f64,
    /// Source of the value.
    #[serde(default)]
    #[schemars(with = "RawSource")]
    #[schemars(extend("examples" = [{"instance": "plc", "address": {}}]))]
    pub(crate) source: Option<RawSource>,
    /// Instead of a source: a formula of other tags, their ids in braces.
    #[serde(default)]
    #[schemars(with = "String", length(min = 1, max = MAX_EXPRESSION_BYTES))]
    #[schemars(extend("examples" = ["sqrt(3) * {T1.U} * {T1.I} / 1000"]))]
    pub(crate) expression: Option<String>,
    /// Instead of a source: the program that embeds the viewer sets the value.
    #[serde(default)]
    pub(crate) set_by_host: bool,
    /// Movement of the value where `busbar simulate` takes the place of its device.
    #[serde(default)]
    pub(crate) simulate: RawSimulate,
}

/// A straight line: `number * factor + offset`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "TagScale")]
pub(crate) struct RawTagScale {
    /// Factor by which the number is multiplied.
    #[schemars(extend("examples" = [0.1]))]
    pub(crate) factor: f64,
    /// Offset added after the multiplication.
    #[schemars(extend("examples" = [-50]))]
    pub(crate) offset: f64,
}

impl Default for RawTagScale {
    fn default() -> Self {
        Self { factor: 1.0, offset: 0.0 }
    }
}

/// An interval, open where a bound is null or missing.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Band")]
pub(crate) struct RawBand {
    /// Least value inside; less than `high`.
    #[schemars(extend("examples" = [-40]))]
    pub(crate) low: Option<f64>,
    /// Greatest value within the band.
    #[schemars(extend("examples" = [95]))]
    pub(crate) high: Option<f64>,
}

/// Source of a tag.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Source")]
pub(crate) struct RawSource {
    /// Name of the plugin instance that reads it.
    #[schemars(extend("examples" = ["plc"]), extend("x-busbar-formerly" = ["plugin"]))]
    pub(crate) instance: String,
    /// Address, handed to the plugin unchanged.
    pub(crate) address: Value,
}

/// A tag shown at a node.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Binding")]
pub(crate) struct RawBinding {
    /// Id of the tag.
    #[schemars(extend("examples" = ["T1.TopOil"]))]
    pub(crate) tag: String,
    /// Equipment id of a scene node, or that id, `/` and the name of a node
    /// of its model.
    #[schemars(extend("examples" = ["=S12D1T1-TA1/bushing 1U"]))]
    pub(crate) node: String,
    /// Role of the value for the node.
    #[serde(default = "default_role")]
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    #[schemars(extend("examples" = ["value"]))]
    pub(crate) role: String,
}

/// Chart in the scene.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Chart")]
pub(crate) struct RawChart {
    /// Name of the plugin instance whose chart it is.
    #[schemars(extend("examples" = ["gases"]), extend("x-busbar-formerly" = ["plugin"]))]
    pub(crate) instance: String,
    /// Position of the first axis's foot, in metres.
    #[serde(default)]
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    pub(crate) position: [f64; 3],
    /// Turn about the vertical, in degrees; at 0 it is read from +z.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub(crate) yaw_degrees: f64,
    /// Width, height of axes, and depth of time, in metres.
    #[serde(default = "default_chart_size")]
    #[schemars(inner(range(min = MIN_VIEW_METRES, max = MAX_COORDINATE_METRES)))]
    pub(crate) size: [f64; 3],
    /// Moves the camera to equipment whose record becomes abnormal.
    #[serde(default)]
    pub(crate) follow: bool,
}

fn default_chart_size() -> [f64; 3] {
    [24.0, 8.0, 16.0]
}

/// A place to look from.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Camera")]
pub(crate) struct RawCamera {
    /// Position of the camera, in metres.
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    #[schemars(extend("examples" = [[12, 6, 14]]))]
    pub(crate) eye: [f64; 3],
    /// Point that the camera looks at, in metres.
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    #[schemars(extend("examples" = [[0, 3, 0]]))]
    pub(crate) target: [f64; 3],
    /// Vertical field of view in degrees.
    #[serde(default = "default_fov_degrees")]
    #[schemars(range(min = 1.0, max = 150.0), extend("examples" = [45]))]
    pub(crate) fov_degrees: f32,
    /// Projection of the camera: with perspective, or without.
    #[serde(default)]
    #[schemars(extend("examples" = ["orthographic"]))]
    pub(crate) projection: RawProjection,
    /// Visible height of an orthographic picture 16:9 or wider, in metres; where missing, as much
    /// as a perspective one shows at the target.
    #[serde(default)]
    #[schemars(range(min = MIN_VIEW_METRES, max = MAX_COORDINATE_METRES))]
    #[schemars(extend("examples" = [40]))]
    pub(crate) height: Option<f32>,
}

/// Projection of a camera.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Projection")]
pub(crate) enum RawProjection {
    /// Perspective projection: distant objects are smaller.
    #[default]
    Perspective,
    /// Orthographic projection, for plans and elevations.
    Orthographic,
}

/// Camera of the first picture, and its movement.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "CameraStart")]
pub(crate) struct RawCameraStart {
    /// Name of the camera; none to frame the whole scene.
    #[schemars(extend("examples" = ["overview"]), extend("x-busbar-formerly" = ["../view/camera"]))]
    pub(crate) start: Option<String>,
    /// Section plane that cuts the scene open.
    #[schemars(extend("examples" = [{ "normal": [0, 1, 0], "distance": 2 }]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/section"]))]
    pub(crate) section: Option<RawSection>,
    /// Seconds in which a window goes from one camera to another; 0 for at once.
    #[schemars(range(min = 0.0, max = MAX_TRANSITION_SECONDS), extend("examples" = [0.6]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/transition_seconds"]))]
    pub(crate) transition_seconds: f64,
    /// Lets a window's camera turn on for a moment after a drag.
    #[schemars(extend("examples" = [true]), extend("x-busbar-formerly" = ["../view/inertia"]))]
    pub(crate) inertia: bool,
}

/// Quality of pictures, and what they may cost.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Graphics")]
pub(crate) struct RawGraphics {
    /// Rendering quality: `low` for remote desktops and software rasterizers, `high` for graphics
    /// cards. Where missing, `medium`, and `low` in live views that the processor draws.
    #[schemars(extend("examples" = ["medium"]), extend("x-busbar-formerly" = ["../view/quality"]))]
    pub(crate) quality: Option<RawQuality>,
    /// Samples a pixel: 1, or 4 for smooth edges; where missing, 1 at quality `low`,
    /// else 4.
    #[schemars(extend("enum" = [1, 4]), extend("examples" = [4]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/samples"]))]
    pub(crate) samples: Option<u32>,
    /// Shows a ground with a grid of 1 m and 10 m below the lowest point; not at
    /// quality `low`.
    #[schemars(extend("examples" = [true]), extend("x-busbar-formerly" = ["../view/ground"]))]
    pub(crate) ground: bool,
    /// Fades distant objects into the background; not at quality `low`.
    #[schemars(extend("examples" = [true]), extend("x-busbar-formerly" = ["../view/fog"]))]
    pub(crate) fog: bool,
    /// Every theta of models and nodes is multiplied by this, up to 1; 0 shows
    /// all in full detail.
    #[schemars(range(min = 0.0, max = MAX_THETA_SCALE), extend("examples" = [1]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/theta_scale"]))]
    pub(crate) theta_scale: f64,
    /// Seconds that a frame in a window is to take. Where it takes longer, thetas
    /// that follow the error on the screen let more of it show; 0 for as long as it
    /// takes.
    #[schemars(range(min = 0.0, max = MAX_FRAME_SECONDS), extend("examples" = [0.0166]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/target_frame_ms"]))]
    pub(crate) target_frame_seconds: f64,
    /// Seconds in which a change of detail is made in a window, by degrees so that nothing
    /// pops; 0 for at once.
    #[schemars(range(min = 0.0, max = MAX_MORPH_SECONDS), extend("examples" = [0.25]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/morph_seconds"]))]
    pub(crate) morph_seconds: f64,
    /// Graphics device: its number among those there are, or a part of its name; where
    /// missing, the best. `BUSBAR_DEVICE` in the environment goes before.
    #[schemars(length(min = 1, max = 256), extend("examples" = ["llvmpipe"]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/device"]))]
    pub(crate) device: Option<String>,
}

/// Colors, size and font of panels and labels.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "ThemeSettings")]
pub(crate) struct RawTheme {
    /// Colors of panels and labels: `light`, or `dark` for night shifts. `N` in a window
    /// changes them.
    #[schemars(extend("examples" = ["dark"]), extend("x-busbar-formerly" = ["../view/theme"]))]
    pub(crate) colors: ThemeConfig,
    /// Background of the scene as `#rrggbb`, sRGB.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"), extend("examples" = ["#d8dadd"]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/background"]))]
    pub(crate) background: String,
    /// Factor on the size of panels and labels.
    #[schemars(range(min = MIN_PANEL_SCALE, max = MAX_PANEL_SCALE), extend("examples" = [1.25]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/scale"]))]
    pub(crate) scale: f32,
    /// A TrueType or OpenType font for panels and labels, relative to this file; where
    /// missing, one that is built in. What it has no sign for comes from that.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["fonts/site.ttf"]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/font"]))]
    pub(crate) font: Option<String>,
}

/// Size of the window.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Window")]
pub(crate) struct RawWindow {
    /// Width and height in pixels, of pictures too.
    #[schemars(inner(range(min = 16, max = 16_384)), extend("examples" = [[1280, 720]]))]
    #[schemars(extend("x-busbar-formerly" = ["../view/size"]))]
    pub(crate) size: [u32; 2],
}

/// Rendering quality of pictures.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Quality")]
pub(crate) enum RawQuality {
    /// The shape of things, as cheap as can be.
    Low,
    /// Materials as they reflect light.
    Medium,
    /// The same with shadows and contact shades.
    High,
}

/// A plane that cuts equipment open.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Section")]
pub(crate) struct RawSection {
    /// Normal towards the part that is cut away: x, y (up) and z, not all zero.
    #[schemars(inner(range(min = -1.0, max = 1.0)), extend("examples" = [[0, 1, 0]]))]
    pub(crate) normal: [f32; 3],
    /// Distance of the plane from the origin along the normal, metres.
    #[schemars(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES))]
    #[schemars(extend("examples" = [2]))]
    pub(crate) distance: f64,
}

/// Results of optimisers on disk.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Cache")]
pub(crate) struct RawCache {
    /// A directory of the user's own, relative to this file or absolute; where
    /// missing, `busbar/stacks` in the user's cache directory.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["cache"]))]
    pub(crate) directory: Option<String>,
    /// Size past which what was used longest ago is removed; 0 keeps nothing.
    #[schemars(range(min = 0, max = MAX_CACHE_MEGABYTES), extend("examples" = [1024]))]
    pub(crate) max_megabytes: u32,
}

impl Default for RawCache {
    fn default() -> Self {
        Self { directory: None, max_megabytes: 1024 }
    }
}

impl Default for RawScale {
    fn default() -> Self {
        Self::Uniform(1.0)
    }
}

impl Default for RawCameraStart {
    fn default() -> Self {
        Self { start: None, section: None, transition_seconds: 0.6, inertia: false }
    }
}

impl Default for RawGraphics {
    fn default() -> Self {
        Self {
            quality: None,
            samples: None,
            ground: false,
            fog: false,
            theta_scale: 1.0,
            target_frame_seconds: 0.0166,
            morph_seconds: 0.25,
            device: None,
        }
    }
}

impl Default for RawTheme {
    fn default() -> Self {
        Self {
            colors: ThemeConfig::default(),
            background: "#d8dadd".to_owned(),
            scale: 1.0,
            font: None,
        }
    }
}

impl Default for RawWindow {
    fn default() -> Self {
        Self { size: [1280, 720] }
    }
}

fn default_freshness_seconds() -> f64 {
    3.0
}

fn default_role() -> String {
    "value".to_owned()
}

fn default_fov_degrees() -> f32 {
    45.0
}

/// One schema for both forms: `anyOf` would blur where a fault is.
fn scale_schema(_: &mut schemars::SchemaGenerator) -> Schema {
    json_schema!({
        "type": ["number", "array"],
        "minimum": -MAX_SCALE,
        "maximum": MAX_SCALE,
        "items": { "type": "number", "minimum": -MAX_SCALE, "maximum": MAX_SCALE },
        "minItems": 3,
        "maxItems": 3,
        "examples": [1, [1, 2, 1]]
    })
}
