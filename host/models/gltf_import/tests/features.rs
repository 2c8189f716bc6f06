//! Features of vertices, and their names.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_export::write_glb;
use busbar_gltf_import::{ImportLimits, ImportedModel, import_bytes};
use common::{Builder, TABLE, floats, import, push, shorts, square_with_features};
use serde_json::{Value, json};

/// The name of each triangle's feature, mesh by mesh.
fn owners(imported: &ImportedModel) -> Vec<Option<&str>> {
    let model = &imported.model;
    let meshes = model.meshes.iter().zip(&model.features);
    meshes
        .flat_map(|(mesh, names)| {
            let name = |feature: u32| names[feature as usize].as_str();
            mesh.triangles.iter().map(move |&t| mesh.feature(t).map(name))
        })
        .collect()
}

fn set(builder: &mut Builder) -> &mut Value {
    &mut builder.primitive()["extensions"]["EXT_mesh_features"]["featureIds"][0]
}

#[test]
fn each_triangle_has_the_feature_of_its_first_corner_and_its_name() {
    let imported = square_with_features([1, 1, 1, 1], &["T1", "T2"]).import();
    assert_eq!(owners(&imported), [Some("T2"); 2]);
    assert_eq!(imported.model.features, [["T2"]], "what no triangle has is no feature");
    assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);

    let mut apart = square_with_features([0, 0, 0, 1], &["T1", "T2"]);
    let indices = apart.accessor(&shorts(&[0, 1, 2, 3, 0, 2]), 5123, "SCALAR", 6);
    apart.primitive()["indices"] = json!(indices);
    let imported = apart.import();
    assert_eq!(owners(&imported), [Some("T1"), Some("T2")]);
    let mesh = &imported.model.meshes[0];
    assert_eq!(mesh.positions.len(), 6, "nothing is welded across features");
    assert_eq!(mesh.features, [0, 0, 0, 1, 1, 1]);
}

#[test]
fn ids_of_every_component_type() {
    let words: Vec<u8> = [7_u32, 7, 7, 7].iter().flat_map(|i| i.to_le_bytes()).collect();
    for (component, bytes) in
        [(5121, vec![7; 4]), (5123, shorts(&[7; 4])), (5125, words), (5126, floats(&[7.0; 4]))]
    {
        let mut builder = square_with_features([0; 4], &[]);
        let ids = builder.accessor(&bytes, component, "SCALAR", 4);
        builder.primitive()["attributes"]["_FEATURE_ID_0"] = json!(ids);
        *set(&mut builder) = json!({ "featureCount": 1, "attribute": 0 });
        assert_eq!(owners(&builder.import()), [Some("feature 7"); 2], "{component}");
    }
}

#[test]
fn ids_of_a_sparse_accessor() {
    let mut builder = square_with_features([0; 4], &["T1", "T2"]);
    let (at, values) = (builder.view(&[0, 3]), builder.view(&[1, 1]));
    let ids = json!({ "componentType": 5121, "type": "SCALAR", "count": 4, "sparse": {
        "count": 2, "indices": { "bufferView": at, "componentType": 5121 },
        "values": { "bufferView": values } } });
    let ids = push(&mut builder.json["accessors"], ids);
    builder.primitive()["attributes"]["_FEATURE_ID_0"] = json!(ids);
    let indices = builder.accessor(&shorts(&[1, 2, 0, 3, 0, 2]), 5123, "SCALAR", 6);
    builder.primitive()["indices"] = json!(indices);
    assert_eq!(owners(&builder.import()), [Some("T1"), Some("T2")]);
}

#[test]
fn the_null_id_is_no_feature() {
    let mut builder = square_with_features([9, 0, 0, 0], &["T1"]);
    set(&mut builder)["nullFeatureId"] = json!(9);
    let indices = builder.accessor(&shorts(&[0, 1, 2, 2, 3, 0]), 5123, "SCALAR", 6);
    builder.primitive()["indices"] = json!(indices);
    assert_eq!(owners(&builder.import()), [None, Some("T1")]);
}

#[test]
fn the_first_set_by_an_attribute_is_read_and_the_others_are_said() {
    let mut builder = square_with_features([1; 4], &["T1", "T2"]);
    let ids = builder.accessor(&[0; 4], 5121, "SCALAR", 4);
    let attributes = &mut builder.primitive()["attributes"];
    attributes["_FEATURE_ID_3"] = attributes["_FEATURE_ID_0"].take();
    attributes["_FEATURE_ID_0"] = json!(ids);
    set(&mut builder)["attribute"] = json!(3);
    let sets = &mut builder.primitive()["extensions"]["EXT_mesh_features"]["featureIds"];
    let wanted = sets[0].clone();
    *sets = json!([{ "featureCount": 4 }, { "featureCount": 2, "texture": { "index": 0 } }, wanted,
        { "featureCount": 1, "attribute": 0 }]);
    let imported = builder.import();
    assert_eq!(owners(&imported), [Some("T2"); 2]);
    assert!(imported.report.notes[0].starts_with("3 x set of feature ids skipped"));

    *sets_of(&mut builder) = json!([{ "featureCount": 4 }]);
    let imported = builder.import();
    assert_eq!(owners(&imported), [None; 2]);
    assert!(imported.model.meshes[0].features.is_empty() && !imported.report.notes.is_empty());
}

fn sets_of(builder: &mut Builder) -> &mut Value {
    &mut builder.primitive()["extensions"]["EXT_mesh_features"]["featureIds"]
}

#[test]
fn the_column_that_names_best_is_taken() {
    let mut builder = square_with_features([1; 4], &["first", "second"]);
    let (values, offsets) = (builder.view(b"AB"), builder.view(&[0, 1, 2]));
    let column = json!({ "values": values, "stringOffsets": offsets, "stringOffsetType": "UINT8" });
    for name in ["Name", "id", "equipment"] {
        let of_class = "/extensions/EXT_structural_metadata/schema/classes/piece/properties";
        builder.json.pointer_mut(of_class).unwrap()[name] = json!({ "type": "STRING" });
        builder.json.pointer_mut(TABLE).unwrap()["properties"][name] = column.clone();
        assert_eq!(owners(&builder.import()), [Some("B"); 2], "{name} is better than tag");
        // A list of strings, a number, and what the class does not declare.
        for other in [json!({ "type": "STRING", "array": true }), json!({ "type": "SCALAR" })] {
            builder.json.pointer_mut(of_class).unwrap()[name] = other;
            assert_eq!(owners(&builder.import()), [Some("second"); 2]);
        }
        builder.json.pointer_mut(TABLE).unwrap()["properties"][name].take();
        builder.json.pointer_mut(TABLE).unwrap()["properties"]
            .as_object_mut()
            .unwrap()
            .remove(name);
    }
}

#[test]
fn a_table_whose_class_is_elsewhere_has_no_names() {
    let mut builder = square_with_features([1; 4], &["T1", "T2"]);
    let metadata = &mut builder.json["extensions"]["EXT_structural_metadata"];
    metadata.as_object_mut().unwrap().remove("schema");
    metadata["schemaUri"] = json!("https://example.org/schema.json");
    let imported = builder.import();
    assert_eq!(owners(&imported), [Some("feature 1"); 2]);
    assert!(imported.report.notes[0].contains("property table without"));
}

#[test]
fn names_are_cleaned_and_made_unique() {
    let names = ["=S1/Q1", " T1\n", "T1", "", "T1#2"];
    let mut builder = square_with_features([0; 4], &names);
    let primitives: Value = (0..5_u8)
        .map(|id| {
            let ids = builder.accessor(&[id; 4], 5121, "SCALAR", 4);
            let mut primitive = builder.primitive().clone();
            primitive["attributes"]["_FEATURE_ID_0"] = json!(ids);
            primitive
        })
        .collect();
    builder.json["meshes"][0]["primitives"] = primitives;
    let expected = ["=S1_Q1", "T1", "T1#2", "feature 3", "T1#2#2"];
    assert_eq!(builder.import().model.features, [expected]);
}

#[test]
fn the_same_row_of_two_tables_is_two_features() {
    let mut builder = square_with_features([0; 4], &["T1"]);
    let mut second = builder.primitive().clone();
    second["extensions"]["EXT_mesh_features"]["featureIds"][0]["propertyTable"] = json!(1);
    push(&mut builder.json["meshes"][0]["primitives"], second);
    let list = builder.json.pointer_mut(TABLE.strip_suffix("/0").unwrap()).unwrap();
    let mut table = list[0].clone();
    let values = builder.view(b"Q1");
    table["properties"]["tag"]["values"] = json!(values);
    push(builder.json.pointer_mut(TABLE.strip_suffix("/0").unwrap()).unwrap(), table);
    let imported = builder.import();
    assert_eq!(owners(&imported), [Some("T1"), Some("T1"), Some("Q1"), Some("Q1")]);
    assert_eq!(imported.model.meshes[0].positions.len(), 8);
}

#[test]
fn features_count_towards_their_limit() {
    let mut builder = square_with_features([0, 0, 0, 1], &["T1", "T2"]);
    let indices = builder.accessor(&shorts(&[0, 1, 2, 3, 0, 2]), 5123, "SCALAR", 6);
    builder.primitive()["indices"] = json!(indices);
    let limits = |max_features| ImportLimits { max_features, ..Default::default() };
    import_bytes(&builder.bytes(), None, &limits(2)).unwrap();
    let error = import_bytes(&builder.bytes(), None, &limits(1)).unwrap_err().to_string();
    assert!(error.contains("2 features, and the limit is 1"), "{error}");
}

/// A strip of `count` triangles, each a feature but for every `gap`th.
fn strip(count: u32, gap: u32) -> Builder {
    let mut builder = square_with_features([0; 4], &["T1"]);
    let corners = (0..3 * count).map(|i| [(i / 3) as f32, (i % 3) as f32, (i % 2) as f32]);
    let positions: Vec<f32> = corners.flatten().collect();
    let ids: Vec<f32> = (0..3 * count).map(|i| (i / 3) as f32).collect();
    let positions = builder.accessor(&floats(&positions), 5126, "VEC3", 3 * count as usize);
    let ids = builder.accessor(&floats(&ids), 5126, "SCALAR", 3 * count as usize);
    *builder.primitive() = json!({
        "attributes": { "POSITION": positions, "_FEATURE_ID_0": ids },
        "extensions": { "EXT_mesh_features": { "featureIds":
            [{ "featureCount": count, "attribute": 0, "nullFeatureId": gap }] } } });
    builder
}

#[test]
fn features_are_exported_as_they_were_imported() {
    // Names and ids of two bytes, and ids that need floats.
    for builder in
        [square_with_features([1, 0, 0, 0], &["Ü", "=S1"]), strip(9, 4), strip(70_000, 4)]
    {
        let first = builder.import();
        let file = write_glb(&first.model).unwrap();
        let again = import(&file).unwrap();
        assert_eq!(again.model.features, first.model.features);
        assert_eq!(again.model.meshes, first.model.meshes);
        assert!(again.report.notes.is_empty(), "{:?}", again.report.notes);
        assert_eq!(write_glb(&again.model).unwrap(), file);
    }
}
