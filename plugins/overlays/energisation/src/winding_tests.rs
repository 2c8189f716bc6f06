//! Earths, windings, contradictions, and what a dead busbar rests on.

use serde_json::json;

use crate::test_station::*;
use crate::*;

#[test]
fn no_earth_passes_a_winding() {
    let with_earth = station(&two_levels(), &switches(OPEN, CLOSED, CLOSED, OPEN));
    assert_eq!(with_earth.state("HIGH"), PieceState::Earthed);
    for dead in ["LOW", "BUS", "T1"] {
        assert_eq!(with_earth.state(dead), PieceState::Dead, "{dead}");
    }
    // Feeding passes it, whichever way.
    let fed = station(&two_levels(), &switches(CLOSED, CLOSED, OPEN, OPEN));
    assert_eq!(fed.state("BUS"), PieceState::Energised);
}

#[test]
fn no_earth_passes_a_kind_with_windings_within_a_level() {
    let kinds = [
        ("transformer", PieceState::Dead),
        ("auto_transformer", PieceState::Dead),
        ("autotransformer", PieceState::Dead),
        ("auxiliary_transformer", PieceState::Dead),
        ("earthing_transformer", PieceState::Dead),
        ("instrument_transformer", PieceState::Dead),
        ("voltage_transformer", PieceState::Dead),
        ("reactor", PieceState::Dead),
        ("series_reactor", PieceState::Dead),
        ("arc_suppression_coil", PieceState::Dead),
        ("resistor", PieceState::Dead),
        ("capacitor", PieceState::Dead),
        ("current_transformer", PieceState::Earthed),
        ("line", PieceState::Earthed),
        ("cable", PieceState::Earthed),
        ("busbar", PieceState::Earthed),
        ("fuse", PieceState::Earthed),
    ];
    for (kind, expected) in kinds {
        let mut settings = two_levels();
        for node in 0..4 {
            settings["nodes"][node]["level"] = "110 kV".into();
        }
        settings["branches"][1]["kind"] = kind.into();
        let earthed = station(&settings, &switches(OPEN, OPEN, CLOSED, OPEN));
        assert_eq!(earthed.state("LOW"), expected, "{kind}");
        let fed = station(&settings, &switches(CLOSED, OPEN, OPEN, OPEN));
        assert_eq!(fed.state("LOW"), PieceState::Energised, "{kind} is a way of back-feed");
    }
    let mut wrong = two_levels();
    wrong["branches"][1]["kind"] = "transfomer".into();
    let fault = serde_json::from_value::<Settings>(wrong).unwrap_err().to_string();
    assert!(fault.contains("transfomer") && fault.contains("transformer"), "{fault}");
    let mut wrong = two_levels();
    wrong["branches"][2]["switch"] = false.into();
    let fault = Topology::new(&serde_json::from_value(wrong).unwrap()).unwrap_err();
    assert!(fault.to_string().contains("'QA2' is a switch by its 'kind'"), "{fault}");
}

#[test]
fn the_earthing_of_a_star_point_is_no_working_earth() {
    for kind in ["star_point", "solid", "resistor", "coil", "zig_zag", "neutral"] {
        let mut settings = two_levels();
        settings["earths"][0]["kind"] = kind.into();
        let tags = switches(OPEN, OPEN, CLOSED, OPEN);
        let dead = station(&settings, &tags);
        assert_eq!(dead.state("HIGH"), PieceState::Dead, "{kind}");
        let fed = station(&settings, &switches(CLOSED, OPEN, CLOSED, OPEN));
        assert_eq!(fed.state("HIGH"), PieceState::Energised, "{kind} is no contradiction");
    }
}

#[test]
fn a_dead_bus_rests_on_all_its_feeders() {
    let feeders = 200;
    let id = |feeder: usize| -> &'static str { format!("Q{feeder}").leak() };
    let mut settings = two_levels();
    settings["nodes"] = (0..feeders)
        .map(|feeder| json!({ "id": format!("f{feeder}"), "level": "110 kV" }))
        .chain([json!({ "id": "bus", "level": "110 kV", "equipment": ["BUS"] })])
        .collect();
    settings["branches"] = (0..feeders)
        .map(|feeder| {
            let between = ["bus".to_owned(), format!("f{feeder}")];
            json!({ "equipment": id(feeder), "between": between, "switch": true })
        })
        .collect();
    settings["earths"] = json!([]);
    settings["sources"] = (0..feeders).map(|of| json!({ "node": format!("f{of}") })).collect();
    let tags: Vec<Tag> = (0..feeders).map(|of| tag(id(of), "position", OPEN)).collect();
    let mut dead = Station::new(&settings, &tags);
    dead.update(&tags);
    assert_eq!(dead.state("BUS"), PieceState::Dead);
    assert_eq!(dead.judgment("BUS").basis.len(), feeders);
    // Feeders that lead to no source need not be watched.
    settings["sources"] = json!([{ "node": "f7" }]);
    let dead = station(&settings, &tags);
    assert_eq!(dead.basis("BUS"), ["Q7.position"]);
    // One that is not good is named.
    settings["sources"] = (0..feeders).map(|of| json!({ "node": format!("f{of}") })).collect();
    let mut tags = tags;
    tags[150] = bad(tag(id(150), "position", OPEN));
    let unknown = station(&settings, &tags);
    assert_eq!(unknown.state("BUS"), PieceState::Unknown);
    assert_eq!(unknown.judgment("BUS").reason, "Q150 has no good position");
}

#[test]
fn a_contradiction_is_told_where_it_is() {
    let mut station = station(&two_levels(), &switches(CLOSED, OPEN, CLOSED, OPEN));
    let reason = "source line and earth QC1 are surely connected: line - QA1 - QC1";
    for id in ["LINE", "QA1", "HIGH", "T1", "QC1"] {
        let judgment = station.judgment(id);
        assert_eq!(judgment.state, PieceState::Contradiction, "{id}");
        assert_eq!((judgment.standing, &*judgment.reason), (Standing::Unknown, reason), "{id}");
    }
    // Beyond the winding the rest stays.
    assert_eq!(station.state("LOW"), PieceState::Energised);
    assert_eq!(station.state("BUS"), PieceState::Dead);
    assert_eq!(station.basis("HIGH"), ["QA1.position", "QC1.position"]);
    // An earth beyond a winding contradicts the feeding through it, there.
    station.draw(&switches(CLOSED, CLOSED, OPEN, CLOSED));
    assert_eq!(station.state("HIGH"), PieceState::Energised);
    assert_eq!(station.state("BUS"), PieceState::Contradiction);
    assert_eq!(
        station.judgment("BUS").reason,
        "source line and earth QC2 are surely connected: line - QA1 - T1 - QC2"
    );
}
