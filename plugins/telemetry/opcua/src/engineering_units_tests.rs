use async_opcua::types::{ExtensionObject, LocalizedText};
use source_units::testing::unit_pairs;
use source_units::{TagUnit, UnitAgreement, find_unit};

use super::*;

fn value(name: &str, namespace: &str, unit_id: i32) -> DataValue {
    let unit = EUInformation {
        namespace_uri: namespace.into(),
        unit_id,
        display_name: LocalizedText::new("", name),
        description: LocalizedText::null(),
    };
    DataValue::value_only(Variant::ExtensionObject(ExtensionObject::from_message(unit)))
}

fn id_of(code: &str) -> i32 {
    code.bytes().fold(0, |id, byte| id << 8 | i32::from(byte))
}

#[test]
fn unit_ids_are_codes_of_unece() {
    // UNECE_to_OPCUA.csv of the OPC Foundation.
    for (id, symbol) in [(5_062_999, "MW"), (4_408_652, "°C"), (4_604_232, "°F"), (20_529, "%")] {
        assert_eq!(symbol_of_id(id), Some(symbol));
    }
    for (code, symbol) in UNECE_CODES {
        assert_eq!(symbol_of_id(id_of(code)), Some(*symbol));
        let is_known = find_unit(symbol).is_some() || symbol.starts_with("psi(");
        assert!(is_known && UNECE_CODES.iter().filter(|(other, _)| other == code).count() == 1);
    }
    assert_eq!([-1, 0, 1, i32::MIN].map(symbol_of_id), [None; 4]);
}

#[test]
fn every_pair_of_units_is_judged_by_name_and_by_id() {
    for pair in unit_pairs() {
        let judge = |data: &DataValue| {
            let stated = StatedUnit::from_value(data).unwrap().unwrap();
            TagUnit::new(pair.tag).compare(stated.names())
        };
        let by_name = judge(&value(pair.source, "urn:vendor", 4711));
        assert_eq!(by_name != UnitAgreement::Conflicts, pair.may_be_good, "{pair:?}");
        let symbol = find_unit(pair.source);
        let code = UNECE_CODES.iter().find(|(_, known)| Some(*known) == symbol);
        if let Some((code, _)) = code {
            // An id alone, and beside a name that nobody knows.
            for name in ["", "apples"] {
                let by_id = judge(&value(name, UNECE_NAMESPACE, id_of(code)));
                assert_eq!(by_id != UnitAgreement::Conflicts, pair.may_be_good, "{pair:?}");
            }
        }
    }
}

#[test]
fn a_name_and_an_id_that_contradict_each_other_agree_with_nothing() {
    // As printed for MAR in the table of the OPC Foundation.
    let stated =
        StatedUnit::from_value(&value("kvar", UNECE_NAMESPACE, id_of("MAR"))).unwrap().unwrap();
    for tag in ["kvar", "Mvar"] {
        assert_eq!(TagUnit::new(tag).compare(stated.names()), UnitAgreement::Conflicts);
    }
    assert_eq!(stated.in_words(), "kvar (by its id Mvar)");
    // An id of another namespace is no code.
    let stated =
        StatedUnit::from_value(&value("kvar", "urn:vendor", id_of("MAR"))).unwrap().unwrap();
    assert_eq!(TagUnit::new("kvar").compare(stated.names()), UnitAgreement::Agrees);
    assert_eq!(StatedUnit::from_value(&value("", "urn:vendor", -1)), None);
    // A code of UNECE that is not in the table is a unit that is not known.
    let stated = StatedUnit::from_value(&value("", UNECE_NAMESPACE, id_of("X99")));
    let stated = stated.unwrap().unwrap();
    assert_eq!(TagUnit::new("MW").compare(stated.names()), UnitAgreement::Unknown);
    assert_eq!(StatedUnit::from_value(&value("", UNECE_NAMESPACE, 0)), None);
    assert_eq!(StatedUnit::from_value(&DataValue::default()), None);
}

#[test]
fn a_property_of_another_type_cannot_be_read() {
    let range = ExtensionObject::from_message(async_opcua::types::Range { low: 0.0, high: 1.0 });
    for variant in [Variant::Int32(7), Variant::Double(1.5), Variant::ExtensionObject(range)] {
        let stated = StatedUnit::from_value(&DataValue::value_only(variant.clone()));
        assert_eq!(stated, Some(Err(UnreadableUnit)), "{variant:?}");
    }
    for nothing in [Variant::Empty, Variant::ExtensionObject(ExtensionObject::null())] {
        assert_eq!(StatedUnit::from_value(&DataValue::value_only(nothing)), None);
    }
}
