//! Poles, and what operators place and set by hand.

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Plugin, Quality, Reason};
use serde_json::json;

use crate::test_station::*;
use crate::*;

#[test]
fn poles_that_disagree_are_told() {
    let poles = |l1, l2, l3| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        let poles = ["position_l1", "position_l2", "position_l3"];
        tags.extend(poles.into_iter().zip([l1, l2, l3]).map(|(role, of)| tag("QA2", role, of)));
        tags.remove(1);
        tags
    };
    let all_closed = station(&two_levels(), &poles(CLOSED, CLOSED, CLOSED));
    assert_eq!(all_closed.state("BUS"), PieceState::Energised);
    let one_open = station(&two_levels(), &poles(CLOSED, OPEN, CLOSED));
    assert_eq!(one_open.state("QA2"), PieceState::PolesDisagree);
    assert_eq!(one_open.state("BUS"), PieceState::Unknown);
    let reason = "poles of QA2 disagree: open at L2, closed at L1";
    assert_eq!(one_open.judgment("BUS").reason, reason);
    assert_eq!(one_open.judgment("QA2").standing, Standing::Abnormal);
    // A pole that moves, or that is not good, is none that disagrees.
    let moving = station(&two_levels(), &poles(OPEN, MOVING, OPEN));
    assert_eq!(moving.state("QA2"), PieceState::InMotion);
    assert_eq!(moving.state("BUS"), PieceState::Unknown, "dead only once it settled");
    let mut tags = poles(OPEN, OPEN, OPEN);
    tags[5] = bad(tag("QA2", "position_l3", OPEN));
    let not_good = station(&two_levels(), &tags);
    assert_eq!(not_good.judgment("BUS").reason, "QA2 has no good position");
    tags.pop();
    let missing = station(&two_levels(), &tags);
    assert_eq!(missing.judgment("BUS").reason, "QA2 has no tag in the role 'position_l3'");
    assert!(missing.overlay.findings()[0].contains("position_l3"));
    // Two tags of one switch are as good as two poles.
    let mut tags = switches(CLOSED, CLOSED, OPEN, OPEN);
    tags.push(tag("QA2", "position", OPEN));
    let two = station(&two_levels(), &tags);
    assert_eq!(two.state("QA2"), PieceState::PolesDisagree);
    assert_eq!(
        two.judgment("QA2").reason,
        "QA2 is open by one tag and closed by another; energised at an end"
    );
}

#[test]
fn an_earth_whose_poles_disagree_earths_nothing_for_certain() {
    let mut tags = switches(OPEN, OPEN, CLOSED, OPEN);
    tags.push(tag("QC1", "position_l1", OPEN));
    let station = station(&two_levels(), &tags);
    assert_eq!(station.state("HIGH"), PieceState::Dead);
    let reason = &station.judgment("HIGH").reason;
    assert!(reason.starts_with("perhaps earthed: poles of QC1 disagree"), "{reason}");
}

#[test]
fn a_racked_out_breaker_is_open_whatever_it_reports() {
    let with = |position, racked_out: Tag| {
        let mut tags = switches(CLOSED, position, OPEN, OPEN);
        tags.push(racked_out);
        tags
    };
    let racked = |value| tag("QA2", "racked_out", value);
    let out = station(&two_levels(), &with(CLOSED, racked(YES)));
    assert_eq!((out.state("BUS"), out.state("QA2")), (PieceState::Dead, PieceState::RackedOut));
    assert_eq!(out.basis("BUS"), ["QA2.racked_out"]);
    let reason = "QA2 is racked out; energised at an end";
    assert_eq!(out.judgment("QA2").reason, reason);
    let moving = station(&two_levels(), &with(MOVING, racked(CLOSED)));
    assert_eq!(moving.state("BUS"), PieceState::Dead);
    let back = station(&two_levels(), &with(CLOSED, racked(NO)));
    assert_eq!(back.state("BUS"), PieceState::Energised);
    assert_eq!(back.basis("BUS"), ["QA1.position", "QA2.position", "QA2.racked_out"]);
    // Not known: a closed one may join nothing, an open one does not.
    let unsure = station(&two_levels(), &with(CLOSED, bad(racked(NO))));
    assert_eq!(unsure.state("BUS"), PieceState::Unknown);
    let reason = "the tag in the role 'racked_out' of QA2 is not good";
    assert_eq!(unsure.judgment("BUS").reason, reason);
    let open = station(&two_levels(), &with(OPEN, bad(racked(NO))));
    assert_eq!(open.state("BUS"), PieceState::Dead);
}

#[test]
fn a_position_set_by_hand_is_used_and_marked() {
    let with = |position: Tag, hand: Tag| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        tags[1] = position;
        tags.push(hand);
        tags
    };
    let qa2 = |value| tag("QA2", "position", value);
    let hand = |value| tag("QA2", "hand_dressed", value);
    // The position itself, in place of one that is not good.
    let station_1 = station(&two_levels(), &with(bad(qa2(OPEN)), hand(CLOSED)));
    assert_eq!(station_1.state("BUS"), PieceState::Energised);
    assert_eq!(station_1.state("QA2"), PieceState::HandDressed);
    assert_eq!(station_1.judgment("BUS").reason, "the position of QA2 is set by hand");
    assert_eq!(station_1.basis("BUS"), ["QA1.position", "QA2.hand_dressed"]);
    // A flag at a position that the device says is substituted.
    let Tag(id, role, unit, value, _) = qa2(CLOSED);
    let substituted = Tag(id, role, unit, value, Quality::Uncertain(Reason::Unknown));
    let flagged = station(&two_levels(), &with(substituted, hand(YES)));
    assert_eq!(flagged.state("BUS"), PieceState::Energised);
    assert_eq!(flagged.basis("BUS"), ["QA1.position", "QA2.hand_dressed"]);
    // No longer set: as reported.
    let taken_back = station(&two_levels(), &with(qa2(OPEN), hand(MOVING)));
    assert_eq!(taken_back.state("BUS"), PieceState::Dead);
    assert_eq!(taken_back.state("QA2"), PieceState::Energised);
    // A position by hand that is not good may be any.
    let unsure = station(&two_levels(), &with(qa2(OPEN), bad(hand(CLOSED))));
    assert_eq!(unsure.state("BUS"), PieceState::Unknown);
}

#[test]
fn a_portable_earth_earths_where_it_is_placed() {
    let with = |earth: Tag| {
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        tags.push(earth);
        tags
    };
    let at_high = |value| tag("HIGH", "portable_earth", value);
    let placed = station(&two_levels(), &with(at_high(YES)));
    assert_eq!(placed.state("HIGH"), PieceState::PortableEarth);
    assert_eq!(placed.state("VT"), PieceState::Earthed);
    assert_eq!(placed.state("LOW"), PieceState::Dead);
    assert_eq!(placed.basis("VT"), ["QA1.position", "HIGH.portable_earth"]);
    let removed = station(&two_levels(), &with(at_high(NO)));
    assert_eq!(removed.state("HIGH"), PieceState::Dead);
    let unsure = station(&two_levels(), &with(bad(at_high(YES))));
    assert_eq!(unsure.state("HIGH"), PieceState::Dead);
    // At a switch nobody knows at which end.
    let at_switch = station(&two_levels(), &with(tag("QA2", "portable_earth", YES)));
    assert_eq!(at_switch.state("LOW"), PieceState::Dead);
    let reason = &at_switch.judgment("LOW").reason;
    assert_eq!(reason, "perhaps earthed: a portable earth is placed at QA2");
    // With feeding it is a contradiction like any other.
    let mut tags = with(at_high(YES));
    tags[0] = tag("QA1", "position", CLOSED);
    let live = station(&two_levels(), &tags);
    assert_eq!(live.state("HIGH"), PieceState::Contradiction);
    // And where feeding is possible, it must not look safe.
    tags[0] = tag("QA1", "position", MOVING);
    let maybe = station(&two_levels(), &tags);
    assert_eq!(maybe.state("HIGH"), PieceState::Unknown);
}

#[test]
fn placements_of_the_settings_are_kept() {
    let mut settings = two_levels();
    settings["placements"] = json!([
        { "kind": "portable_earth", "equipment": "BUS", "by": "M. Weber", "since": "7 May, 08:10" },
        { "kind": "racked_out", "equipment": "QA2" },
        { "kind": "hand_dressed", "equipment": "QA1", "position": "closed" },
    ]);
    // Nothing is known of the two breakers.
    let tags = [tag("QC1", "position", OPEN), tag("QC2", "position", OPEN)];
    let station = station(&settings, &tags);
    assert_eq!(station.state("HIGH"), PieceState::Energised);
    assert_eq!(station.state("QA1"), PieceState::HandDressed);
    assert_eq!(station.state("QA2"), PieceState::RackedOut);
    assert_eq!(station.state("BUS"), PieceState::PortableEarth);
    assert!(station.overlay.findings().is_empty(), "{:?}", station.overlay.findings());
    for (placement, words) in [
        (json!({ "kind": "racked_out", "equipment": "QA9" }), "is not in the network"),
        (json!({ "kind": "racked_out", "equipment": "BUS" }), "the equipment is none"),
        (json!({ "kind": "hand_dressed", "equipment": "QA1" }), "give 'position'"),
        (json!({ "kind": "portable_earth", "equipment": "BUS", "node": "bas" }), "a node"),
        (json!({ "kind": "racked_out", "equipment": "QA1", "position": "open" }), "nothing needs"),
    ] {
        settings["placements"] = json!([placement]);
        let settings = serde_json::from_value(settings.clone()).unwrap();
        let Err(fault) = EnergisationOverlay::create(settings, host()) else {
            panic!("{placement} is taken")
        };
        assert!(fault.to_string().contains(words), "{fault}");
    }
}

#[test]
fn placements_are_logged_once_each_time() {
    let mut log = placement_log::PlacementLog::default();
    let mut settings: Settings = serde_json::from_value(two_levels()).unwrap();
    settings.placements.clear();
    let topology = Topology::new(&settings).unwrap();
    let readings = |condition| {
        let reading = |condition| SwitchReading {
            position: Position::Open,
            condition,
            basis: BindingList::new(),
        };
        let mut switches = vec![reading(SwitchCondition::Settled); topology.switches.len()];
        switches[0] = reading(condition);
        Readings { switches, ..Readings::default() }
    };
    let mut told = |condition| log.changes(&topology, &readings(condition));
    assert_eq!(told(SwitchCondition::Settled), [""; 0]);
    assert_eq!(told(SwitchCondition::RackedOut), ["QA1 is racked out"]);
    assert_eq!(told(SwitchCondition::RackedOut), [""; 0]);
    // A tag that is not good tells nothing.
    assert_eq!(told(SwitchCondition::NotGood { role: SwitchRole::RackedOut }), [""; 0]);
    assert_eq!(told(SwitchCondition::Settled), ["no longer so: QA1 is racked out"]);
}
