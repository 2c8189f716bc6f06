//! Check of configured moving parts against the model's nodes.

use busbar_config::Config;

use crate::diagnostics::DiagnosticsCollector;
use crate::models::{ImportedModels, ModelSource};

/// Names of a model's nodes that a fault suggests.
const MAX_SUGGESTIONS: usize = 8;

/// Finds faults of models that have no such part.
pub(crate) fn check(
    config: &Config,
    imported: &ImportedModels,
    faults: &mut DiagnosticsCollector<'_>,
) {
    for (model, source) in config.models.values().zip(&imported.models) {
        let ModelSource::New(imported, _) = source else { continue };
        let nodes = &imported.nodes;
        let absent = |part: &str| nodes.iter().all(|node| node.name != part);
        for part in model.moving_parts.iter().filter(|part| absent(&part.part)) {
            let names = nodes.iter().map(|node| format!("'{}'", node.name));
            let names: Vec<String> = names.take(MAX_SUGGESTIONS).collect();
            faults.add(
                &format!("{}/part", part.pointer),
                format!("the model has no node '{}'", part.part),
                format!("write one of {}", names.join(", ")),
            );
        }
    }
}
