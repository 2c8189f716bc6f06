//! Findings of bindings, and the legend.

use crate::test_station::*;
use crate::*;

#[test]
fn bindings_that_lack_a_tag_are_told() {
    let tags = [tag("QA1", "position", CLOSED)];
    let mut settings = generator();
    let station_1 = station(&settings, &tags);
    let findings = station_1.overlay.findings().join("\n");
    for id in ["QA2", "QC1", "QC2", "G1"] {
        assert!(findings.contains(&format!("'{id}' has no tag")), "{id}: {findings}");
    }
    assert_eq!(station_1.judgment("QC1").standing, Standing::Unknown);
    assert_eq!(
        station_1.judgment("QC1").reason,
        "QC1 has no tag for its position; nothing is known of the source G1: it may feed"
    );
    // What the settings declare is unknown, and no fault.
    settings["branches"][2]["untelemetered"] = true.into();
    settings["earths"][0]["untelemetered"] = true.into();
    settings["earths"][1]["untelemetered"] = true.into();
    settings["sources"][0]["untelemetered"] = true.into();
    let declared = station(&settings, &tags);
    assert!(declared.overlay.findings().is_empty(), "{:?}", declared.overlay.findings());
    assert_eq!(declared.state("BUS"), PieceState::Unknown);
}

#[test]
fn texts_in_place_of_states_and_numbers_are_told_and_tell_nothing() {
    let mut settings = generator();
    settings["nodes"][1]["equipment"] = serde_json::json!(["HIGH", "VT"]);
    for (id, role, piece, words) in [
        ("QA1", "position", "HIGH", "is no state; bind one of the type double_point or bool"),
        ("QA1", "position_l1", "HIGH", "is no state"),
        ("QA1", "racked_out", "HIGH", "is no state"),
        ("QA1", "hand_dressed", "HIGH", "is no state"),
        ("HIGH", "portable_earth", "HIGH", "is no state"),
        ("VT", "fuse_fault", "", "is no state"),
        ("VT", "voltage_l1", "", "is no number; bind one of the type f64 or i64"),
        ("G1", "active_power", "", "is no number"),
        ("G1", "source", "HIGH", "is no state or number; bind one of the type bool,"),
    ] {
        for word in ["", "0", "on", "off", "OPEN"] {
            let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
            tags.push(tag("G1", "source", YES));
            tags.push(reading("VT", "voltage_l2", "kV", 64.0));
            tags.retain(|of| (of.0, of.1) != (id, role));
            assert!(station(&settings, &tags).overlay.findings().len() <= 1);
            tags.push(tag(id, role, text(word)));
            let station = station(&settings, &tags);
            let findings = station.overlay.findings();
            let own = format!("the tag '{id}.{role}' in the role '{role}' at '{id}' {words}");
            let told = findings.iter().filter(|of| of.starts_with(&own)).count();
            assert_eq!(told, 1, "{findings:?}");
            if !piece.is_empty() {
                let judgment = station.judgment(piece);
                assert_eq!(judgment.standing, Standing::Unknown, "{id} {role} {word}");
                assert!(judgment.reason.contains(id), "{}", judgment.reason);
            }
        }
    }
}

#[test]
fn numbers_in_place_of_states_are_told() {
    let tags = [reading("QA1", "position", "", 1.0), tag("G1", "active_power", YES)];
    let station = station(&generator(), &tags);
    let findings = station.overlay.findings().join("\n");
    for words in [
        "'QA1.position' in the role 'position' at 'QA1' is no state; ",
        "'G1.active_power' in the role 'active_power' at 'G1' is no number; ",
    ] {
        assert!(findings.contains(words), "{findings}");
    }
    let told = station.judgment("QA1").reason;
    assert!(told.contains("the tag of QA1 is no state: a position is a double_point"), "{told}");
}

#[test]
fn the_legend_says_that_it_is_no_permit_to_work() {
    let settings: Settings = serde_json::from_value(two_levels()).unwrap();
    let legend = settings.legend();
    let names: Vec<&str> = legend.iter().map(|entry| entry.name.as_str()).collect();
    assert!(names.contains(&"these are indications, not a permit to work"), "{names:?}");
    assert!(names.iter().all(|name| name.len() <= 64), "{names:?}");
    for state in [PieceState::PolesDisagree, PieceState::InMotion, PieceState::RackedOut] {
        assert!(settings.legend_entry(state, 0) >= settings.levels.len());
    }
}
