//! Facts of names, one line each.

use super::*;

#[track_caller]
fn check(name: &str, expected: &str) {
    let shown: Vec<_> = facts_of_tag(name, &Vocabulary::default(), &Hint::default())
        .iter()
        .filter(|fact| !fact.is_soft())
        .map(Fact::shown)
        .collect();
    assert_eq!(shown.join(", "), expected, "{name}");
}

#[test]
fn the_names_of_the_field_are_read() {
    check("=S12D1Q3-QB9-L1", "station 12, level D 1, bay 3, disconnector 9, phase L1");
    check("220kV_Bay03_CB1_phsB.Pos", "level D, bay 3, breaker 1, phase L2");
    check("S12T1-TA1", "station 12, transformer 1, transformer 1");
    check("Q01 Isolator 9 R Pos", "bay 1, disconnector 9, phase L1");
    check("S12D1Q3/XSWI9.Pos.stVal", "station 12, level D 1, bay 3, disconnector 9");
    check("T1 bushing 1U", "transformer 1, bushing, winding 1, phase L1");
    check("TR1.TopOilTemp", "transformer 1");
    check("Q3.BC1.UL12", "bay 3, current transformer 1, ul 12");
    check("S12H1C2-CA1", "station 12, level H 1, c bay 2, capacitor 1");
}

#[test]
fn a_letter_is_a_phase_unless_it_may_be_the_quantity() {
    check("Q3.CT1.IA", "bay 3, current transformer 1, phase L1");
    check("Q3.CT1.Cur.A", "bay 3, current transformer 1, phase L1");
    // Amperes, perhaps.
    check("Q3.CT1.A", "bay 3, current transformer 1");
    check("Q3.CT1.B", "bay 3, current transformer 1, phase L2");
    check("Bay B CB", "bay, b, breaker");
}
