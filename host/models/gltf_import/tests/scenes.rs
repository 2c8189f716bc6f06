//! Files with several scenes: the default one, or one by name or index.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{
    ImportError, ImportFault, ImportOptions, ImportedModel, SceneChoice, import_file_with,
};
use common::Builder;
use serde_json::{Value, json};

/// A file of three nodes with these scenes.
fn with_scenes(scenes: &Value) -> Builder {
    let mut builder = Builder::square();
    builder.json["nodes"] = json!([
        { "name": "tank", "mesh": 0 },
        { "name": "yard", "mesh": 0, "children": [2] },
        { "name": "fence", "mesh": 0 },
    ]);
    builder.json["scenes"] = scenes.clone();
    builder
}

fn three_scenes() -> Builder {
    with_scenes(&json!([
        { "name": "Station", "nodes": [0] },
        { "name": "Yard/out\u{7}", "nodes": [1] },
        { "nodes": [0, 1] },
    ]))
}

fn import(builder: &Builder, choice: Option<&SceneChoice>) -> Result<ImportedModel, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, builder.bytes()).unwrap();
    import_file_with(&path, ImportOptions { scene: choice, ..ImportOptions::default() })
}

fn names(imported: &ImportedModel) -> Vec<&str> {
    imported.model.nodes.iter().map(|node| node.name.as_str()).collect()
}

fn by_name(name: &str) -> SceneChoice {
    SceneChoice::Name(name.to_owned())
}

#[test]
fn scenes_are_chosen_by_name_or_index() {
    let mut builder = three_scenes();
    builder.json["scene"] = json!(2);
    for (choice, expected) in [
        (None, &["tank", "yard", "fence"][..]),
        (Some(by_name("Station")), &["tank"]),
        (Some(SceneChoice::Index(0)), &["tank"]),
        (Some(by_name("Yard/out\u{7}")), &["yard", "fence"]),
        // As messages show the name.
        (Some(by_name("Yard_out_")), &["yard", "fence"]),
        (Some(SceneChoice::Index(2)), &["tank", "yard", "fence"]),
    ] {
        let imported = import(&builder, choice.as_ref()).unwrap();
        assert_eq!(names(&imported), expected, "{choice:?}");
        assert_eq!(imported.model.meshes.len(), 1);
    }
}

#[test]
fn scenes_that_do_not_exist_are_refused_with_the_names_of_those_that_do() {
    let builder = three_scenes();
    for (choice, wanted) in [(by_name("Yard"), "'Yard'"), (SceneChoice::Index(3), "3")] {
        let error = import(&builder, Some(&choice)).unwrap_err();
        let expected =
            format!("the file has no scene {wanted}; its scenes are: 'Station', 'Yard_out_', 2");
        assert_eq!(error.fault.to_string(), expected);
        assert_eq!(error.place, "/scenes");
        assert!(matches!(error.fault, ImportFault::NoScene { .. }));
        assert!(error.fault.remedy().contains("choose one of these"));
    }
    let many: Value = (0..25).map(|number| json!({ "name": format!("s{number}") })).collect();
    let error = import(&with_scenes(&many), Some(&by_name("x"))).unwrap_err().fault.to_string();
    assert!(error.ends_with("'s19' and 5 more"), "{error}");
    let error = import(&with_scenes(&json!([])), Some(&by_name("x"))).unwrap_err();
    assert!(error.fault.to_string().ends_with("its scenes are: none"), "{error}");
}

#[test]
fn odd_scenes_beside_the_chosen_one_do_no_harm() {
    let scenes = json!([7, { "name": 3, "nodes": "all" }, { "name": "Yard", "nodes": [2] },
        { "name": "Yard", "nodes": [0] }]);
    let imported = import(&with_scenes(&scenes), Some(&by_name("Yard"))).unwrap();
    assert_eq!(names(&imported), ["fence"]);
    let notes = imported.report.notes.join("; ");
    assert!(notes.contains("1 x scenes of the chosen name"), "{notes}");
}
