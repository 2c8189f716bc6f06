use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;

fn parse(kind: ValueKind, address: serde_json::Value) -> Result<Point, String> {
    parse_one(&tag_spec(7, "t", kind, address))
}

#[test]
fn references_are_read_in_both_forms() {
    for address in [
        json!({"reference": "IED1LD0/MMXU1.PhV.phsA.cVal", "fc": "MX"}),
        json!({"reference": "IED1LD0/MMXU1$MX$PhV$phsA$cVal"}),
    ] {
        let point = parse(ValueKind::F64, address).unwrap();
        assert_eq!(point.object.to_string(), "IED1LD0/MMXU1$MX$PhV");
        assert_eq!(point.path, ["phsA", "cVal"]);
        assert_eq!(point.reference(), "IED1LD0/MMXU1$MX$PhV$phsA$cVal");
    }
}

#[test]
fn every_fault_has_its_remedy() {
    let long = format!("L/{}.A", "x".repeat(130));
    let cases = [
        (ValueKind::F64, json!({"reference": "L/MMXU1.TotW"}), "fc: give the functional"),
        (ValueKind::F64, json!({"reference": "L/MMXU1.TotW", "fc": "mx"}), "is none of data"),
        (ValueKind::F64, json!({"reference": "L/MMXU1.TotW", "fc": "CO"}), "is none of data"),
        (ValueKind::F64, json!({"reference": "L/CSWI1$CO$Pos"}), "CO is none of data"),
        (ValueKind::F64, json!({"reference": "L/M$MX$T", "fc": "ST"}), "contradicts the MX"),
        (ValueKind::F64, json!({"reference": "MMXU1.TotW", "fc": "MX"}), "write it as"),
        (ValueKind::F64, json!({"reference": "L/MMXU1", "fc": "MX"}), "names no data object"),
        (ValueKind::F64, json!({"reference": "L/M.HA.a(2)", "fc": "MX"}), "not supported"),
        (ValueKind::F64, json!({"reference": long, "fc": "MX"}), "longer than 129"),
        (ValueKind::I64, json!({"reference": "L/M.T", "fc": "MX", "scale": 2}), "f64 tags"),
        (ValueKind::Text, json!({"reference": "L/M.T", "fc": "DC", "scale": 2}), "f64 tags"),
        (ValueKind::Text, json!({"reference": "L/M.T", "fc": "DC", "offset": 0}), "f64 tags"),
        (ValueKind::F64, json!({"reference": "L/M.T", "fc": "MX", "scale": 0}), "not 0"),
        (ValueKind::F64, json!({"reference": "L/M.T", "fc": "MX", "unit": 1}), "unit"),
    ];
    for (kind, address, part) in cases {
        let fault = parse(kind, address.clone()).unwrap_err();
        assert!(fault.contains("'t'") && fault.contains(part), "{address}: {fault}");
    }
}

#[test]
fn points_of_an_object_lie_side_by_side() {
    let tag = |number, reference: &str| {
        tag_spec(number, "t", ValueKind::F64, json!({"reference": reference, "fc": "MX"}))
    };
    let tags = [tag(1, "L/B.X.a"), tag(2, "L/A.X"), tag(3, "L/B.X"), tag(4, "K/B.X")];
    let points = Points::parse(&tags).unwrap();
    let objects: Vec<_> =
        points.objects().into_iter().map(|(name, range)| (name.to_string(), range)).collect();
    assert_eq!(
        objects,
        [("K/B$MX$X".into(), 0..1), ("L/A$MX$X".into(), 1..2), ("L/B$MX$X".into(), 2..4)]
    );
}
