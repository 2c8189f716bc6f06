//! Which parts of models move.

use busbar_config::Config;
use busbar_scene::SceneGraph;

use super::Faults;
use super::models::ImportedModels;
use crate::moving::MovingParts;

/// Names of a model's nodes that a fault suggests.
const MAX_SUGGESTIONS: usize = 8;

/// Finds the parts that move, and faults of models that have no such part.
pub(super) fn resolve(
    config: &Config,
    graph: Option<&SceneGraph>,
    imported: &ImportedModels,
    faults: &mut Faults<'_>,
) -> MovingParts {
    for (index, model) in config.models.values().enumerate() {
        let Some(nodes) = imported.usable[index].then(|| &imported.models[index].nodes) else {
            continue;
        };
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
    graph.map_or_else(MovingParts::default, |graph| MovingParts::of(config, graph))
}
