//! Single cases of matching; `tests/seeded_names.rs` has the many.

use super::*;
use crate::NodeName;

/// Nodes under the place of a model.
fn model_of(nodes: &[&str]) -> Catalogue {
    let mut names = vec![NodeName { id: "yard", name: "yard", parent: None }];
    names.extend(nodes.iter().map(|id| NodeName { id, name: id, parent: Some(0) }));
    Catalogue::new(&names).expect("they are few")
}

/// Matches one tag, among others that make a list of it, with nodes.
#[track_caller]
fn check(nodes: &[&str], tag: &str, expected: Option<&str>) {
    let model = model_of(nodes);
    let tag = TagName { id: tag, is_state: true, ..TagName::default() };
    let proposal = &propose(&[tag], &model)[0];
    assert_eq!(proposal.node.as_deref(), expected, "{}: {proposal:?}", tag.id);
}

const BAYS: [&str; 6] = [
    "=S12D1Q3-QA1",
    "=S12D1Q3-QB1",
    "=S12D1Q3-QB9",
    "=S12E1Q3-QA1",
    "=S12D1Q4-QB9",
    "=S12D1Q3-UC1",
];

#[test]
fn words_of_the_field_mean_the_same() {
    for tag in [
        "D1.Q03.CB1.Pos",
        "220kV_Bay3_BRK_Status",
        "S12D1Q3/XCBR1.Pos.stVal",
        "220 KV FEEDER-003 QA01",
    ] {
        check(&BAYS, tag, Some("=S12D1Q3-QA1"));
    }
    check(&BAYS, "D1_Q4_Isolator9_Pos", Some("=S12D1Q4-QB9"));
}

#[test]
fn what_is_open_or_missing_is_not_guessed() {
    // Which level, which isolator, and what of the bay?
    for tag in ["Q3.CB1.Pos", "D1.Q3.DS.Pos", "D1.Q3.Trip", "D1.Q3"] {
        check(&BAYS, tag, None);
    }
    // Another bay, another isolator, a kind that is not there, a name of elsewhere.
    for tag in ["D1.Q5.CB1", "D1.Q3.DS2", "D1.Q3.CT1.Cur", "E1.Q4.DS9", "Linden.D1.Q3.CB1"] {
        check(&BAYS, tag, None);
    }
}

#[test]
fn a_position_is_of_a_switch_and_oil_of_a_transformer() {
    let nodes = ["T1", "T1 tank", "T1 conservator", "CB1"];
    check(&nodes, "T1.TopOil", Some("T1 tank"));
    check(&nodes, "T1_OilLevel", Some("T1 conservator"));
    check(&nodes, "T1_Load", Some("T1"));
    check(&nodes, "CB1.OilTemp", None);
    check(&nodes, "T1.Position", None);
    check(&nodes, "CB1.Position", Some("CB1"));
    check(&nodes, "T2.TopOil", None);
}

#[test]
fn names_of_people_are_matched_as_they_are() {
    let nodes = ["Linden CB", "Ahorn CB", "Linden DS"];
    check(&nodes, "LINDEN_BRK_POS", Some("Linden CB"));
    check(&nodes, "AHORN_ISO_POS", None);
    check(&nodes, "BIRKE_CB_POS", None);
    check(&nodes, "CB_POS", None);
}

#[test]
fn the_description_counts_where_the_id_says_nothing() {
    let model = model_of(&BAYS);
    let tag = |id, description| TagName { id, description, is_state: true, ..TagName::default() };
    let tags = [
        tag("P1001", "220 kV bay 3 breaker position"),
        tag("D1.Q3.QA1.Pos", "220 kV bay 4 breaker position"),
        tag("D1.Q3.QA1.Alm", "a breaker alarm"),
    ];
    let nodes: Vec<_> = propose(&tags, &model).into_iter().map(|p| p.node).collect();
    let breaker = Some("=S12D1Q3-QA1".to_owned());
    assert_eq!(nodes, [breaker.clone(), None, breaker], "a contradiction is a doubt");
}

/// The parts of one transformer are more than are judged.
#[test]
fn the_part_is_found_among_many() {
    let mut nodes: Vec<String> = (1..=200).map(|i| format!("radiator {i}")).collect();
    nodes.extend(["conservator", "tank", "bushing 1U", "bushing 1V"].map(String::from));
    let mut names = vec![NodeName { id: "transformer", name: "transformer", parent: None }];
    names.extend(nodes.iter().map(|id| NodeName { id, name: id, parent: Some(0) }));
    let model = Catalogue::new(&names).expect("they are few");
    let ids = ["T1.OilLevel", "T1.TopOil", "T1.U12", "T1.Load", "T1.Bushing1V.Tmp", "T1.H2"];
    let tags = ids.map(|id| TagName { id, ..TagName::default() });
    let nodes: Vec<_> = propose(&tags, &model).into_iter().map(|p| p.node).collect();
    let expected = ["conservator", "tank", "transformer", "transformer", "bushing 1V", "tank"];
    assert_eq!(nodes, expected.map(|node| Some(node.to_owned())));
}
