//! Theta as typed: a number, or a policy that chooses one.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::join_pointer;
use crate::limits::*;
use crate::report::Report;

/// Raw theta of the configuration text.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum RawTheta {
    /// The same from everywhere.
    Fixed(f64),
    /// Chosen anew as the camera moves.
    Policy(RawPolicy),
}

/// Share of vertices collapsed, from 0 (none) to 1 (all that can be): a number, or an
/// object that chooses it by distance, or by the error that shows on the screen.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawPolicy {
    /// Theta by metres from the eye to the nearest point of an instance's
    /// bounds. The first level begins at 0, the others in ascending order;
    /// theta does not fall with distance.
    #[schemars(length(min = 1, max = MAX_THETA_LEVELS))]
    #[schemars(extend("examples" = [[{"beyond": 0, "theta": 0}, {"beyond": 40, "theta": 0.5}]]))]
    distance: Option<Vec<RawLevel>>,
    /// Largest screen-space error, pixels: vertices are collapsed as long as the optimizer's
    /// error stays within it, for any position of the eye.
    #[schemars(range(min = MIN_ERROR_PIXELS, max = MAX_ERROR_PIXELS), extend("examples" = [0.5]))]
    max_error_px: Option<f64>,
    /// Share of a distance by which the eye must come back before detail
    /// returns, so that nothing flickers where a level begins. By pixels, detail goes
    /// that much later than it could.
    #[serde(default = "default_hysteresis")]
    #[schemars(range(min = 0.0, max = MAX_THETA_HYSTERESIS), extend("examples" = [0.1]))]
    hysteresis: f64,
}

/// Keys of the policies that choose theta.
const POLICIES: [&str; 2] = ["distance", "max_error_px"];

/// One level of detail.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ThetaLevel")]
struct RawLevel {
    /// Distance in metres beyond which the level holds.
    #[schemars(range(min = 0.0, max = MAX_COORDINATE_METRES), extend("examples" = [40]))]
    beyond: f64,
    /// Share of vertices collapsed there.
    #[schemars(range(min = 0.0, max = 1.0), extend("examples" = [0.5]))]
    theta: f64,
}

fn default_hysteresis() -> f64 {
    0.05
}

/// One schema for both forms: `anyOf` would blur where a fault is.
impl JsonSchema for RawTheta {
    fn schema_name() -> Cow<'static, str> {
        "Theta".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = RawPolicy::json_schema(generator);
        schema.insert("type".to_owned(), json!(["number", "object"]));
        schema.insert("minimum".to_owned(), json!(0.0));
        schema.insert("maximum".to_owned(), json!(1.0));
        let levels = json!([{ "beyond": 0, "theta": 0 }, { "beyond": 40, "theta": 0.5 }]);
        schema.insert(
            "examples".to_owned(),
            json!([0.3, { "distance": levels }, { "max_error_px": 0.5 }]),
        );
        schema
    }
}

impl Default for RawTheta {
    fn default() -> Self {
        Self::Fixed(0.0)
    }
}

impl RawTheta {
    pub(crate) fn resolve(self) -> ThetaConfig {
        match self {
            Self::Fixed(theta) => ThetaConfig::Fixed(theta),
            Self::Policy(RawPolicy { max_error_px: Some(max_pixels), hysteresis, .. }) => {
                ThetaConfig::ScreenError { max_pixels, hysteresis }
            }
            Self::Policy(RawPolicy { distance, hysteresis, .. }) => {
                let level = |RawLevel { beyond, theta }| ThetaLevelConfig { beyond, theta };
                let levels = distance.unwrap_or_default().into_iter().map(level).collect();
                ThetaConfig::Distance { levels, hysteresis }
            }
        }
    }
}

/// Reports errors beyond the schema: several policies at once, and levels out of order.
pub(crate) fn check(theta: &Value, pointer: &str, report: &mut Report<'_>) {
    if let Some(policy) = theta.as_object() {
        let cause = match POLICIES.map(|name| policy.contains_key(name)) {
            [true, true] => Some("theta is chosen both by distance and by pixels"),
            [false, false] => Some("theta is an object that does not say what it follows"),
            _ => None,
        };
        if let Some(cause) = cause {
            report.error(pointer, cause, "write \"distance\" or \"max_error_px\", one of them");
        }
    }
    check_levels(theta, pointer, report);
}

fn check_levels(theta: &Value, pointer: &str, report: &mut Report<'_>) {
    let levels = theta["distance"].as_array().map(Vec::as_slice).unwrap_or_default();
    let pointer = join_pointer(pointer, "distance");
    let at = |index: usize, key: &str| join_pointer(&join_pointer(&pointer, index), key);
    if let Some(first) = levels.first().and_then(|level| level["beyond"].as_f64())
        && first > 0.0
    {
        report.error(
            &at(0, "beyond"),
            format!("the first level begins at {first} m: none holds nearer than that"),
            "begin it at 0",
        );
    }
    for (index, pair) in levels.windows(2).enumerate() {
        let both = |key: &str| Some((pair[0][key].as_f64()?, pair[1][key].as_f64()?));
        if let Some((nearer, beyond)) = both("beyond")
            && beyond <= nearer
        {
            report.error(
                &at(index + 1, "beyond"),
                format!("{beyond} m is not farther than {nearer} m, where the last level begins"),
                format!("write more than {nearer}, or remove the level"),
            );
        }
        if let Some((nearer, theta)) = both("theta")
            && theta < nearer
        {
            report.error(
                &at(index + 1, "theta"),
                format!("theta falls with distance, from {nearer} to {theta}"),
                format!("write at least {nearer}"),
            );
        }
    }
}

/// Reports whether a raw theta collapses anything at any distance.
pub(crate) fn collapses(theta: &Value) -> bool {
    let levels = theta["distance"].as_array().into_iter().flatten();
    let mut thetas = levels.map(|level| &level["theta"]).chain([theta]);
    theta.get("max_error_px").is_some()
        || thetas.any(|theta| theta.as_f64().is_some_and(|theta| theta > 0.0))
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
