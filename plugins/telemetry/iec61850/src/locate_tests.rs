use iec61850_rs::proto::mms::typespec::Component;

use super::*;

fn structure(parts: Vec<(&str, TypeSpec)>) -> TypeSpec {
    let component =
        |(name, type_spec): (&str, TypeSpec)| Component { name: Some(name.into()), type_spec };
    let components = parts.into_iter().map(component).collect();
    TypeSpec::Structure { packed: false, components }
}

fn float() -> TypeSpec {
    TypeSpec::FloatingPoint { format_width: 32, exponent_width: 8 }
}

/// A measured value, as servers order it.
fn measured() -> TypeSpec {
    structure(vec![
        ("instMag", structure(vec![("f", float())])),
        ("mag", structure(vec![("f", float())])),
        ("q", TypeSpec::BitString(-13)),
        ("t", TypeSpec::UtcTime),
    ])
}

fn path(text: &str) -> Vec<String> {
    text.split('.').filter(|part| !part.is_empty()).map(str::to_owned).collect()
}

fn share(value: &[usize], quality: &[usize], time: &[usize]) -> Share {
    Share {
        value: Some(value.to_vec()),
        quality: Some(quality.to_vec()),
        time: Some(time.to_vec()),
    }
}

#[test]
fn the_value_of_a_class_is_found_with_quality_and_time() {
    for text in ["", "mag", "mag.f"] {
        let place = locate(&measured(), &path(text)).unwrap();
        assert_eq!(place.share(&[]), Some(share(&[1, 0], &[2], &[3])), "{text}");
    }
    let instant = locate(&measured(), &path("instMag")).unwrap();
    assert_eq!(instant.share(&[]), Some(share(&[0, 0], &[2], &[3])));
}

#[test]
fn parts_of_a_data_set_have_their_shares() {
    let three_phase = structure(vec![("phsA", measured()), ("phsB", measured())]);
    let place = locate(&three_phase, &path("phsB")).unwrap();
    let object = Name { domain: "L".into(), item: "MMXU1$MX$PhV".into() };
    assert_eq!(place.variable(&object).to_string(), "L/MMXU1$MX$PhV$phsB");
    assert_eq!(place.share(&[]), Some(share(&[1, 1, 0], &[1, 2], &[1, 3])));
    assert_eq!(place.share(&["phsB"]), Some(share(&[1, 0], &[2], &[3])));
    let value = place.share(&["phsB", "mag"]).unwrap();
    assert_eq!((value.value, value.quality, value.time), (Some(vec![0]), None, None));
    let quality = place.share(&["phsB", "q"]).unwrap();
    assert_eq!((quality.value, quality.quality), (None, Some(vec![])));
    for other in
        [&["phsA"][..], &["phsA", "q"], &["q"], &["phsB", "instMag"], &["phsB", "mag", "q"]]
    {
        assert_eq!(place.share(other), None, "{other:?}");
    }
}

#[test]
fn what_has_no_quality_is_read_by_itself() {
    let plate = structure(vec![("vendor", TypeSpec::VisibleString(-255)), ("i", float())]);
    let place = locate(&plate, &[]).unwrap();
    let object = Name { domain: "L".into(), item: "LLN0$DC$NamPlt".into() };
    assert_eq!(place.variable(&object).to_string(), "L/LLN0$DC$NamPlt$i");
    let whole = Share { value: Some(vec![]), quality: None, time: None };
    assert_eq!(place.share(&["i"]), Some(whole.clone()));
    // A text with its structure, and as a member of a data set by itself.
    let place = locate(&plate, &path("vendor")).unwrap();
    assert_eq!(place.variable(&object).to_string(), "L/LLN0$DC$NamPlt");
    let within = Share { value: Some(vec![0]), quality: None, time: None };
    assert_eq!(place.share(&[]), Some(within));
    assert_eq!(place.share(&["vendor"]), Some(whole));
    let status = structure(vec![
        ("stVal", TypeSpec::VisibleString(-255)),
        ("q", TypeSpec::BitString(-13)),
        ("t", TypeSpec::UtcTime),
    ]);
    assert_eq!(locate(&status, &[]).unwrap().share(&[]), Some(share(&[0], &[1], &[2])));
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let fault = |text: &str| locate(&measured(), &path(text)).unwrap_err();
    assert_eq!(fault("none"), "there is no none in the data object, but instMag, mag, q, t");
    assert_eq!(fault("mag.f.x"), "there is no x below f");
    let phases = structure(vec![("phsA", measured()), ("phsB", measured())]);
    let fault = locate(&phases, &[]).unwrap_err();
    assert_eq!(fault, "the data object has several parts, name one: phsA, phsB");
    let deep = (0..20).fold(float(), |inner, _| structure(vec![("f", inner)]));
    assert!(locate(&deep, &[]).unwrap_err().contains("deeper than"));
}
