//! Features and names of features that lie.

use serde_json::{Value, json};

use super::super::{Builder, TABLE, push, square_with_features};
use super::{Cases, add};

const SET: &str = "/meshes/0/primitives/0/extensions/EXT_mesh_features/featureIds/0";

/// A square with two features with one value changed.
fn changed(
    c: &mut Cases,
    name: &'static str,
    pointer: &str,
    value: Value,
    expected: &'static [&'static str],
) {
    let mut document = square_with_features([0, 0, 0, 1], &["T1", "T2"]).document();
    match document.pointer_mut(pointer) {
        Some(old) => *old = value,
        None => {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            document.pointer_mut(parent).unwrap()[key] = value;
        }
    }
    add(c, name, serde_json::to_vec(&document).unwrap(), expected);
}

/// A square whose four feature ids are these bytes.
fn with_ids(c: &mut Cases, name: &'static str, component: u32, ids: &[u8], expected: &'static str) {
    let mut builder = square_with_features([0, 0, 0, 1], &["T1", "T2"]);
    let accessor = builder.accessor(ids, component, "SCALAR", 4);
    builder.primitive()["attributes"]["_FEATURE_ID_0"] = json!(accessor);
    add(c, name, builder.bytes(), Vec::leak(vec!["/accessors/3", expected]));
}

pub fn features(c: &mut Cases) {
    let floats = |ids: [f32; 4]| super::super::floats(&ids);
    let words = |ids: [u32; 4]| ids.iter().flat_map(|id| id.to_le_bytes()).collect::<Vec<_>>();
    let below_two = "element 3 is no whole number below 2";
    with_ids(c, "a row too many", 5121, &[0, 1, 0, 2], below_two);
    with_ids(c, "half a feature", 5126, &floats([0.0, 1.0, 1.0, 0.5]), below_two);
    with_ids(c, "a negative feature", 5126, &floats([0.0, 1.0, 1.0, -1.0]), below_two);
    with_ids(c, "no number", 5126, &floats([0.0, 1.0, 1.0, f32::NAN]), below_two);
    with_ids(c, "all numbers", 5126, &floats([0.0, 1.0, 1.0, f32::INFINITY]), below_two);
    with_ids(c, "four billion", 5125, &words([0, 1, 1, u32::MAX - 1]), below_two);
    let mut free = square_with_features([0, 0, 0, 1], &["T1"]);
    free.primitive()["extensions"]["EXT_mesh_features"]["featureIds"][0]["propertyTable"].take();
    let wide = free.accessor(&floats([0.0, 1.0, 1e9, 1.0]), 5126, "SCALAR", 4);
    free.primitive()["attributes"]["_FEATURE_ID_0"] = json!(wide);
    add(c, "beyond what floats count", free.bytes(), &["/accessors/3", "element 2"]);
    let none = free.accessor(&words([0, 1, 1, u32::MAX]), 5125, "SCALAR", 4);
    free.primitive()["attributes"]["_FEATURE_ID_0"] = json!(none);
    add(c, "the largest word", free.bytes(), &["/accessors/4", "element 3"]);
    changed(
        c,
        "attribute that is not there",
        &format!("{SET}/attribute"),
        json!(1),
        &["featureIds/0/attribute", "no attribute _FEATURE_ID_1"],
    );
    changed(
        c,
        "no such feature accessor",
        "/meshes/0/primitives/0/attributes/_FEATURE_ID_0",
        json!(99),
        &["/attributes/_FEATURE_ID_0", "accessor 99 is named, but there are 3"],
    );
    changed(
        c,
        "fewer features than vertices",
        "/accessors/2/count",
        json!(3),
        &["/attributes", "attributes of 4 and 3 vertices"],
    );
    changed(
        c,
        "features in three dimensions",
        "/meshes/0/primitives/0/attributes/_FEATURE_ID_0",
        json!(0),
        &["/attributes/_FEATURE_ID_0", "feature ids cannot be VEC3"],
    );
    changed(
        c,
        "normalised features",
        "/accessors/2/normalized",
        json!(true),
        &["/attributes/_FEATURE_ID_0", "cannot be normalised"],
    );
    changed(
        c,
        "features beyond the bytes",
        "/accessors/2/count",
        json!(4_000_000_000_u32),
        &["/accessors/2", "bytes, but there are"],
    );
    changed(
        c,
        "no such property table",
        &format!("{SET}/propertyTable"),
        json!(1),
        &["featureIds/0/propertyTable", "property table 1 is named, but there are 1"],
    );
    changed(
        c,
        "a property table of 2^64",
        &format!("{SET}/propertyTable"),
        json!(u64::MAX),
        &["featureIds", "18446744073709551615 is more than"],
    );
    for (name, value) in [("a negative set", json!(-1)), ("a set in words", json!("first"))] {
        changed(c, name, &format!("{SET}/attribute"), value, &["featureIds", "line 1"]);
    }
    let sets = SET.strip_suffix("/0").unwrap();
    changed(c, "sets that are none", sets, json!(3), &["featureIds", "expected a list"]);
}

pub fn tables(c: &mut Cases) {
    let column = format!("{TABLE}/properties/tag");
    let at = |field: &str| format!("{column}/{field}");
    for (name, field) in [("no values", "values"), ("no offsets", "stringOffsets")] {
        changed(c, name, &at(field), json!(99), &["/properties/tag/", "buffer view 99"]);
    }
    let missing = json!({ "values": 3 });
    changed(c, "offsets left out", &column, missing, &["/properties/tag", "without stringOffsets"]);
    changed(
        c,
        "unknown offsets",
        &at("stringOffsetType"),
        json!("UINT128"),
        &["/properties/tag/stringOffsetType", "unknown type"],
    );
    changed(
        c,
        "wider offsets than there are",
        &at("stringOffsetType"),
        json!("UINT64"),
        &["/properties/tag/stringOffsets", "24 bytes, but there are 6"],
    );
    let count = format!("{TABLE}/count");
    let expected = &["/properties/tag/stringOffsets", "bytes, but there are 6"];
    changed(c, "four billion rows", &count, json!(4_000_000_000_u32), expected);
    let expected = &["/propertyTables/0/count", "18446744073709551615 is more than"];
    changed(c, "rows of 2^64", &count, json!(u64::MAX), expected);
    let offsets = |c: &mut Cases, name, offsets: [u16; 3], expected| {
        let mut builder = square_with_features([0, 0, 0, 1], &["T1", "Ü"]);
        let view = builder.view(&super::super::shorts(&offsets));
        *builder.json.pointer_mut(&at("stringOffsets")).unwrap() = json!(view);
        add(c, name, builder.bytes(), expected);
    };
    offsets(
        c,
        "names beyond the view",
        [0, 2, 5],
        &["/properties/tag", "5 bytes, but there are 4"],
    );
    offsets(c, "names backwards", [4, 2, 0], &["/properties/tag", "the names needs 4 bytes"]);
    offsets(
        c,
        "a name before the last",
        [2, 0, 4],
        &["/properties/tag", "row 0 does not end at 0"],
    );
    offsets(c, "a name over the end", [0, 9, 4], &["/properties/tag", "row 0 does not end at 9"]);
    offsets(c, "half a letter", [0, 3, 4], &["/properties/tag", "row 0 does not end at 3"]);
    let mut builder = square_with_features([0, 0, 0, 1], &["T1", "T2"]);
    let view = builder.view(&[b'T', 0xFF, 0xFE, b'2']);
    *builder.json.pointer_mut(&at("values")).unwrap() = json!(view);
    add(c, "names that are no text", builder.bytes(), &["/properties/tag", "byte 1", "UTF-8"]);
    changed(c, "a table in words", TABLE, json!("T1"), &["EXT_structural_metadata", "line 1"]);
}

pub fn floods(c: &mut Cases) {
    let empty = json!({ "class": "piece", "count": 0 });
    let list = "/extensions/EXT_structural_metadata/propertyTables";
    let expected = &["EXT_structural_metadata", "257 items in one place, and the limit is 256"];
    changed(c, "tables", list, json!(vec![empty; 1_000_000]), expected);
    let columns = |i: usize| (format!("a{i}"), json!({ "values": 0 }));
    let columns: Value = (0..100_000).map(columns).collect::<serde_json::Map<_, _>>().into();
    changed(c, "columns", &format!("{TABLE}/properties"), columns, expected);
    let expected = &["featureIds", "257 items in one place, and the limit is 256"];
    let sets = json!(vec![json!({}); 2_000_000]);
    changed(c, "sets", SET.strip_suffix("/0").unwrap(), sets, expected);

    // 250 tables and 1000 primitives, all of the same megabyte of names and ids.
    let size = 1 << 20;
    let mut builder = square_with_features([0; 4], &["T1"]);
    let bytes = builder.view(&vec![b'a'; size]);
    let zeros = builder.view(&vec![0; size]);
    let table = json!({ "class": "piece", "count": size / 2 - 1, "properties": {
        "tag": { "values": bytes, "stringOffsets": zeros, "stringOffsetType": "UINT16" } } });
    *builder.json.pointer_mut(list).unwrap() = json!(vec![table; 250]);
    let ids = json!({ "bufferView": zeros, "componentType": 5121, "type": "SCALAR", "count": 4 });
    let ids = push(&mut builder.json["accessors"], ids);
    builder.primitive()["attributes"]["_FEATURE_ID_0"] = json!(ids);
    repeat(&mut builder, 1000, |primitive, i| {
        let set = &mut primitive["extensions"]["EXT_mesh_features"]["featureIds"][0];
        set["propertyTable"] = json!(i % 250);
    });
    add(
        c,
        "tables of the same bytes",
        builder.bytes(),
        &["/propertyTables/", "elements for the bytes there are"],
    );

    let mut builder = square_with_features([0; 4], &["T1"]);
    let zeros = builder.view(&vec![0; 12 * size]);
    let many = |shape: &str, component: u32| json!({ "bufferView": zeros, "componentType": component, "type": shape, "count": size });
    let positions = push(&mut builder.json["accessors"], many("VEC3", 5126));
    let ids = push(&mut builder.json["accessors"], many("SCALAR", 5121));
    builder.primitive()["attributes"] = json!({ "POSITION": positions, "_FEATURE_ID_0": ids });
    repeat(&mut builder, 1000, |primitive, i| {
        let set = &mut primitive["extensions"]["EXT_mesh_features"]["featureIds"][0];
        set["nullFeatureId"] = json!(i);
    });
    let expected = &["/accessors/4", "elements for the bytes there are"];
    add(c, "one set of ids with many nulls", builder.bytes(), expected);

    let count = 100_001;
    let mut builder = Builder::square();
    let positions = builder.accessor(&vec![0; 12 * 3 * count], 5126, "VEC3", 3 * count);
    let ids: Vec<u8> = (0..3 * count as u32).flat_map(|i| (i / 3).to_le_bytes()).collect();
    let ids = builder.accessor(&ids, 5125, "SCALAR", 3 * count);
    *builder.primitive() = json!({
        "attributes": { "POSITION": positions, "_FEATURE_ID_0": ids },
        "extensions": { "EXT_mesh_features": { "featureIds": [{ "attribute": 0 }] } } });
    builder.json["extensionsUsed"] = json!(["EXT_mesh_features"]);
    add(c, "features", builder.bytes(), &["/meshes/0", "100001 features, and the limit is 100000"]);
}

/// The first primitive so many times, each with a change.
fn repeat(builder: &mut Builder, times: usize, change: impl Fn(&mut Value, usize)) {
    let one = builder.primitive().clone();
    let primitives = (0..times).map(|i| {
        let mut primitive = one.clone();
        change(&mut primitive, i);
        primitive
    });
    builder.json["meshes"][0]["primitives"] = primitives.collect();
}
