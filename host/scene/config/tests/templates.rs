//! Templates: lists of nodes that many places have in common.

use busbar_config::{Diagnostic, MAX_DIAGNOSTICS, MAX_NODES, parse};
use serde_json::{Value, json};

fn with(templates: &Value, scene: &Value) -> Result<busbar_config::Config, Vec<Diagnostic>> {
    let models = json!({ "breaker": { "file": "b.glb" } });
    let document =
        json!({ "version": 1, "models": models, "templates": templates, "scene": scene });
    parse(&document.to_string())
}

#[track_caller]
fn assert_refused(templates: &Value, scene: &Value, pointer: &str, cause: &str) {
    let faults = with(templates, scene).expect_err("a fault");
    let told = faults.iter().any(|f| f.pointer == pointer && f.cause.contains(cause));
    assert!(told, "{faults:#?}");
}

#[test]
fn a_template_hangs_under_each_place_with_ids_that_continue_its_own() {
    let templates = json!({
        "bay": [
            { "id": "-QA1", "model": "breaker", "children": [{ "id": "-QA1-F1" }] },
            { "id": "-QB1", "instances": [{ "id": "-QB2" }] },
        ],
        "station": [{ "id": "E1", "template": "bay", "instances": [{ "id": "E2" }] }],
    });
    let scene = json!([{
        "id": "=S1",
        "template": "station",
        "transform": { "translation": [100, 0, 0] },
        "instances": [{ "id": "=S2" }],
    }, { "id": "=S3", "template": "bay", "children": [{ "id": "office" }] }]);
    let config = with(&templates, &scene).expect("a configuration");
    let bay = ["-QA1", "-QA1-F1", "-QB1", "-QB2"];
    let station = |id: &str| {
        let bays = ["E1", "E2"].map(|bay| format!("{id}{bay}"));
        let within = bays.clone().into_iter().flat_map(|id| bay.map(|part| format!("{id}{part}")));
        bays.into_iter().chain(within).collect::<Vec<_>>()
    };
    let expected = [vec!["=S1".to_owned(), "=S2".to_owned()], station("=S1"), station("=S2")];
    let mut expected = expected.concat();
    expected.push("=S3".into());
    expected.extend(bay.map(|part| format!("=S3{part}")));
    expected.push("office".into());
    let scene: Vec<_> = config.scene.iter().collect();
    let ids: Vec<&str> = scene.iter().map(|node| node.id.as_str()).collect();
    assert_eq!(ids, expected);

    let node = |id: &str| scene.iter().find(|node| node.id == id).expect("a node");
    let parent = |id: &str| node(id).parent.map(|parent| scene[parent].id.as_str());
    assert_eq!(parent("=S2E1"), Some("=S2"));
    assert_eq!(parent("=S2E2-QB2"), Some("=S2E2"));
    assert_eq!(parent("=S1E1-QA1-F1"), Some("=S1E1-QA1"));
    assert_eq!(parent("office"), Some("=S3"));
    assert_eq!(node("=S2E2-QA1").model.as_deref(), Some("breaker"));
    assert_eq!(node("=S2E2-QA1").pointer, "/templates/bay/0");
    assert_eq!(node("=S1").transform.translation, [100.0, 0.0, 0.0]);
}

#[test]
fn what_is_bound_may_stand_in_a_template() {
    let bind = |node: &str| {
        let document = json!({
            "version": 1, "plugin_directories": ["p"],
            "plugins": { "plc": { "plugin": "x" } },
            "templates": { "bay": [{ "id": "-QA1" }] },
            "scene": [{ "id": "=S1", "template": "bay" }],
            "tags": { "t": { "type": "bool", "source": { "instance": "plc", "address": {} } } },
            "bindings": [{ "tag": "t", "node": node }],
        });
        parse(&document.to_string())
    };
    assert!(bind("=S1-QA1").is_ok());
    let faults = bind("=S1-QA2").expect_err("there is none");
    assert!(faults[0].remedy.contains("=S1-QA1"), "{faults:#?}");
}

#[test]
fn faults_of_templates_are_told_where_they_are() {
    let scene = json!([{ "id": "A", "template": "t" }]);
    let t = |nodes: Value| json!({ "t": nodes });
    assert_refused(&t(json!([{ "id": "x/y" }])), &scene, "/templates/t/0/id", "has a '/'");
    let unknown = json!([{ "id": "x", "model": "none" }]);
    assert_refused(&t(unknown), &scene, "/templates/t/0/model", "there is no model 'none'");
    let twice = json!([{ "id": "x" }, { "id": "x" }]);
    assert_refused(&t(twice), &scene, "/templates/t/1/id", "'Ax' is used twice");
    let far = json!([{ "id": "x", "transform": { "translation": [9e6, 0, 0] } }]);
    let moved = json!([{
        "id": "A", "template": "t", "transform": { "translation": [9e6, 0, 0] },
    }]);
    assert_refused(&t(far), &moved, "/templates/t/0/transform", "stands at 1.8e7 m");
    let long = json!([{ "id": "x".repeat(200) }]);
    assert_refused(&t(long), &scene, "/templates/t/0/id", "has 201 bytes");
    assert_refused(&json!({}), &scene, "/scene/0/template", "there is no template 't'");
}

#[test]
fn a_template_that_nobody_places_is_a_remark() {
    let config = with(&json!({ "t": [{ "id": "x" }] }), &json!([])).expect("a configuration");
    assert_eq!(config.warnings[0].pointer, "/templates/t");
    assert!(config.warnings[0].cause.contains("used nowhere"));
}

#[test]
fn a_template_within_itself_is_refused() {
    let scene = json!([{ "id": "A", "template": "a" }]);
    let itself = json!({ "a": [{ "id": "x", "children": [{ "id": "y", "template": "a" }] }] });
    let pointer = "/templates/a/0/children/0/template";
    assert_refused(&itself, &scene, pointer, "is placed within itself");
    let by_way =
        json!({ "a": [{ "id": "x", "template": "b" }], "b": [{ "id": "y", "template": "a" }] });
    assert_refused(&by_way, &scene, "/templates/b/0/template", "'a' is placed within itself");
}

/// A short text may ask for more than any memory holds.
#[test]
fn templates_that_multiply_are_refused_soon() {
    let level = |number: usize| {
        let nodes: Vec<Value> = (0..10)
            .map(|i| json!({ "id": i.to_string(), "template": format!("t{}", number + 1) }))
            .collect();
        (format!("t{number}"), Value::Array(nodes))
    };
    let mut templates: serde_json::Map<String, Value> = (0..12).map(level).collect();
    templates.insert("t12".into(), json!([{ "id": "x" }]));
    let scene = json!([{ "id": "A", "template": "t0" }]);
    let faults = with(&Value::Object(templates), &scene).expect_err("too many");
    assert!(faults.len() <= MAX_DIAGNOSTICS + 1);
    let expected = format!("the scene has more than {MAX_NODES} nodes; at most {MAX_NODES}");
    assert_eq!(faults[0].cause, expected);

    let chain = |number: usize| {
        let next = json!([{ "id": "x", "template": format!("t{}", number + 1) }]);
        (format!("t{number}"), next)
    };
    let mut templates: serde_json::Map<String, Value> = (0..900).map(chain).collect();
    templates.insert("t900".into(), json!([]));
    let faults = with(&Value::Object(templates), &scene).expect_err("too deep");
    assert_eq!(faults.len(), 1, "{faults:#?}");
    assert!(faults[0].cause.contains("more than 16 within one another"));
}
