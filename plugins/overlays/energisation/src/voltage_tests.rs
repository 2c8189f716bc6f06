//! Measured voltages beside the topology.

use crate::test_station::*;
use crate::*;

fn voltages(values: [f64; 3]) -> Vec<Tag> {
    let roles = ["voltage_l1", "voltage_l2", "voltage_l3"];
    roles.into_iter().zip(values).map(|(role, value)| reading("VT", role, "kV", value)).collect()
}

/// Phase to earth at 100 % of 110 kV.
const FULL: f64 = 63.5;

#[test]
fn voltage_alone_makes_nothing_energised_or_dead() {
    let with = |qa1, values: [f64; 3]| {
        let mut tags = switches(qa1, OPEN, OPEN, OPEN);
        tags.extend(voltages(values));
        station(&two_levels(), &tags)
    };
    // Where no source reaches, voltage is a contradiction that is told.
    let live = with(OPEN, [FULL, 0.0, 0.0]);
    let judgment = live.judgment("HIGH");
    assert_eq!((judgment.state, judgment.standing), (PieceState::Contradiction, Standing::Unknown));
    assert_eq!(judgment.reason, "VT measures voltage, though no source reaches it");
    assert_eq!(live.basis("HIGH"), ["QA1.position", "VT.voltage_l1"]);
    // What it surely reaches over the winding is in doubt too, and no more.
    assert_eq!(live.state("LOW"), PieceState::Contradiction);
    assert_eq!(live.state("BUS"), PieceState::Dead);
    // Below what is present it makes nothing.
    for share in [0.0, 0.05, 0.2, 0.44] {
        assert_eq!(with(OPEN, [FULL * share; 3]).state("HIGH"), PieceState::Dead, "{share}");
        let fed = with(CLOSED, [FULL * share; 3]);
        let judgment = fed.judgment("HIGH");
        assert_eq!(judgment.state, PieceState::Energised, "{share}");
        assert_eq!(judgment.standing, Standing::Abnormal, "{share}: {}", judgment.reason);
    }
    assert_eq!(
        with(CLOSED, [0.0; 3]).judgment("HIGH").reason,
        "fed by the topology, but VT measures no voltage in any phase"
    );
    assert_eq!(
        with(CLOSED, [FULL, 0.0, FULL]).judgment("HIGH").reason,
        "fed by the topology, but VT measures no voltage: L2"
    );
    assert_eq!(
        with(CLOSED, [FULL, 20.0, FULL]).judgment("HIGH").reason,
        "fed by the topology, but VT: L2 is between 10 and 45 % of nominal"
    );
    let confirmed = with(CLOSED, [FULL; 3]);
    assert_eq!(confirmed.judgment("HIGH").standing, Standing::Normal);
    // Unknown stays unknown, with voltage and without.
    for share in [0.0, 1.0] {
        assert_eq!(with(MOVING, [FULL * share; 3]).state("HIGH"), PieceState::Unknown);
    }
}

#[test]
fn voltage_spreads_doubt_over_what_may_be_joined() {
    let mut tags = switches(OPEN, MOVING, OPEN, OPEN);
    tags.extend(voltages([FULL; 3]));
    let station = station(&two_levels(), &tags);
    assert_eq!(station.state("LOW"), PieceState::Contradiction);
    assert_eq!(station.state("BUS"), PieceState::Unknown);
    let reason = "perhaps joined to VT, which measures voltage without a source";
    assert_eq!(station.judgment("BUS").reason, reason);
}

#[test]
fn a_fuse_that_blew_explains_a_voltage_that_is_missing() {
    for role in ["fuse_fault", "mcb_tripped"] {
        let with = |fault: Tag| {
            let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
            tags.extend(voltages([0.0; 3]));
            tags.push(fault);
            station(&two_levels(), &tags).judgment("HIGH").standing
        };
        assert_eq!(with(tag("VT", role, YES)), Standing::Normal, "{role}");
        assert_eq!(with(bad(tag("VT", role, NO))), Standing::Normal, "{role}");
        assert_eq!(with(tag("VT", role, NO)), Standing::Abnormal, "{role}");
    }
}

#[test]
fn a_doubt_stays_when_the_voltage_is_not_good_any_more() {
    let frame = |share: f64, is_good: bool| {
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        let voltages = voltages([FULL * share; 3]).into_iter();
        tags.extend(voltages.map(|tag| if is_good { tag } else { bad(tag) }));
        tags
    };
    let mut station = station(&two_levels(), &frame(1.0, false));
    assert_eq!(station.state("HIGH"), PieceState::Dead, "nothing was ever measured");
    station.draw(&frame(1.0, true));
    assert_eq!(station.state("HIGH"), PieceState::Contradiction);
    station.draw(&frame(0.0, false));
    let judgment = station.judgment("HIGH");
    assert_eq!((judgment.state, judgment.standing), (PieceState::Unknown, Standing::Unknown));
    assert!(judgment.reason.contains("when it was last good"), "{}", judgment.reason);
    station.draw(&frame(0.0, true));
    assert_eq!(station.state("HIGH"), PieceState::Dead);
}

#[test]
fn bands_of_voltage_have_hysteresis() {
    use VoltageBand::{Between, Low, Present};
    let mut memory = VoltageMemory::default();
    for (share, expected) in [
        (0.44, Some(Between)),
        (0.45, Some(Present)),
        (0.44, Some(Present)),
        (0.42, Some(Between)),
        (0.44, Some(Between)),
        (0.10, Some(Between)),
        (0.09, Some(Low)),
        (0.10, Some(Between)),
        (0.09, Some(Between)),
        (0.07, Some(Low)),
        (1.73, Some(Present)),
        (2.1, None),
        (-0.1, None),
        (f64::NAN, None),
        (0.44, Some(Present)),
        (0.09, Some(Low)),
    ] {
        assert_eq!(memory.classify(share), expected, "{share}");
    }
}

#[test]
fn units_and_nominal_voltages_are_taken_or_told() {
    let with = |unit: &'static str, value: f64, level: &str| {
        let mut settings = two_levels();
        settings["levels"][0]["name"] = level.into();
        for node in 0..2 {
            settings["nodes"][node]["level"] = level.into();
        }
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        tags.push(reading("VT", "voltage", unit, value));
        let station = station(&settings, &tags);
        (station.state("HIGH"), station.overlay.findings().join("; "))
    };
    let live = PieceState::Contradiction;
    for (unit, value) in
        [("kV", 60.0), ("V", 60_000.0), ("%", 55.0), ("p.u.", 0.55), ("MV", 0.06), ("", 60.0)]
    {
        assert_eq!(with(unit, value, "110 kV"), (live, String::new()), "{unit}");
    }
    for level in ["110kV", "110,0 kV", "110000 V", "110 kV, yard 2"] {
        assert_eq!(with("kV", 60.0, level).0, live, "{level}");
    }
    let (state, findings) = with("kV", 60.0, "yard");
    assert_eq!(state, PieceState::Dead);
    assert!(findings.contains("set 'nominal_kv'"), "{findings}");
    let (state, findings) = with("A", 600.0, "110 kV");
    assert_eq!(state, PieceState::Dead);
    assert!(findings.contains("has the unit 'A'"), "{findings}");
}
