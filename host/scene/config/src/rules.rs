//! Rules beyond the schema: names exist, are in use and are well formed, and bands do not
//! contradict.
//!
//! The rules look at the JSON value and skip whatever has the wrong shape, which
//! [`crate::structure`] reports. So one pass finds all faults.

use std::collections::HashSet;

use serde_json::{Map, Value};

use crate::item_names::{check_name_key, check_reference, item_pointer, name_fault, named};
use crate::placement_rules::{self, Equipment};
use crate::report::Report;
use crate::{
    alarm_rules, alarm_sources, join_pointer, moving_parts, plugins, scene_rules, service,
    simulate, suggestions, theta,
};

/// One of the parts of a direction is at least so long.
const MIN_NORMAL_PART: f32 = 1e-3;

/// Reports every fault of meaning.
pub(crate) fn check(document: &Value, report: &mut Report<'_>) {
    let mut rules = Rules { document, used_plugins: HashSet::new(), report };
    rules.check_models();
    rules.check_tags();
    rules.check_lists_of_plugins();
    rules.check_alarm_sources();
    rules.check_notifications();
    rules.check_chart();
    rules.check_plugins();
    rules.check_cameras();
    rules.check_section();
    scene_rules::check(document, rules.report);
    let equipment = placement_rules::check(document, rules.report);
    rules.check_bindings(&equipment);
    crate::equipment::check(document, &equipment, rules.report);
    alarm_rules::check(document, &equipment, rules.report);
    alarm_sources::check(document, &equipment, rules.report);
    plugins::check_roles(document, rules.report);
    service::check(document, rules.report);
}

struct Rules<'d, 'r, 'p> {
    document: &'d Value,
    used_plugins: HashSet<&'d str>,
    report: &'r mut Report<'p>,
}

impl<'d> Rules<'d, '_, '_> {
    fn check_models(&mut self) {
        for (name, model) in named(self.document, "models") {
            let pointer = item_pointer("models", name);
            check_name_key(name, &pointer, "model", self.report);
            let theta_pointer = join_pointer(&pointer, "theta");
            theta::check(&model["theta"], &theta_pointer, self.report);
            moving_parts::check(model, &pointer, self.report);
            if model["optimizer"].is_string() {
                self.check_plugin_reference(&model["optimizer"], &pointer, "optimizer");
            } else if theta::collapses(&model["theta"]) {
                self.report.error(
                    &theta_pointer,
                    "theta has no effect: the model has no optimizer",
                    "add \"optimizer\" with the name of a plugin, or remove \"theta\"",
                );
            }
        }
    }

    fn check_tags(&mut self) {
        for (name, tag) in named(self.document, "tags") {
            let pointer = item_pointer("tags", name);
            check_name_key(name, &pointer, "tag", self.report);
            for band in ["range", "limits"] {
                if tag[band].is_object() {
                    self.check_band(tag, band, &pointer);
                }
            }
            simulate::check(tag, &pointer, self.report);
            self.check_origin(tag, &pointer);
        }
    }

    fn check_origin(&mut self, tag: &'d Value, pointer: &str) {
        let source = join_pointer(pointer, "source");
        let by_host = tag["set_by_host"] == true;
        match (tag["source"].is_object(), tag["expression"].is_string()) {
            (true, false) | (false, true) if by_host => self.report.error(
                &join_pointer(pointer, "set_by_host"),
                "the tag is set by the host and has a source or an expression",
                "remove one of the two: one alone says what the value is",
            ),
            (true, false) => {
                self.check_plugin_reference(&tag["source"]["instance"], &source, "instance");
            }
            (true, true) => self.report.error(
                &join_pointer(pointer, "expression"),
                "the tag has a source and an expression",
                "remove one of the two: a value is read or derived",
            ),
            (false, false) if by_host => {}
            (false, false) if tag["source"].is_null() && tag["expression"].is_null() => {
                self.report.error(
                    pointer,
                    "the tag has no source",
                    "add \"source\" with an instance and an address, \"expression\", or \"set_by_host\": true",
                );
            }
            _ => {}
        }
        let is_text = tag["type"] == "text";
        let has_unit = tag["unit"].as_str().is_some_and(|unit| !unit.is_empty());
        let has_deadband = tag["deadband"].as_f64().is_some_and(|deadband| deadband > 0.0);
        let keys = [("unit", is_text && has_unit), ("deadband", is_text && has_deadband)];
        for (key, _) in keys.into_iter().filter(|(_, is_wrong)| *is_wrong) {
            self.report.error(
                &join_pointer(pointer, key),
                format!("a tag of type 'text' has no {key}"),
                format!("remove \"{key}\", or make the type \"f64\" or \"i64\""),
            );
        }
        if tag["scale"].is_object() && tag["type"] != "f64" {
            self.report.error(
                &join_pointer(pointer, "scale"),
                "only a tag of type 'f64' has a scale",
                "make the type \"f64\", or remove \"scale\"",
            );
        }
    }

    fn check_band(&mut self, tag: &Value, band: &str, tag_pointer: &str) {
        let pointer = join_pointer(tag_pointer, band);
        if let Some(value_type @ ("bool" | "double_point" | "text")) = tag["type"].as_str() {
            self.report.error(
                &pointer,
                format!("a tag of type '{value_type}' has no {band}"),
                format!("remove \"{band}\", or make the type \"f64\" or \"i64\""),
            );
        }
        if let (Some(low), Some(high)) = (tag[band]["low"].as_f64(), tag[band]["high"].as_f64())
            && low >= high
        {
            self.report.error(
                &join_pointer(&pointer, "low"),
                format!("low, {low}, is not less than high, {high}"),
                "make low less than high, or one of them null",
            );
        }
    }

    fn check_lists_of_plugins(&mut self) {
        for (key, list) in [("overlays", "/overlays"), ("records", "/records")] {
            let names = self.document[key].as_array().into_iter().flatten();
            for (index, name) in names.enumerate() {
                self.check_plugin_reference(name, list, index);
            }
        }
    }

    fn check_alarm_sources(&mut self) {
        for (pointer, source) in alarm_sources::sources(self.document) {
            if let Some(instance) = source.get("instance") {
                self.check_plugin_reference(instance, &pointer, "instance");
            }
        }
    }

    fn check_notifications(&mut self) {
        let entries = self.document["notifications"].as_array().into_iter().flatten();
        let mut named: Vec<&str> = Vec::new();
        for (index, entry) in entries.enumerate() {
            let pointer = join_pointer("/notifications", index);
            let Some(instance) = entry.get("instance") else { continue };
            self.check_plugin_reference(instance, &pointer, "instance");
            let Some(name) = instance.as_str() else { continue };
            if named.contains(&name) {
                let pointer = join_pointer(&pointer, "instance");
                self.report.error(&pointer, "it tells of alarms already", "remove one of them");
            }
            named.push(name);
        }
        let is_empty = |key: &str| {
            let items = &self.document[key];
            items
                .as_object()
                .map_or_else(|| items.as_array().is_none_or(Vec::is_empty), Map::is_empty)
        };
        if !named.is_empty() && is_empty("alarms") && is_empty("alarm_sources") {
            self.report.key_warning(
                "/notifications",
                "there is no alarm that anybody could be told of",
                "add \"alarms\" or \"alarm_sources\", or remove it",
            );
        }
    }

    fn check_chart(&mut self) {
        if let Some(chart) = self.document["chart"].as_object()
            && let Some(instance) = chart.get("instance")
        {
            self.check_plugin_reference(instance, "/chart", "instance");
        }
    }

    /// Comes after all that refer to plugins.
    fn check_plugins(&mut self) {
        let document = self.document;
        for (name, plugin) in named(document, "plugins") {
            let pointer = item_pointer("plugins", name);
            check_name_key(name, &pointer, "plugin", self.report);
            if let Some(id) = plugin["plugin"].as_str() {
                let fault = name_fault(id, "plugin id");
                report_name_fault(fault, &join_pointer(&pointer, "plugin"), self.report);
            }
            let isolation = plugin.get("isolation").unwrap_or(&document["isolation"]);
            for key in ["memory_megabytes", "network"] {
                if isolation == "none" && !plugin[key].is_null() {
                    self.report.key_warning(
                        &join_pointer(&pointer, key),
                        format!("\"{key}\" has no effect: the plugin has no process of its own"),
                        "remove it, or make the plugin's \"isolation\" \"process\"",
                    );
                }
            }
            if !self.used_plugins.contains(name.as_str()) {
                self.report.key_warning(
                    &pointer,
                    format!("the plugin '{}' is used nowhere", suggestions::shown(name)),
                    "name it in a model, a tag's source, the overlays, the records, the chart, \
                     the alarm sources or the notifications, or remove it",
                );
            }
        }
        let has_no_directory = match &document["plugin_directories"] {
            Value::Null => true,
            Value::Array(directories) => directories.is_empty(),
            _ => false,
        };
        if has_no_directory && named(document, "plugins").next().is_some() {
            self.report.key_error(
                "/plugins",
                "plugins are named, but no directory to look for them in",
                "add \"plugin_directories\": [\"plugins\"]",
            );
        }
    }

    fn check_section(&mut self) {
        let normal = coordinates(&self.document["camera"]["section"]["normal"]);
        if normal.is_some_and(|normal| normal.iter().all(|part| part.abs() < MIN_NORMAL_PART)) {
            self.report.error(
                "/camera/section/normal",
                "the section plane looks nowhere",
                "give it a direction, such as [0, 1, 0] to cut away what is above it",
            );
        }
    }

    fn check_cameras(&mut self) {
        for (name, camera) in named(self.document, "cameras") {
            let pointer = item_pointer("cameras", name);
            check_name_key(name, &pointer, "camera", self.report);
            let eye = coordinates(&camera["eye"]);
            if eye.is_some() && eye == coordinates(&camera["target"]) {
                self.report.error(
                    &join_pointer(&pointer, "target"),
                    "the camera stands where it looks at",
                    "move \"eye\" or \"target\"",
                );
            }
            if camera["height"].is_number() && camera["projection"] != "orthographic" {
                self.report.error(
                    &join_pointer(&pointer, "height"),
                    "only an orthographic camera has a height",
                    "add \"projection\": \"orthographic\", or leave \"height\" out and set \"fov_degrees\"",
                );
            }
        }
        let cameras = self.document["cameras"].as_object();
        self.check_reference(
            &self.document["camera"]["start"],
            cameras,
            "/camera",
            "start",
            "camera",
        );
    }

    fn check_bindings(&mut self, equipment: &Equipment<'d>) {
        let bindings = self.document["bindings"].as_array().into_iter().flatten();
        for (index, binding) in bindings.enumerate() {
            let pointer = join_pointer("/bindings", index);
            let tags = self.document["tags"].as_object();
            self.check_reference(&binding["tag"], tags, &pointer, "tag", "tag");
            let Some(node) = binding["node"].as_str() else {
                continue;
            };
            let id = node.split_once('/').map_or(node, |(id, _)| id);
            if !equipment.contains_key(id) {
                self.report.error_with(&join_pointer(&pointer, "node"), || {
                    let cause = format!("no scene node has the id '{}'", suggestions::shown(id));
                    let add = || "add a node with that id to the scene".to_owned();
                    (cause, suggestions::remedy(id, equipment.keys().map(AsRef::as_ref), add))
                });
            }
        }
    }

    fn check_plugin_reference(
        &mut self,
        name: &'d Value,
        parent_pointer: &str,
        key: impl std::fmt::Display,
    ) {
        self.used_plugins.extend(name.as_str());
        let plugins = self.document["plugins"].as_object();
        self.check_reference(name, plugins, parent_pointer, key, "plugin");
    }

    fn check_reference(
        &mut self,
        name: &Value,
        known: Option<&Map<String, Value>>,
        parent_pointer: &str,
        key: impl std::fmt::Display,
        what: &str,
    ) {
        check_reference(name, known, parent_pointer, key, what, self.report);
    }
}

fn report_name_fault(fault: Option<(String, String)>, pointer: &str, report: &mut Report<'_>) {
    if let Some((cause, remedy)) = fault {
        report.error(pointer, cause, remedy);
    }
}

/// Three coordinates as they will be stored.
fn coordinates(value: &Value) -> Option<Vec<f32>> {
    value.as_array()?.iter().map(|c| c.as_f64().map(|c| c as f32)).collect()
}
