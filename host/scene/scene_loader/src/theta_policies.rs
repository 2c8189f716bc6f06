//! Theta policies as configured, for models and for single placements.

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
