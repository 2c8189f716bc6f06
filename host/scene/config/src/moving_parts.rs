//! Parts of models that move with a switch.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::join_pointer;
use crate::limits::*;
use crate::report::Report;

/// A part of a model that moves with a switch: it turns about a hinge, shifts, or folds,
/// from where the file shows it to its other end. All in the part's own space.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "MovingPart")]
pub(crate) struct RawMovingPart {
    /// Name of the node in the model's file.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES), extend("examples" = ["blade 1"]))]
    part: String,
    /// Name of the mechanism that moves it, as overlays know it.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES), extend("examples" = ["blade"]))]
    mechanism: String,
    /// The position that the file shows.
    #[serde(default)]
    #[schemars(extend("examples" = ["closed"]))]
    modelled: EndConfig,
    /// A point of the hinge's axis, and what stays where it is when the part folds, metres.
    #[serde(default)]
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    #[schemars(extend("examples" = [[0, 0, 1.3]]))]
    pivot: [f32; 3],
    /// Direction of the hinge's axis.
    #[serde(default = "upwards")]
    #[schemars(inner(range(min = -1.0, max = 1.0)), extend("examples" = [[0, 1, 0]]))]
    axis: [f32; 3],
    /// Angle of the rotation about the axis, right-handed.
    #[serde(default)]
    #[schemars(range(min = -MAX_TURN_DEGREES, max = MAX_TURN_DEGREES), extend("examples" = [90]))]
    degrees: f32,
    /// Translation of the part, metres.
    #[serde(default)]
    #[schemars(inner(range(min = -MAX_COORDINATE_METRES, max = MAX_COORDINATE_METRES)))]
    #[schemars(extend("examples" = [[0, -1.5, 0]]))]
    travel: [f32; 3],
    /// Factors by which it folds along x, y and z, as pantographs do.
    #[serde(default = "unchanged")]
    #[schemars(inner(range(min = MIN_SCALE, max = MAX_SCALE)))]
    #[schemars(extend("examples" = [[1, 0.3, 1.5]]))]
    scale: [f32; 3],
}

fn upwards() -> [f32; 3] {
    [0.0, 1.0, 0.0]
}

fn unchanged() -> [f32; 3] {
    [1.0; 3]
}

impl RawMovingPart {
    pub(crate) fn resolve(self, pointer: String) -> MovingPartConfig {
        let Self { part, mechanism, modelled, pivot, axis, degrees, travel, scale } = self;
        MovingPartConfig { part, mechanism, modelled, pivot, axis, degrees, travel, scale, pointer }
    }
}

/// Reports parts that cannot move.
pub(crate) fn check(model: &Value, model_pointer: &str, report: &mut Report<'_>) {
    let parts = model["moving_parts"].as_array().map_or(&[][..], Vec::as_slice);
    for (index, part) in parts.iter().enumerate() {
        let pointer = join_pointer(&join_pointer(model_pointer, "moving_parts"), index);
        let is = |key: &str, value: f64| {
            let numbers = part[key].as_array().map_or(&[][..], Vec::as_slice);
            numbers.iter().all(|number| number.as_f64() == Some(value))
        };
        let stays = part["degrees"].as_f64().unwrap_or_default() == 0.0;
        if stays && is("travel", 0.0) && is("scale", 1.0) {
            report.error(
                &pointer,
                "the part goes nowhere",
                "say how it moves: \"degrees\", \"travel\" or \"scale\"",
            );
        }
        if part["axis"].is_array() && is("axis", 0.0) {
            report.error(
                &join_pointer(&pointer, "axis"),
                "the axis has no direction",
                "write a direction, such as [0, 1, 0] for upwards",
            );
        }
    }
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
