//! Grades of contacts of which all is known.

use super::*;

const DL_T: Grading =
    Grading { rule: Rule::DlT664, part: Part::Clamp, least_rise: 10.0, greatest_rise: 50.0 };

fn contact([hot, normal, ambient]: [f64; 3]) -> Contact {
    Contact { hot, normal: Some(normal), ambient, load_factor: 1.0 }
}

#[test]
fn grades_are_those_of_dl_t_664() {
    for (temperatures, grade) in [
        // (40 - 33) / (40 - 20) = 35 %, just below it 34.5 %.
        ([40.0, 33.0, 20.0], Some(0)),
        ([40.0, 33.1, 20.0], None),
        // (60 - 28) / (60 - 20) = 80 %.
        ([60.0, 28.0, 20.0], Some(1)),
        // 95 % and 100 % are critical only above 90 °C.
        ([60.0, 22.0, 20.0], Some(1)),
        ([30.0, 20.0, 20.0], Some(1)),
        ([90.0, 20.0, 20.0], Some(1)),
        ([90.1, 20.0, 20.0], Some(2)),
        // (91 - 34.2) / 71 = 80 %: hot, and not 95 %.
        ([91.0, 34.2, 20.0], Some(1)),
        // 9.9 K are too little to judge by, even beside a cold one.
        ([29.9, 20.0, 20.0], None),
        // All three hot alike: heat itself is judged.
        ([90.0, 90.0, 20.0], None),
        ([91.0, 90.0, 20.0], Some(1)),
        ([131.0, 130.0, 20.0], Some(2)),
        // A peer below the air counts as cool as the air.
        ([40.0, 17.0, 20.0], Some(1)),
    ] {
        assert_eq!(DL_T.grade(&contact(temperatures)), grade, "{temperatures:?}");
    }
    assert_eq!(contact([40.0, 17.0, 20.0]).difference(), Some(100.0), "no more than all of it");
    let terminal = Grading { part: Part::Terminal, ..DL_T };
    assert_eq!(terminal.grade(&contact([85.0, 85.0, 20.0])), Some(1));
    assert_eq!(terminal.grade(&contact([111.0, 111.0, 20.0])), Some(2));
    let internal = Grading { part: Part::Internal, ..DL_T };
    assert_eq!(internal.grade(&contact([56.0, 56.0, 20.0])), Some(1));
}

#[test]
fn grades_are_those_of_neta() {
    let neta = Grading { rule: Rule::Neta, ..DL_T };
    for (difference, grade) in [
        (0.4, None),
        (0.6, Some(0)),
        (3.0, Some(0)),
        (4.0, Some(1)),
        (15.0, Some(1)),
        (16.0, Some(3)),
        (80.0, Some(3)),
    ] {
        let found = neta.grade(&contact([40.0 + difference, 40.0, 20.0]));
        assert_eq!(found, grade, "{difference} K");
    }
    // Three phases that are equally hot.
    for (rise, grade) in [(0.0, None), (40.0, None), (41.0, Some(3)), (120.0, Some(3))] {
        let found = neta.grade(&contact([20.0 + rise, 20.0 + rise, 20.0]));
        assert_eq!(found, grade, "{rise} K over the air, all alike");
    }
    for (rise, grade) in [
        (0.0, None),
        (10.0, Some(0)),
        (11.0, Some(1)),
        (21.0, Some(2)),
        (40.0, Some(2)),
        (41.0, Some(3)),
    ] {
        let alone = Contact { normal: None, ..contact([20.0 + rise, 0.0, 20.0]) };
        assert_eq!(neta.grade(&alone), grade, "{rise} K over the air");
    }
}

#[test]
fn rises_are_corrected_to_the_rated_load() {
    // 60 K at half the current are 240 K at all of it: I2R.
    let half = Contact { load_factor: 4.0, ..contact([50.0, 50.0, 20.0]) };
    assert!((half.corrected() - 140.0).abs() < 1e-9);
    assert_eq!(DL_T.grade(&half), Some(2));
    assert_eq!(half.difference(), Some(0.0), "a ratio of rises stays");
}

#[test]
fn a_contact_alone_is_judged_by_heat_and_rise() {
    let alone = |hot| Contact { normal: None, ..contact([hot, 0.0, 20.0]) };
    for (hot, grade) in [(70.0, None), (70.5, Some(0)), (91.0, Some(1)), (140.0, Some(2))] {
        assert_eq!(DL_T.grade(&alone(hot)), grade, "{hot} °C");
    }
}
