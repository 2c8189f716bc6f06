//! The meaning of the scene: ids used once, models that exist, scales that
//! are not zero, places within bounds, instances only of nodes without
//! children.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use serde_json::Value;

use crate::report::Report;
use crate::rules::{check_reference, name_fault};
use crate::world::World;
use crate::{MAX_NODES, MIN_SCALE, join_pointer, suggest, theta};

/// Equipment ids, and the pointer of the node that has each.
pub(crate) type Equipment<'d> = BTreeMap<&'d str, String>;

/// Reports the faults of the scene and gives the ids in it.
pub(crate) fn check<'d>(document: &'d Value, report: &mut Report<'_>) -> Equipment<'d> {
    let mut walk = Walk { document, equipment: BTreeMap::new(), nodes: 0, report };
    walk.check_nodes(&document["scene"], "/scene", Some(World::ROOT));
    if walk.nodes > MAX_NODES {
        walk.report.error(
            "/scene",
            format!("the scene has {} nodes; at most {MAX_NODES}", walk.nodes),
            "split the plant over several scenes",
        );
    }
    walk.equipment
}

struct Walk<'d, 'r, 'p> {
    document: &'d Value,
    equipment: Equipment<'d>,
    nodes: usize,
    report: &'r mut Report<'p>,
}

impl<'d> Walk<'d, '_, '_> {
    /// Checks nodes and all under them. The recursion is as deep as the text
    /// nests, which reading it has bounded. `parent` is `None` where nobody
    /// knows, for a fault above.
    fn check_nodes(&mut self, nodes: &'d Value, pointer: &str, parent: Option<World>) {
        for (index, node) in nodes.as_array().into_iter().flatten().enumerate() {
            let pointer = join_pointer(pointer, index);
            let world = self.check_placement(node, &pointer, parent);
            let models = self.document["models"].as_object();
            check_reference(&node["model"], models, &pointer, "model", "model", self.report);
            self.check_theta(&node["theta"], &pointer, &node["model"]);
            self.check_instances(node, &pointer, parent);
            self.check_nodes(&node["children"], &join_pointer(&pointer, "children"), world);
        }
    }

    fn check_instances(&mut self, node: &'d Value, node_pointer: &str, parent: Option<World>) {
        let pointer = join_pointer(node_pointer, "instances");
        let instances = node["instances"].as_array().map(Vec::as_slice).unwrap_or_default();
        let has_children = node["children"].as_array().is_some_and(|c| !c.is_empty());
        if has_children && !instances.is_empty() {
            self.report.key_error(
                &pointer,
                "a node with children cannot have instances: the children's ids would repeat",
                "write each copy as a node with children of its own",
            );
        }
        for (index, instance) in instances.iter().enumerate() {
            let pointer = join_pointer(&pointer, index);
            self.check_placement(instance, &pointer, parent);
            self.check_theta(&instance["theta"], &pointer, &node["model"]);
        }
    }

    /// Checks the theta of a node or instance that shows `model`.
    fn check_theta(&mut self, theta: &'d Value, placement_pointer: &str, model: &'d Value) {
        if theta.is_null() {
            return;
        }
        let pointer = join_pointer(placement_pointer, "theta");
        theta::check(theta, &pointer, self.report);
        let (cause, remedy) = match model.as_str().map(|name| &self.document["models"][name]) {
            None if model.is_null() => ("the node shows no model", "add \"model\""),
            // Without an optimizer; of a model that there is.
            Some(Value::Object(model))
                if !model.contains_key("optimizer") && theta::collapses(theta) =>
            {
                ("its model has no optimizer", "add \"optimizer\" to the model")
            }
            _ => return,
        };
        let cause = format!("theta has no effect: {cause}");
        self.report.error(&pointer, cause, format!("{remedy}, or remove \"theta\""));
    }

    /// Checks what nodes and instances share: id and transform. Gives where it
    /// stands, unless that is at fault.
    fn check_placement(
        &mut self,
        placement: &'d Value,
        pointer: &str,
        parent: Option<World>,
    ) -> Option<World> {
        self.nodes += 1;
        if let Some(id) = placement["id"].as_str() {
            self.check_id(id, pointer);
        }
        let transform = &placement["transform"];
        self.check_scale(&transform["scale"], pointer);
        let world = parent?.place(transform)?;
        let Some(fault) = world.fault() else {
            return Some(world);
        };
        // The first on its branch: all below it would be at fault with it.
        self.report.error_with(&join_pointer(pointer, "transform"), || fault.texts());
        None
    }

    fn check_id(&mut self, id: &'d str, placement_pointer: &str) {
        let pointer = join_pointer(placement_pointer, "id");
        let slash = id.contains('/').then(|| {
            let cause = format!("the equipment id '{}' has a '/'", suggest::shown(id));
            (cause, "write it without: '/' leads to the nodes of a model".to_owned())
        });
        if let Some((cause, remedy)) = slash.or_else(|| name_fault(id, "equipment id")) {
            self.report.error(&pointer, cause, remedy);
        }
        match self.equipment.entry(id) {
            Entry::Vacant(entry) => {
                entry.insert(pointer);
            }
            Entry::Occupied(first) => {
                let positions = self.report.positions();
                self.report.error_with(&pointer, || {
                    let (line, column) = positions.locate(first.get());
                    let cause = format!(
                        "the equipment id '{}' is used twice, first at line {line}, column {column}",
                        suggest::shown(id)
                    );
                    (cause, "give one of the two another id".to_owned())
                });
            }
        }
    }

    fn check_scale(&mut self, scale: &'d Value, placement_pointer: &str) {
        let pointer = || format!("{placement_pointer}/transform/scale");
        let factors = scale.as_array().into_iter().flatten().enumerate();
        let factors = factors.map(|(index, factor)| (Some(index), factor));
        for (index, factor) in factors.chain([(None, scale)]) {
            if factor.as_f64().is_some_and(|factor| factor.abs() < f64::from(MIN_SCALE)) {
                let pointer = index.map_or_else(pointer, |index| join_pointer(&pointer(), index));
                self.report.error(
                    &pointer,
                    format!("a scale of {factor} makes the node vanish"),
                    format!("write a factor of at least {MIN_SCALE} in magnitude"),
                );
            }
        }
    }
}
