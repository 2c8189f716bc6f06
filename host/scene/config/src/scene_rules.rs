//! Rules for single nodes of the scene and of templates: references to models, templates and
//! thetas, valid ids, scales that are not zero.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::item_names::{check_name_key, check_reference, item_pointer, name_fault, named};
use crate::report::Report;
use crate::{MIN_SCALE, join_pointer, suggestions, theta};

/// Reports the faults of nodes.
pub(crate) fn check(document: &Value, report: &mut Report<'_>) {
    let mut walk = SceneWalk { document, used_templates: BTreeSet::new(), report };
    walk.check_nodes(&document["scene"], "/scene");
    for (name, nodes) in named(document, "templates") {
        let pointer = item_pointer("templates", name);
        check_name_key(name, &pointer, "template", walk.report);
        walk.check_nodes(nodes, &pointer);
    }
    for (name, _) in named(document, "templates") {
        if !walk.used_templates.contains(name.as_str()) {
            walk.report.key_warning(
                &item_pointer("templates", name),
                format!("the template '{}' is used nowhere", suggestions::shown(name)),
                "name it in a node's \"template\", or remove it",
            );
        }
    }
}

struct SceneWalk<'d, 'r, 'p> {
    document: &'d Value,
    used_templates: BTreeSet<&'d str>,
    report: &'r mut Report<'p>,
}

impl<'d> SceneWalk<'d, '_, '_> {
    /// Checks nodes and all under them. The recursion is as deep as the text
    /// nests, which reading it has bounded.
    fn check_nodes(&mut self, nodes: &'d Value, pointer: &str) {
        for (index, node) in nodes.as_array().into_iter().flatten().enumerate() {
            let pointer = join_pointer(pointer, index);
            self.check_placement(node, &pointer);
            for (key, list) in [("model", "models"), ("template", "templates")] {
                let known = self.document[list].as_object();
                check_reference(&node[key], known, &pointer, key, key, self.report);
            }
            self.used_templates.extend(node["template"].as_str());
            self.check_theta(&node["theta"], &pointer, &node["model"]);
            self.check_instances(node, &pointer);
            self.check_nodes(&node["children"], &join_pointer(&pointer, "children"));
        }
    }

    fn check_instances(&mut self, node: &'d Value, node_pointer: &str) {
        let pointer = join_pointer(node_pointer, "instances");
        let instances = node["instances"].as_array().map(Vec::as_slice).unwrap_or_default();
        let has_children = node["children"].as_array().is_some_and(|c| !c.is_empty());
        if has_children && !instances.is_empty() {
            self.report.key_error(
                &pointer,
                "a node with children cannot have instances: the children's ids would repeat",
                "write each copy as a node with children of its own, or make the children a \
                 template",
            );
        }
        for (index, instance) in instances.iter().enumerate() {
            let pointer = join_pointer(&pointer, index);
            self.check_placement(instance, &pointer);
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

    /// Checks what nodes and instances share: id and scale.
    fn check_placement(&mut self, placement: &'d Value, pointer: &str) {
        if let Some(id) = placement["id"].as_str() {
            let slash = id.contains('/').then(|| {
                let cause = format!("the equipment id '{}' has a '/'", suggestions::shown(id));
                (cause, "write it without: '/' leads to the nodes of a model".to_owned())
            });
            if let Some((cause, remedy)) = slash.or_else(|| name_fault(id, "equipment id")) {
                self.report.error(&join_pointer(pointer, "id"), cause, remedy);
            }
        }
        self.check_scale(&placement["transform"]["scale"], pointer);
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
