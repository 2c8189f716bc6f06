use super::testing::unit_pairs;
use super::*;

#[test]
fn every_spelling_is_of_one_unit() {
    let all: Vec<&str> = rows().flat_map(|spellings| spellings.iter().copied()).collect();
    for spelling in &all {
        assert_eq!(all.iter().filter(|other| *other == spelling).count(), 1, "{spelling}");
    }
}

#[test]
fn units_conflict_where_both_are_known() {
    use UnitAgreement::{Agrees, Conflicts, Unknown};
    for (one, other, agreement) in [
        ("°C", "degC", Agrees),
        ("°C", "DEG C", Agrees),
        ("°C", "°F", Conflicts),
        ("A", "kA", Conflicts),
        ("kV", "Kv", Agrees),
        // Case decides of a prefix.
        ("MW", "mW", Unknown),
        ("MV", "mV", Conflicts),
        ("s", "S", Unknown),
        ("°C", "apples", Unknown),
        ("", "V", Agrees),
        ("ppm", "µl/l", Agrees),
        ("bar", "mbar", Conflicts),
        ("mbar", "hPa", Agrees),
        ("barg", "bar(g)", Agrees),
        ("barg", "bar(a)", Conflicts),
        ("barg", "bar", Unknown),
        ("kPa abs", "barg", Conflicts),
        ("kPaG", "kPa", Unknown),
        ("psig", "bar", Conflicts),
    ] {
        assert_eq!(TagUnit::new(one).compare([other]), agreement, "{one} {other}");
        assert_eq!(TagUnit::new(other).compare([one]), agreement, "{other} {one}");
        assert_eq!(units_conflict(one, other), agreement == Conflicts, "{one} {other}");
    }
}

#[test]
fn names_of_one_source_that_contradict_each_other_count() {
    let unit = TagUnit::new("Mvar");
    assert_eq!(unit.compare(["kvar", "Mvar"]), UnitAgreement::Conflicts);
    assert_eq!(unit.compare(["Mvar", "kvar"]), UnitAgreement::Conflicts);
    assert_eq!(unit.compare(["megavar", "Mvar"]), UnitAgreement::Agrees);
    assert_eq!(unit.compare(["megavar", ""]), UnitAgreement::Unknown);
    assert_eq!(unit.compare([]), UnitAgreement::Agrees);
    assert_eq!(TagUnit::default().compare(["kvar"]), UnitAgreement::Agrees);
}

#[test]
fn every_pair_of_units_has_its_outcome_and_its_remark() {
    let pairs = unit_pairs();
    assert!(pairs.len() > 5000, "{}", pairs.len());
    for pair in pairs {
        let unit = TagUnit::new(pair.tag);
        let agreement = unit.compare([pair.source]);
        assert_eq!(agreement != UnitAgreement::Conflicts, pair.may_be_good, "{pair:?}");
        assert_eq!(unit.remark(agreement, pair.source).is_some(), pair.must_be_told, "{pair:?}");
    }
}

#[test]
fn an_agreement_never_makes_a_quality_better() {
    use UnitAgreement::{Agrees, Conflicts, Unknown, Unreadable};
    let [uncertain, bad] = [Quality::Uncertain(Reason::Stale), Quality::Bad(Reason::Sensor)];
    let configuration = Reason::Configuration;
    for (agreement, of_good, of_uncertain) in [
        (Agrees, Quality::Good, uncertain),
        (Unknown, Quality::Good, uncertain),
        (Unreadable, Quality::Uncertain(configuration), uncertain),
        (Conflicts, Quality::Bad(configuration), Quality::Bad(configuration)),
    ] {
        assert_eq!(agreement.limit(Quality::Good), of_good);
        assert_eq!(agreement.limit(uncertain), of_uncertain);
        assert_eq!(agreement.limit(bad), bad);
    }
}

#[test]
fn remarks_are_short_and_name_both_units() {
    let unit = TagUnit::new("MW");
    let long = format!("k\n{}", "x".repeat(10_000));
    let remark = unit.remark(UnitAgreement::Conflicts, &long).unwrap();
    assert!(remark.len() < 300 && !remark.contains('\n') && remark.contains("'MW'"), "{remark}");
}
