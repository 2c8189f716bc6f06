//! Every row of every table: its interior, and its borders from both sides.

use dga::iec60599::{self, Equipment};
use dga::{Concentration, Gas, Sample, Zone, dlt722, doernenburg, key_gas, rogers};
use dga::{triangle_1, triangle_4, triangle_5};

/// Creates a sample of H2, CH4, C2H6, C2H4, C2H2.
fn five(ppm: [f64; 5]) -> Sample {
    Sample::of_five(ppm).expect("it is valid")
}

/// Creates a sample with exact C2H2/C2H4, CH4/H2 and C2H4/C2H6, for ratios with few digits.
fn ratios(r2: f64, r1: f64, r5: f64) -> Sample {
    let c2h4 = 1000.0 * r5;
    five([1000.0, 1000.0 * r1, 1000.0, c2h4, c2h4 * r2])
}

fn names(zones: impl Iterator<Item = Zone>) -> String {
    zones.map(Zone::name).collect::<Vec<_>>().join("|")
}

#[test]
fn iec_60599() {
    let check = |r2, r1, r5, expected: &str| {
        let sample = ratios(r2, r1, r5);
        let found = names(iec60599::zones(&sample, Equipment::Transformer));
        assert_eq!(found, expected, "{r2} {r1} {r5}");
        let verdicts = iec60599::diagnose(&sample, Equipment::Transformer);
        assert_eq!(names(verdicts.iter().map(|verdict| verdict.zone)), expected);
        assert!(verdicts.iter().all(|verdict| verdict.margin.is_some()));
    };
    check(5.0, 0.09, 0.19, "PD");
    check(5.0, 0.1, 0.19, "ND");
    check(5.0, 0.09, 0.2, "ND");
    check(3.0, 0.1, 1.5, "D1");
    check(3.0, 0.5, 1.5, "D1");
    check(3.0, 0.51, 1.5, "ND");
    check(3.0, 0.3, 1.0, "ND");
    check(1.0, 0.3, 1.5, "ND");
    check(2.0, 0.3, 3.0, "D1|D2");
    check(2.5, 0.3, 3.0, "D1|D2");
    check(2.6, 0.3, 3.0, "D1");
    check(1.0, 0.3, 3.0, "D2");
    check(0.6, 0.1, 3.0, "D2");
    check(0.59, 0.3, 3.0, "ND");
    check(0.8, 1.0, 3.0, "D2");
    check(0.8, 1.01, 3.0, "ND");
    check(0.8, 0.3, 2.0, "ND");
    check(9.0, 1.01, 0.99, "T1");
    check(9.0, 1.0, 0.99, "ND");
    check(0.09, 1.1, 1.0, "T2");
    check(0.09, 1.1, 4.0, "T2");
    check(0.1, 1.1, 4.0, "ND");
    check(0.09, 1.0, 4.0, "ND");
    check(0.19, 1.1, 4.01, "T3");
    check(0.2, 1.1, 4.01, "ND");
}

#[test]
fn iec_60599_of_other_equipment() {
    let zone = |r1, equipment| names(iec60599::zones(&ratios(0.0, r1, 0.1), equipment));
    assert_eq!(zone(0.15, Equipment::Transformer), "ND");
    assert_eq!(zone(0.15, Equipment::InstrumentTransformer), "PD");
    assert_eq!(zone(0.08, Equipment::Transformer), "PD");
    assert_eq!(zone(0.08, Equipment::Bushing), "ND");
}

#[test]
fn rogers_table() {
    let check = |r2, r1, r5, expected: &str| {
        let sample = ratios(r2, r1, r5);
        assert_eq!(rogers::zone(&sample).name(), expected, "{r2} {r1} {r5}");
        assert_eq!(rogers::diagnose(&sample).zone.name(), expected);
    };
    check(0.09, 0.1, 0.9, "N");
    check(0.09, 1.0, 0.9, "N");
    check(0.1, 1.0, 0.9, "ND");
    check(0.09, 0.09, 0.9, "PD");
    check(0.09, 0.09, 1.0, "ND");
    check(0.1, 0.1, 3.1, "D2");
    check(3.0, 1.0, 3.1, "D2");
    check(3.1, 1.0, 3.1, "ND");
    check(3.0, 1.0, 3.0, "ND");
    check(0.09, 0.5, 1.0, "T1");
    check(0.09, 0.5, 3.0, "T1");
    check(0.09, 0.5, 3.1, "ND");
    check(0.09, 1.1, 1.0, "T2");
    check(0.09, 1.1, 3.0, "T2");
    check(0.09, 1.1, 3.1, "T3");
    check(0.09, 1.1, 0.9, "ND");
}

#[test]
fn doernenburg_screening_and_table() {
    let check = |ppm: [f64; 5], expected: &str| {
        assert_eq!(doernenburg::zone(&five(ppm)).name(), expected, "{ppm:?}");
    };
    // Screening: one of four above twice L1, and C2H6 or CO above L1.
    check([200.0, 240.0, 1000.0, 100.0, 2.0], "NF");
    check([201.0, 0.0, 65.0, 0.0, 0.0], "NF");
    check([0.0, 0.0, 66.0, 0.0, 2.1], "NA");
    let co = |ppm| Concentration::measured(ppm).expect("it is valid");
    let little = five([201.0, 10.0, 60.0, 51.0, 1.5]);
    assert_eq!(doernenburg::zone(&little).name(), "NF");
    assert_eq!(doernenburg::zone(&little.with(Gas::Co, co(350.0))).name(), "NF");
    assert_eq!(doernenburg::zone(&little.with(Gas::Co, co(351.0))).name(), "PD");
    // Validity: each ratio needs one of its gases above L1.
    check([201.0, 120.0, 66.0, 50.0, 1.0], "NA");
    check([201.0, 121.0, 66.0, 50.0, 1.0], "NA");
    check([201.0, 120.0, 66.0, 51.0, 1.0], "NA");
    // Codes.
    check([201.0, 202.0, 66.0, 51.0, 1.0], "T");
    check([300.0, 300.0, 66.0, 51.0, 1.0], "ND");
    check([300.0, 400.0, 66.0, 100.0, 75.0], "ND");
    check([300.0, 400.0, 66.0, 101.0, 75.0], "T");
    check([300.0, 400.0, 66.0, 200.0, 120.0], "ND");
    check([300.0, 400.0, 66.0, 200.0, 119.0], "T");
    check([300.0, 400.0, 66.0, 400.0, 119.0], "T");
    check([300.0, 1000.0, 80.0, 400.0, 200.0], "ND");
    check([300.0, 1000.0, 81.0, 400.0, 200.0], "T");
    check([2000.0, 199.0, 100.0, 51.0, 1.0], "PD");
    check([2000.0, 200.0, 100.0, 51.0, 1.0], "ND");
    check([2000.0, 201.0, 70.0, 100.0, 300.0], "D");
    check([2000.0, 200.0, 70.0, 100.0, 300.0], "ND");
    check([2000.0, 2000.0, 70.0, 100.0, 900.0], "ND");
    check([2000.0, 1000.0, 70.0, 400.0, 300.0], "ND");
    check([2000.0, 1000.0, 70.0, 300.0, 300.0], "ND");
    check([2000.0, 1000.0, 70.0, 300.0, 301.0], "D");
    check([2000.0, 500.0, 120.0, 300.0, 300.0], "ND");
}

#[test]
fn key_gas_is_the_greatest() {
    let check = |ppm: [f64; 5], expected: &str| {
        assert_eq!(key_gas::zone(&five(ppm)).name(), expected, "{ppm:?}");
    };
    check([5.0, 4.0, 3.0, 2.0, 1.0], "PD");
    check([1.0, 5.0, 4.0, 3.0, 2.0], "T1");
    check([1.0, 4.0, 5.0, 3.0, 2.0], "T1");
    check([1.0, 4.0, 3.0, 5.0, 2.0], "T3");
    check([1.0, 4.0, 3.0, 2.0, 5.0], "D2");
    check([3.0, 3.0, 3.0, 3.0, 3.0], "PD");
    check([0.0; 5], "NA");
    let co = Concentration::measured(6.0).expect("it is valid");
    assert_eq!(key_gas::zone(&five([5.0, 4.0, 3.0, 2.0, 1.0]).with(Gas::Co, co)).name(), "C");
}

#[test]
fn dlt_722_codes() {
    let check = |r2, r1, r5, expected: &str| {
        assert_eq!(dlt722::zone(&ratios(r2, r1, r5)).name(), expected, "{r2} {r1} {r5}");
    };
    check(0.09, 0.1, 0.99, "T0");
    check(0.09, 0.99, 0.09, "T0");
    check(0.09, 1.0, 0.99, "T1");
    check(0.09, 3.0, 0.99, "T1");
    check(0.09, 0.5, 1.0, "T1");
    check(0.09, 1.0, 1.0, "T2");
    check(0.09, 3.0, 2.99, "T2");
    check(0.09, 0.09, 3.0, "T3");
    check(0.09, 0.5, 3.0, "T3");
    check(0.09, 5.0, 3.0, "T3");
    check(0.09, 0.09, 0.99, "PD");
    check(0.09, 0.09, 1.0, "ND");
    check(0.1, 0.99, 0.5, "D2");
    check(2.99, 0.09, 5.0, "D2");
    check(0.1, 1.0, 0.5, "D2T");
    check(2.99, 3.0, 5.0, "D2T");
    check(3.0, 0.99, 0.5, "D1");
    check(3.0, 0.09, 5.0, "D1");
    check(3.0, 1.0, 0.5, "D1T");
    check(9.0, 3.0, 5.0, "D1T");
}

#[test]
fn zeros_have_results() {
    let none = five([0.0; 5]);
    assert_eq!(names(iec60599::zones(&none, Equipment::Transformer)), "ND");
    assert_eq!((rogers::zone(&none).name(), dlt722::zone(&none).name()), ("ND", "ND"));
    assert_eq!(doernenburg::zone(&none).name(), "NF");
    assert_eq!(triangle_1::zone(&none).name(), "NA");
    // Single gases: H2, CH4, C2H6, C2H4, C2H2.
    let single = |i: usize| {
        let mut ppm = [0.0; 5];
        ppm[i] = 500.0;
        five(ppm)
    };
    let of = |method: fn(&Sample) -> Zone| [0, 1, 2, 3, 4].map(|i| method(&single(i)).name());
    assert_eq!(of(dlt722::zone), ["ND", "ND", "ND", "T3", "D1"]);
    assert_eq!(of(rogers::zone), ["ND"; 5]);
    assert_eq!(of(triangle_1::zone), ["NA", "PD", "NA", "T3", "D1"]);
    assert_eq!(of(triangle_4::zone), ["S", "C", "O", "NA", "NA"]);
    assert_eq!(of(triangle_5::zone), ["NA", "O", "O", "T3", "NA"]);
    // C2H4/C2H6 is infinite, C2H2/C2H4 0.
    let hot = five([10.0, 50.0, 0.0, 100.0, 0.0]);
    assert_eq!(names(iec60599::zones(&hot, Equipment::Transformer)), "T3");
    assert_eq!(rogers::zone(&hot).name(), "T3");
    // CH4/H2 cannot be computed: a discharge, and nothing known of overheating.
    assert_eq!(dlt722::zone(&five([0.0, 0.0, 10.0, 5.0, 35.0])).name(), "D1");
    assert_eq!(dlt722::zone(&five([0.0, 0.0, 10.0, 5.0, 5.0])).name(), "D2");
    // Neither C2H2 nor C2H4.
    assert_eq!(dlt722::zone(&five([1000.0, 50.0, 10.0, 0.0, 0.0])).name(), "PD");
}

#[test]
fn absent_gases_leave_methods_without_input() {
    for absent in Gas::FIVE {
        let mut sample = Sample::new();
        for gas in Gas::FIVE.into_iter().filter(|gas| *gas != absent) {
            sample = sample.with(gas, Concentration::measured(400.0).expect("it is valid"));
        }
        for method in [rogers::zone, doernenburg::zone, key_gas::zone, dlt722::zone] {
            assert_eq!(method(&sample), Zone::NotApplicable);
        }
        assert_eq!(names(iec60599::zones(&sample, Equipment::Transformer)), "NA");
        let has_triangle = matches!(absent, Gas::H2 | Gas::C2h6);
        assert_eq!(triangle_1::zone(&sample) != Zone::NotApplicable, has_triangle);
    }
}

/// Returns a triangle's zone at shares in percent; gases in the order of the method.
fn at(gases: [Gas; 3], method: fn(&Sample) -> Zone, shares: [f64; 3]) -> &'static str {
    assert_eq!(shares.iter().sum::<f64>(), 100.0);
    let mut sample = Sample::new();
    for (gas, share) in gases.into_iter().zip(shares) {
        sample = sample.with(gas, Concentration::measured(share * 8.0).expect("it is valid"));
    }
    method(&sample).name()
}

#[test]
fn triangle_1_zones_and_borders() {
    let check = |m, e, a, expected| {
        let gases = [Gas::Ch4, Gas::C2h4, Gas::C2h2];
        assert_eq!(at(gases, triangle_1::zone, [m, e, a]), expected, "{m} {e} {a}");
    };
    check(98.0, 0.0, 2.0, "PD");
    check(98.0, 2.0, 0.0, "PD");
    check(97.875, 2.125, 0.0, "T1");
    check(80.125, 19.875, 0.0, "T1");
    check(80.0, 20.0, 0.0, "T2");
    check(50.125, 49.875, 0.0, "T2");
    check(50.0, 50.0, 0.0, "T3");
    check(76.125, 20.0, 3.875, "T2");
    check(76.0, 20.0, 4.0, "DT");
    check(96.0, 0.0, 4.0, "DT");
    check(46.0, 50.0, 4.0, "T3");
    check(46.125, 49.875, 4.0, "DT");
    check(35.125, 50.0, 14.875, "T3");
    check(35.0, 50.0, 15.0, "DT");
    check(0.0, 85.125, 14.875, "T3");
    check(0.0, 85.0, 15.0, "DT");
    check(87.0, 0.0, 13.0, "D1");
    check(87.125, 0.0, 12.875, "DT");
    check(64.125, 22.875, 13.0, "D1");
    check(64.0, 23.0, 13.0, "D2");
    check(64.125, 23.0, 12.875, "DT");
    check(47.125, 39.875, 13.0, "D2");
    check(47.0, 40.0, 13.0, "DT");
    check(31.125, 40.0, 28.875, "DT");
    check(31.0, 40.0, 29.0, "D2");
    check(0.0, 71.0, 29.0, "D2");
    check(0.0, 71.125, 28.875, "DT");
    check(0.0, 23.0, 77.0, "D2");
    check(0.0, 22.875, 77.125, "D1");
}

#[test]
fn triangle_4_zones_and_borders() {
    let check = |h, m, e, expected| {
        let gases = [Gas::H2, Gas::Ch4, Gas::C2h6];
        assert_eq!(at(gases, triangle_4::zone, [h, m, e]), expected, "{h} {m} {e}");
    };
    check(98.0, 2.0, 0.0, "PD");
    check(98.125, 1.875, 0.0, "S");
    check(97.125, 2.0, 0.875, "PD");
    check(97.0, 2.0, 1.0, "S");
    check(85.125, 14.875, 0.0, "PD");
    check(85.0, 15.0, 0.0, "S");
    check(54.0, 0.0, 46.0, "ND");
    check(54.125, 0.0, 45.875, "S");
    check(9.0, 45.0, 46.0, "ND");
    check(8.875, 45.125, 46.0, "O");
    check(9.0, 0.0, 91.0, "ND");
    check(8.875, 0.0, 91.125, "O");
    check(8.875, 61.125, 30.0, "O");
    check(8.875, 61.25, 29.875, "C");
    check(9.0, 61.0, 30.0, "S");
    check(9.0, 61.125, 29.875, "C");
    check(14.875, 55.25, 29.875, "C");
    check(15.0, 55.125, 29.875, "S");
    check(14.875, 61.125, 24.0, "C");
    check(15.0, 61.0, 24.0, "S");
    check(15.125, 61.0, 23.875, "C");
    check(40.125, 36.0, 23.875, "C");
    check(40.25, 35.875, 23.875, "S");
    check(64.0, 36.0, 0.0, "C");
    check(64.125, 35.875, 0.0, "S");
}

#[test]
fn triangle_5_zones_and_borders() {
    let check = |m, y, e, expected| {
        let gases = [Gas::Ch4, Gas::C2h4, Gas::C2h6];
        assert_eq!(at(gases, triangle_5::zone, [m, y, e]), expected, "{m} {y} {e}");
    };
    check(98.125, 0.0, 1.875, "O");
    check(98.0, 0.0, 2.0, "PD");
    check(85.125, 0.0, 14.875, "PD");
    check(85.0, 0.0, 15.0, "S");
    check(97.0, 1.0, 2.0, "O");
    check(75.25, 9.875, 14.875, "O");
    check(75.125, 9.875, 15.0, "S");
    check(36.25, 9.875, 53.875, "S");
    check(36.125, 9.875, 54.0, "O");
    check(90.125, 9.875, 0.0, "O");
    check(90.0, 10.0, 0.0, "T2");
    check(78.125, 10.0, 11.875, "T2");
    check(78.0, 10.0, 12.0, "C");
    check(60.125, 10.0, 29.875, "C");
    check(60.0, 10.0, 30.0, "ND");
    check(0.0, 10.0, 90.0, "ND");
    check(35.125, 34.875, 30.0, "ND");
    check(35.0, 35.0, 30.0, "T3");
    check(35.125, 35.0, 29.875, "C");
    check(65.125, 34.875, 0.0, "T2");
    check(65.0, 35.0, 0.0, "T3");
    check(53.125, 35.0, 11.875, "T3");
    check(53.0, 35.0, 12.0, "C");
    check(38.125, 49.875, 12.0, "C");
    check(38.0, 50.0, 12.0, "T3");
    check(36.125, 50.0, 13.875, "T3");
    check(36.0, 50.0, 14.0, "C");
    check(16.125, 69.875, 14.0, "C");
    check(16.0, 70.0, 14.0, "T3");
    check(0.125, 70.0, 29.875, "T3");
    check(0.25, 69.875, 29.875, "C");
    check(0.125, 69.875, 30.0, "T3");
}

#[test]
fn triangles_4_and_5_are_for_what_triangle_1_says() {
    let of = |ch4, c2h4, c2h2| five([50.0, ch4, 20.0, c2h4, c2h2]);
    let expected = [
        (of(99.0, 1.0, 0.0), "PD", true, false),
        (of(90.0, 10.0, 0.0), "T1", true, false),
        (of(70.0, 30.0, 0.0), "T2", true, true),
        (of(30.0, 70.0, 0.0), "T3", false, true),
        (of(50.0, 10.0, 40.0), "D1", false, false),
        (of(30.0, 30.0, 40.0), "D2", false, false),
        (of(60.0, 30.0, 10.0), "DT", false, false),
        (of(0.0, 0.0, 0.0), "NA", false, false),
    ];
    for (sample, zone, four, five) in expected {
        assert_eq!(triangle_1::zone(&sample).name(), zone);
        assert_eq!(triangle_4::is_applicable(&sample), four, "{zone}");
        assert_eq!(triangle_5::is_applicable(&sample), five, "{zone}");
    }
}
