use super::*;

fn convert(value: f64, from: &str, to: &str, quantity: Quantity) -> Option<f64> {
    UnitConversion::between(from, to, quantity).map(|conversion| conversion.apply(value))
}

#[test]
fn values_are_converted() {
    for (value, from, to, quantity, wanted) in [
        (212.0, "°F", "°C", Quantity::Temperature, 100.0),
        (-40.0, "degF", "degC", Quantity::Temperature, -40.0),
        (293.15, "K", "℃", Quantity::Temperature, 20.0),
        (600.0, "kPa", "bar", Quantity::Pressure, 6.0),
        (0.6, "MPa", "kPa", Quantity::Pressure, 600.0),
        (87.0, "psi", "bar", Quantity::Pressure, 5.998_438_845_056_16),
        (1.2, "kA", "A", Quantity::Current, 1200.0),
        (85.0, "mA", "A", Quantity::Current, 0.085),
        (85.0, "%", "1", Quantity::Ratio, 0.85),
        (0.4, "MVAr", "kvar", Quantity::ReactivePower, 400.0),
        (6.2, "BAR", "MPa", Quantity::Pressure, 0.62),
        (63.0, "Mva", "VA", Quantity::ApparentPower, 63e6),
    ] {
        let found = convert(value, from, to, quantity).expect("a conversion");
        assert!((found - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{from} {to}: {found}");
    }
}

#[test]
fn units_of_another_quantity_and_doubtful_prefixes_are_refused() {
    for (from, quantity) in [
        ("A", Quantity::Ratio),
        ("%", Quantity::Current),
        ("kV", Quantity::Temperature),
        ("mw", Quantity::ActivePower),
        ("ma ", Quantity::ActivePower),
        ("mva", Quantity::ApparentPower),
        ("mpa", Quantity::Pressure),
        ("MA", Quantity::Current),
        ("bars", Quantity::Pressure),
        ("°", Quantity::Temperature),
    ] {
        let to = UNITS.iter().find(|row| row.quantity == quantity).expect("a row").symbols[0];
        assert_eq!(convert(1.0, from, to, quantity), None, "{from}");
    }
}

#[test]
fn pressure_units_may_name_their_zero() {
    let reference = |unit| find(unit, Quantity::Pressure).map(|(unit, zero)| (unit.factor, zero));
    let [absolute, gauge] = [PressureReference::Absolute, PressureReference::Gauge].map(Some);
    for (unit, wanted) in [
        ("bar", Some((1e5, None))),
        ("bar(g)", Some((1e5, gauge))),
        ("barg", Some((1e5, gauge))),
        ("bar rel.", None),
        ("bar rel", Some((1e5, gauge))),
        ("MPa(a)", Some((1e6, absolute))),
        ("kPa abs", Some((1e3, absolute))),
        ("psia", Some((6_894.757_293_168, absolute))),
        ("PSIG", Some((6_894.757_293_168, gauge))),
        ("at", Some((98_066.5, None))),
        ("a", None),
        ("(g)", None),
    ] {
        assert_eq!(reference(unit), wanted, "{unit}");
    }
}

#[test]
fn every_symbol_is_found_as_its_own_unit() {
    for row in UNITS {
        for symbol in row.symbols {
            let (found, _) = find(symbol, row.quantity).expect("itself");
            assert!(std::ptr::eq(found, row), "{symbol}");
        }
    }
}

#[test]
fn values_of_a_tag_are_converted_to_the_unit_of_a_setting() {
    let binding = |unit: &str| Binding {
        node: 0,
        kind: crate::ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: "P1".into(),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: "=Q1".into(),
        role: "pressure".into(),
    };
    let found = |from, to| {
        let conversion = UnitConversion::of_binding_to(&binding(from), to)?;
        Ok::<_, String>((conversion.apply(2.0), conversion.is_assumed))
    };
    assert_eq!(found("kA", "A"), Ok((2_000.0, false)));
    assert_eq!(found(" widgets ", "widgets"), Ok((2.0, false)), "no table knows it");
    assert_eq!(found("", "bar"), Ok((2.0, true)));
    assert_eq!(found("bar", "kPa(a)"), Ok((200.0, true)), "one does not say of what");
    for (from, to) in [("bar(g)", "bar(a)"), ("kA", "kV"), ("widgets", "A")] {
        let finding = found(from, to).unwrap_err();
        assert!(finding.contains("'P1'") && finding.contains(&format!("'{from}'")), "{finding}");
    }
}
