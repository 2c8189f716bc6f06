//! Theta policies as configured, for models and for single placements.

use std::collections::BTreeSet;

use busbar_config::{Config, ThetaConfig, ThetaLevelConfig};
use busbar_lod::{DistanceLevel, DistanceTable, InstancePolicies, ScreenError, ThetaPolicy};

/// Returns the policies of all models and of the placements that have their own.
pub(crate) fn of_instances(config: &Config) -> InstancePolicies {
    InstancePolicies {
        of_models: config.models.values().map(|model| policy_of(&model.theta)).collect(),
        of_placements: config
            .scene
            .iter()
            .filter_map(|node| node.theta.as_ref().map(policy_of))
            .collect(),
    }
}

/// The models whose detail, somewhere they are placed, follows the error on the screen.
pub(crate) fn screen_error_models(config: &Config) -> BTreeSet<&String> {
    let follows = |theta: &ThetaConfig| matches!(theta, ThetaConfig::ScreenError { .. });
    let placed = config.scene.iter().filter(|node| node.theta.as_ref().is_some_and(follows));
    let placed: BTreeSet<String> = placed.filter_map(|node| node.model).collect();
    let models = config.models.iter().filter(|(_, model)| follows(&model.theta));
    let placed = config.models.keys().filter(|name| placed.contains(*name));
    models.map(|(name, _)| name).chain(placed).collect()
}

/// Converts a configured theta to its policy.
fn policy_of(theta: &ThetaConfig) -> ThetaPolicy {
    match theta {
        ThetaConfig::Fixed(theta) => ThetaPolicy::Fixed(*theta),
        ThetaConfig::Distance { levels, hysteresis } => {
            let level = |level: &ThetaLevelConfig| DistanceLevel {
                beyond: level.beyond as f32,
                theta: level.theta,
            };
            let levels = levels.iter().map(level).collect();
            ThetaPolicy::Distance(DistanceTable::new(levels, *hysteresis as f32))
        }
        ThetaConfig::ScreenError { max_pixels, hysteresis } => {
            ThetaPolicy::ScreenError(ScreenError::new(*max_pixels, *hysteresis))
        }
    }
}
