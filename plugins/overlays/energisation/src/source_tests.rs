//! Machines and other sources.

use crate::test_station::*;
use crate::*;

#[test]
fn a_machine_feeds_by_the_magnitude_of_its_power() {
    let with = |machine: Vec<Tag>| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        tags.extend(machine);
        station(&generator(), &tags)
    };
    let p = |value| reading("G1", "active_power", "MW", value);
    let q = |value| reading("G1", "reactive_power", "Mvar", value);
    let source = |unit, value| reading("G1", "source", unit, value);
    let (fed, unknown) = (PieceState::Energised, PieceState::Unknown);
    for (tags, expected, what) in [
        (vec![p(50.0)], fed, "generating"),
        (vec![p(-50.0)], fed, "the other sign convention"),
        (vec![p(0.0)], unknown, "spinning without load"),
        (vec![p(0.4)], unknown, "below 1 % of the rating"),
        (vec![p(0.0), q(-20.0)], fed, "reactive power alone"),
        (vec![bad(p(50.0))], unknown, "no good value"),
        (vec![bad(p(50.0)), q(20.0)], fed, "the other one is good"),
        (vec![p(f64::NAN)], unknown, "no number"),
        (vec![], unknown, "nothing is known"),
        (vec![source("MW", -50.0)], fed, "power in the role source"),
        (vec![source("kW", 500.0)], unknown, "0.5 of 100 MVA"),
        (vec![source("", 0.0)], unknown, "a number at zero proves nothing"),
        (vec![source("kV", 0.02)], unknown, "0.02 of 110 kV"),
        (vec![source("kV", 30.0)], unknown, "27 % of nominal"),
        (vec![source("kV", 60.0)], fed, "55 % of nominal"),
        (vec![source("V", 60_000.0)], fed, "the same in volts"),
        (vec![tag("G1", "source", YES)], fed, "told"),
        (vec![tag("G1", "source", MOVING)], unknown, "neither on nor off"),
        (vec![tag("G1", "source", text("on"))], unknown, "a text is no state"),
        (vec![tag("G1", "source", text("50"))], unknown, "nor a number"),
        (vec![tag("G1", "source", text("off")), p(50.0)], fed, "power flows all the same"),
        (vec![tag("G1", "source", NO)], PieceState::Dead, "told to be off"),
        (vec![tag("G1", "source", NO), p(0.0)], PieceState::Dead, "off, and no power"),
        (vec![tag("G1", "source", NO), p(-40.0)], unknown, "off, and yet power flows"),
        (vec![tag("G1", "source", YES), p(0.0)], fed, "on, without load"),
    ] {
        let station = with(tags);
        assert_eq!(station.state("HIGH"), expected, "{what}");
        let judgment = station.judgment("HIGH");
        assert!(expected != unknown || !judgment.reason.is_empty(), "{what}");
        // Behind an open breaker it feeds nothing, whatever it does.
    }
    assert_eq!(
        with(vec![]).judgment("HIGH").reason,
        "nothing is known of the source G1: it may feed"
    );
    // Without a rating any power counts, by a default that is told.
    let mut settings = generator();
    settings["sources"][0].as_object_mut().unwrap().remove("rating_mva");
    let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
    tags.push(p(-0.1));
    let assumed = station(&settings, &tags);
    assert_eq!(assumed.state("HIGH"), fed);
    assert!(assumed.judgment("HIGH").assumption.contains("G1"));
    assert!(assumed.judgment("BUS").assumption.is_empty());
}

#[test]
fn a_machine_behind_an_open_breaker_feeds_nothing() {
    let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
    tags.push(reading("G1", "active_power", "MW", 0.0));
    let station = station(&generator(), &tags);
    assert_eq!(station.state("HIGH"), PieceState::Dead);
    assert_eq!(station.state("LINE"), PieceState::Unknown);
}
