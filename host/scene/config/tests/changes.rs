//! Tests of the differences between two configurations.

use busbar_config::{Changes, Section, parse};
use serde_json::{Value, json};

fn document() -> Value {
    json!({
        "version": 1,
        "plugin_directories": ["plugins"],
        "plugins": { "p": { "plugin": "example.source" }, "o": { "plugin": "example.overlay" } },
        "scene": [{ "id": "=A" }, { "id": "=B" }],
        "tags": {
            "t": { "type": "f64", "unit": "A", "source": { "instance": "p", "address": 1 } },
            "u": { "type": "f64", "unit": "A", "source": { "instance": "p", "address": 2 } }
        },
        "bindings": [
            { "tag": "t", "node": "=A", "role": "load" },
            { "tag": "u", "node": "=B", "role": "load" }
        ],
        "overlays": ["o"],
        "cameras": { "all": { "eye": [0, 1, 9], "target": [0, 0, 0] } },
        "theme": { "background": "#aaaaaa" }
    })
}

fn changes(after: &Value) -> Changes {
    let config = |value: &Value, text: fn(&Value) -> String| {
        parse(&text(value)).unwrap_or_else(|faults| panic!("{faults:?}"))
    };
    // Where a value stands plays no part.
    let pretty = |value: &Value| serde_json::to_string_pretty(value).expect("values are JSON");
    Changes::between(&config(&document(), Value::to_string), &config(after, pretty))
}

#[test]
fn each_part_is_told_by_its_name() {
    let check = |pointer: &str, value: Value, words: &str| {
        let mut after = document();
        *after.pointer_mut(pointer).unwrap() = value;
        assert_eq!(changes(&after).to_string(), words, "{pointer}");
    };
    assert!(changes(&document()).is_empty());
    check("/tags/t/unit", json!("kA"), "tags: t changed");
    check("/tags/t/source/address", json!(7), "tags: t changed");
    check("/plugins/p/plugin", json!("other.source"), "plugins: p changed");
    check(
        "/scene/1",
        json!({ "id": "=B", "transform": { "translation": [1, 0, 0] } }),
        "scene changed",
    );
    check("/bindings/0/role", json!("temperature"), "bindings changed");
    check("/overlays", json!([]), "overlays changed");
    check("/cameras/all/eye/0", json!(3), "cameras: all changed");
    check("/theme/background", json!("#bbbbbb"), "view changed");
    let mut after = document();
    after["log"] = json!({ "file": "busbar.log" });
    after["metrics"] = json!({ "address": "127.0.0.1:9187" });
    assert_eq!(changes(&after).to_string(), "log changed; metrics changed");
}

#[test]
fn models_whose_files_changed_are_told_among_models_once() {
    let mut after = document();
    after["models"] = json!({ "m": { "file": "m.glb" } });
    let mut changes = changes(&after);
    changes.add_models(["m", "n"].map(String::from));
    assert_eq!(changes.to_string(), "models: m added, n changed");
}

#[test]
fn what_comes_and_goes_is_told_and_much_of_it_is_counted() {
    let mut after = document();
    let tags = after["tags"].as_object_mut().unwrap();
    let tag = tags.remove("u").unwrap();
    for number in 0..9 {
        tags.insert(format!("n{number}"), tag.clone());
    }
    after["bindings"].as_array_mut().unwrap().pop();
    let changes = changes(&after);
    assert_eq!(
        changes.to_string(),
        "tags: u removed, n0 added, n1 added, n2 added, n3 added, n4 added and 4 more; \
         bindings changed"
    );
    assert!(changes.affect(Section::Tags) && !changes.affect(Section::Alarms));
    assert_eq!(changes.iter().count(), 11);
}
