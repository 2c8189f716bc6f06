use serde_json::json;

use super::*;

fn schema() -> Value {
    json!({
        "properties": {
            "graphics": { "$ref": "#/$defs/Graphics" },
            "tags": { "additionalProperties": { "$ref": "#/$defs/Tag" } },
            "alarm_sources": {
                "items": { "properties": { "instance": { FORMER_NAMES: ["plugin"] } } },
                FORMER_NAMES: ["alarm_handling/sources"]
            },
            "scene": { "items": { "$ref": "#/$defs/Node" } }
        },
        "$defs": {
            "Graphics": { "properties": {
                "quality": { FORMER_NAMES: ["../view/quality"] },
                "frame_seconds": { FORMER_NAMES: ["../view/frame_ms", "../view/frame_millis"] }
            } },
            "Tag": { "properties": {
                "freshness_seconds": { FORMER_NAMES: ["freshness_millis"] },
                "source": { "properties": { "instance": { FORMER_NAMES: ["plugin"] } } }
            } },
            "Node": { "properties": { "children": { "items": { "$ref": "#/$defs/Node" } } } }
        }
    })
}

fn rename(mut document: Value) -> (Value, RenamedSettings) {
    let renamed = FormerNames::new(&schema()).rename(&mut document);
    (document, renamed)
}

#[test]
fn settings_get_their_present_names_and_units() {
    let (document, renamed) = rename(json!({
        "view": { "quality": "low", "frame_millis": 16.6 },
        "tags": { "a/b": { "freshness_millis": 3000, "source": { "plugin": "plc" } } },
        "alarm_handling": { "sources": [{ "plugin": "plc" }], "log_files": 2 },
        "scene": [{ "children": [{ "plugin": "a name of something else" }] }]
    }));
    let expected = json!({
        "graphics": { "quality": "low", "frame_seconds": 0.0166 },
        "tags": { "a/b": { "freshness_seconds": 3, "source": { "instance": "plc" } } },
        "alarm_handling": { "log_files": 2 },
        "alarm_sources": [{ "instance": "plc" }],
        "scene": [{ "children": [{ "plugin": "a name of something else" }] }]
    });
    assert_eq!(document, expected);
    assert!(renamed.conflicts.is_empty());
    let mut former: Vec<&str> = renamed.renamed.iter().map(|one| one.former.as_str()).collect();
    former.sort_unstable();
    let as_written = [
        "/alarm_handling/sources",
        "/alarm_handling/sources/0/plugin",
        "/tags/a~1b/freshness_millis",
        "/tags/a~1b/source/plugin",
        "/view/frame_millis",
        "/view/quality",
    ];
    assert_eq!(former, as_written);
    let places: FormerPlaces = renamed.renamed.into_iter().collect();
    assert_eq!(places.find("/alarm_sources/0/instance"), "/alarm_handling/sources/0/plugin");
    assert_eq!(places.find("/alarm_sources/0"), "/alarm_handling/sources/0");
    assert_eq!(places.find("/graphics/quality/x"), "/view/quality/x");
    assert_eq!(places.find("/graphics/qualities"), "/graphics/qualities");
}

#[test]
fn present_names_are_left_alone() {
    let present = json!({ "graphics": { "quality": "low" }, "tags": { "a": {} }, "scene": [] });
    assert_eq!(rename(present.clone()), (present, RenamedSettings::default()));
    assert_eq!(rename(json!({ "view": {}, "scene": [] })).0, json!({ "scene": [] }));
}

#[test]
fn a_setting_under_both_names_is_a_conflict() {
    let both = json!({ "tags": { "a": { "freshness_millis": 1, "freshness_seconds": 2 } } });
    let (document, renamed) = rename(both);
    assert_eq!(document, json!({ "tags": { "a": { "freshness_seconds": 2 } } }));
    assert!(renamed.renamed.is_empty());
    assert_eq!(renamed.conflicts[0].names(), ("freshness_millis", "freshness_seconds"));
}

#[test]
fn values_of_another_shape_are_left_to_the_schema() {
    for wrong in [json!({ "view": { "quality": "low" }, "graphics": 7 }), json!([]), json!(null)] {
        let (document, renamed) = rename(wrong.clone());
        assert_eq!(document, wrong);
        assert_eq!(renamed, RenamedSettings::default());
    }
    let (document, _) = rename(json!({ "tags": { "a": { "freshness_millis": "soon" } } }));
    assert_eq!(document, json!({ "tags": { "a": { "freshness_seconds": "soon" } } }));
}

#[test]
fn numbers_are_converted_without_rounding_errors() {
    let cases = [
        ("a_millis", "a_seconds", json!(100), json!(0.1)),
        ("a_millis", "a_seconds", json!(86_400_000), json!(86_400)),
        ("a_ms", "a_seconds", json!(16.6), json!(0.0166)),
        ("a_minutes", "a_seconds", json!(480), json!(28_800)),
        ("a_hours", "a_days", json!(36), json!(1.5)),
        ("a_millis", "b_millis", json!(7), json!(7)),
        ("dead_band", "deadband", json!(0.5), json!(0.5)),
        ("a_millis", "a_seconds", json!(null), json!(null)),
        ("a_millis", "a_seconds", json!(0), json!(0)),
    ];
    for (former, present, value, expected) in cases {
        assert_eq!(converted(&value, former, present), expected, "{former} {value}");
    }
}
