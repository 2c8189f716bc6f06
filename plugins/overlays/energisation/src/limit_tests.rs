//! Networks and inputs at and beyond the limits.

use busbar_plugin_sdk::testing::{draw, host};
use busbar_plugin_sdk::{Overlay, Plugin, Value};
use serde_json::json;

use crate::test_station::*;
use crate::*;

/// A chain of switches from a source, with a piece of equipment at each node.
fn chain(switches: usize) -> (serde_json::Value, Vec<Tag>) {
    let id = |switch: usize| -> &'static str { format!("Q{switch}").leak() };
    let settings = json!({
        "levels": [{ "name": "20 kV", "color": "#2200aa" }],
        "nodes": (0..=switches)
            .map(|node| json!({
                "id": node.to_string(), "level": "20 kV", "equipment": [format!("N{node}")],
            }))
            .collect::<Vec<_>>(),
        "branches": (0..switches)
            .map(|switch| {
                let between = [switch.to_string(), (switch + 1).to_string()];
                json!({ "equipment": id(switch), "between": between, "kind": "disconnector" })
            })
            .collect::<Vec<_>>(),
        "sources": [{ "node": "0" }],
    });
    (settings, (0..switches).map(|switch| tag(id(switch), "position", CLOSED)).collect())
}

#[test]
fn what_rests_on_too_many_tags_is_unknown_and_says_so() {
    let (settings, tags) = chain(4_000);
    let mut station = Station::new(&settings, &tags);
    station.update(&tags);
    let near = station.judgment("N1000");
    assert_eq!((near.state, near.basis.len()), (PieceState::Energised, 1_000));
    let far = station.judgment("N4000");
    assert_eq!((far.state, far.standing), (PieceState::Unknown, Standing::Unknown));
    assert!(far.reason.contains("more tags than are checked"), "{}", far.reason);
    assert!(station.overlay.judgments().binding_count() <= MAX_BASIS);
}

#[test]
fn a_large_part_without_feeding_has_one_list() {
    let (mut settings, mut tags) = chain(2_000);
    tags[0] = tag("Q0", "position", OPEN);
    for switch in 1..2_000 {
        settings["branches"][switch]["kind"] = "cable".into();
    }
    tags.truncate(1);
    let mut station = Station::new(&settings, &tags);
    station.update(&tags);
    assert_eq!(station.state("N2000"), PieceState::Dead);
    assert_eq!(station.basis("Q1999"), ["Q0.position"]);
    assert!(station.overlay.judgments().binding_count() < 10);
}

#[test]
fn an_overlay_without_tags_draws_nothing_and_fails_nowhere() {
    let settings = serde_json::from_value(two_levels()).unwrap();
    let mut overlay = EnergisationOverlay::create(settings, host()).unwrap();
    assert_eq!(overlay.describe().equipment.len(), 10);
    let drawing = draw(&mut overlay, Vec::new(), &[]).unwrap();
    assert_eq!(drawing.states, []);
    assert!(overlay.judgments().pieces.iter().flatten().count() == 10);
}

#[test]
fn values_of_any_kind_in_any_role_are_read() {
    let roles = [
        "position",
        "position_l1",
        "racked_out",
        "hand_dressed",
        "portable_earth",
        "source",
        "active_power",
        "reactive_power",
        "voltage",
        "voltage_l1",
        "voltage_l31",
        "fuse_fault",
        "mcb_tripped",
        "nothing",
    ];
    let equipment = ["LINE", "HIGH", "VT", "BUS", "QA1", "QA2", "T1", "QC1", "G1", "nowhere"];
    let values = [
        None,
        Some(YES),
        Some(NO),
        Some(MOVING),
        Some(CLOSED),
        Some(Value::I64(i64::MIN)),
        Some(Value::F64(f64::NEG_INFINITY)),
        Some(Value::F64(f64::MAX)),
        Some(Value::F64(-0.0)),
        Some(text("")),
        Some(text("on")),
    ];
    let mut random = fastrand::Rng::with_seed(39);
    for _ in 0..2_000 {
        let mut any = || {
            let Tag(_, _, _, _, quality) = bad(tag("", "", YES));
            let good = tag("", "", YES).4;
            Tag(
                equipment[random.usize(0..equipment.len())],
                roles[random.usize(0..roles.len())],
                ["", "kV", "MW", "%", "bananas"][random.usize(0..5)],
                values[random.usize(0..values.len())].clone(),
                [good, good, quality][random.usize(0..3)],
            )
        };
        let tags: Vec<Tag> = (0..12).map(|_| any()).collect();
        let mut station = Station::new(&generator(), &tags);
        station.draw(&tags);
        let judgments = station.overlay.judgments();
        for judgment in &judgments.pieces {
            let judgment = judgment.as_ref().unwrap();
            let is_told = judgment.standing == Standing::Normal || !judgment.reason.is_empty();
            assert!(is_told, "{judgment:?}");
            let basis = judgments.basis(judgment.basis);
            assert!(basis.iter().all(|&binding| (binding as usize) < tags.len()));
        }
    }
}

#[test]
fn a_voltage_at_the_end_of_a_long_dead_chain_is_told_everywhere() {
    let (mut settings, mut tags) = chain(30_000);
    tags[0] = tag("Q0", "position", OPEN);
    settings["nodes"][30_000]["equipment"] = json!(["VT"]);
    tags.push(reading("VT", "voltage", "kV", 20.0));
    let mut station = Station::new(&settings, &tags);
    station.update(&tags);
    assert_eq!(station.state("N0"), PieceState::Energised);
    for id in ["N1", "N29000", "VT"] {
        let reason = &station.judgment(id).reason;
        let is_told = reason == "VT measures voltage, though no source reaches it"
            || reason.contains("more tags than are checked");
        assert!(is_told && station.judgment(id).standing == Standing::Unknown, "{id}: {reason}");
    }
}

#[test]
fn another_wiring_is_judged_anew() {
    let tags = switches(CLOSED, CLOSED, OPEN, OPEN);
    let mut station = station(&two_levels(), &tags);
    assert_eq!(station.state("HIGH"), PieceState::Energised);
    station.overlay.configure(Vec::new()).unwrap();
    station.update(&[]);
    assert_eq!(station.state("HIGH"), PieceState::Unknown);
}
