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
