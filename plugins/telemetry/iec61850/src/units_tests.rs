use source_units::find_unit;
use source_units::testing::unit_pairs;

use super::*;

fn stated(si_unit: i64, multiplier: i64) -> StatedUnit {
    let value = Value::Structure(vec![Value::Integer(si_unit), Value::Integer(multiplier)]);
    StatedUnit::from_value(&value).unwrap().unwrap()
}

#[test]
fn units_have_their_symbols() {
    for (si_unit, multiplier, symbol) in [
        (38, 6, "MW"),
        (62, 3, "kW"),
        (63, 6, "Mvar"),
        (61, 6, "MVA"),
        (29, 3, "kV"),
        (5, 0, "A"),
        (23, 0, "°C"),
        (39, 5, "bar"),
        (39, 2, "hPa"),
        (9, 0, "°"),
        (38, 7, "10^7 W"),
        (99, 3, "kSIUnit 99"),
    ] {
        assert_eq!(stated(si_unit, multiplier).in_words(), symbol);
    }
    // Without a multiplier, and the number of an enumeration that was never set.
    let alone = |number| StatedUnit::from_value(&Value::Structure(vec![Value::Integer(number)]));
    assert_eq!(alone(38).unwrap().unwrap().in_words(), "W");
    assert_eq!(alone(0), Ok(None));
    let text = || Value::VisibleString("MW".into());
    for value in [
        Value::Integer(38),
        text(),
        Value::Structure(Vec::new()),
        Value::Structure(vec![text()]),
        Value::Structure(vec![Value::Integer(38), text()]),
    ] {
        assert_eq!(StatedUnit::from_value(&value), Err(UnreadableUnit), "{value:?}");
    }
}

#[test]
fn every_pair_of_units_that_the_standard_can_state_is_judged() {
    let mut by_symbol = std::collections::HashMap::new();
    for (si_unit, _) in SI_UNITS {
        for (multiplier, _) in PREFIXES {
            let unit = stated(*si_unit, *multiplier);
            if let Some(symbol) = find_unit(&unit.in_words()) {
                by_symbol.entry(symbol).or_insert(unit);
            }
        }
    }
    by_symbol.insert("bar", stated(39, 5));
    let mut judged = 0;
    for pair in unit_pairs() {
        let Some(unit) = find_unit(pair.source).and_then(|symbol| by_symbol.get(symbol)) else {
            continue;
        };
        let agreement = unit.compare(&TagUnit::new(pair.tag));
        assert_eq!(agreement != UnitAgreement::Conflicts, pair.may_be_good, "{pair:?} {unit:?}");
        judged += 1;
    }
    assert!(judged > 2000, "{judged}");
}

#[test]
fn a_power_of_ten_is_another_unit() {
    use UnitAgreement::{Agrees, Conflicts, Unknown};
    for (si_unit, multiplier, tag, agreement) in [
        (38, 6, "MW", Agrees),
        (38, 3, "MW", Conflicts),
        (38, 0, "MW", Conflicts),
        // 10^4 W has no symbol, and is no MW and no W.
        (38, 4, "MW", Conflicts),
        (38, 4, "W", Conflicts),
        (23, 3, "°C", Conflicts),
        (99, 3, "MW", Unknown),
        (1, 0, "%", Unknown),
        (47, 0, "m", Unknown),
    ] {
        assert_eq!(stated(si_unit, multiplier).compare(&TagUnit::new(tag)), agreement, "{tag}");
    }
}

#[test]
fn units_are_beside_the_value_under_another_constraint() {
    let unit = |item: &str, names: &[&str]| {
        let object = Name { domain: "L".into(), item: item.into() };
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        variable_of_unit(&object, &names).map(|name| name.item)
    };
    let some = |item: &str| Some(item.to_owned());
    assert_eq!(unit("MMXU1$MX$TotW", &["mag", "f"]), some("MMXU1$CF$TotW$units"));
    assert_eq!(
        unit("MMXU1$MX$PhV", &["phsA", "cVal", "mag", "f"]),
        some("MMXU1$CF$PhV$phsA$units")
    );
    assert_eq!(unit("PTOC1$SP$StrVal", &["setMag", "f"]), some("PTOC1$CF$StrVal$units"));
    // An angle, a count, a status and a time are not in these units.
    assert_eq!(unit("MMXU1$MX$PhV", &["phsA", "cVal", "ang", "f"]), None);
    assert_eq!(unit("MMXU1$MX$TotVAr", &["mag", "i"]), None);
    assert_eq!(unit("GGIO1$ST$IntIn1", &["stVal"]), None);
    assert_eq!(unit("MMXU1$MX$TotW", &["t"]), None);
}
