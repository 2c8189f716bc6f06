//! Properties that hold for any sample.

mod common;

use common::sample;
use dga::c57_104::{self, Age};
use dga::iec60599::{self, Equipment};
use dga::pentagon::{PENTAGON_1, PENTAGON_2};
use dga::{Gas, Margin, Sample, Verdict, Zone};
use dga::{dlt722, doernenburg, key_gas, rogers, triangle_1, triangle_4, triangle_5};
use proptest::prelude::*;

fn verdicts(sample: &Sample) -> Vec<Verdict> {
    let mut all = iec60599::diagnose(sample, Equipment::Transformer);
    all.extend([
        rogers::diagnose(sample),
        doernenburg::diagnose(sample),
        key_gas::diagnose(sample),
        dlt722::diagnose(sample),
        triangle_1::diagnose(sample),
        triangle_4::diagnose(sample),
        triangle_5::diagnose(sample),
        PENTAGON_1.diagnose(sample),
        PENTAGON_2.diagnose(sample),
    ]);
    all
}

fn zones(sample: &Sample) -> Vec<Zone> {
    verdicts(sample).into_iter().map(|verdict| verdict.zone).collect()
}

/// Generates a concentration: absent, zero, whole, tiny, huge.
fn gas() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![
        1 => Just(None),
        1 => Just(Some(0.0)),
        2 => (0..400_u32).prop_map(|ppm| Some(f64::from(ppm))),
        3 => (-3.0..6.9_f64).prop_map(|power| Some(10.0_f64.powf(power))),
        1 => Just(Some(f64::MIN_POSITIVE)),
        1 => Just(Some(5e-324)),
        1 => Just(Some(dga::MAX_PPM)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn nothing_is_nan_and_margins_are_margins(gases in prop::array::uniform9(gas())) {
        let sample = sample(&gases);
        for Verdict { margin, rule, source, .. } in verdicts(&sample) {
            prop_assert!(!rule.is_empty() && !source.is_empty());
            match margin {
                Some(Margin::Factor { factor, .. }) => {
                    prop_assert!(factor.is_finite() && factor >= 1.0, "{factor}");
                }
                Some(Margin::Distance(distance)) => {
                    prop_assert!((0.0..=100.0).contains(&distance), "{distance}");
                }
                None => {}
            }
        }
        if let Some(point) = dga::pentagon::point(&sample) {
            prop_assert!(point.iter().all(|x| x.is_finite()));
        }
        c57_104::status(&sample, Age::Unknown);
    }

    #[test]
    fn scale_changes_no_share_and_no_ratio(ppm in prop::array::uniform5(0..2000_u32), power in -10..10_i32) {
        let by = 2.0_f64.powi(power);
        let one = Sample::of_five(ppm.map(f64::from)).expect("it is valid");
        let other = Sample::of_five(ppm.map(|ppm| f64::from(ppm) * by)).expect("it is valid");
        let methods: [fn(&Sample) -> Zone; 8] = [
            rogers::zone, key_gas::zone, dlt722::zone, triangle_1::zone, triangle_4::zone,
            triangle_5::zone, |sample: &Sample| PENTAGON_1.zone(sample),
            |sample: &Sample| PENTAGON_2.zone(sample),
        ];
        for method in methods {
            prop_assert_eq!(method(&one), method(&other));
        }
        let iec = |sample| iec60599::zones(sample, Equipment::Transformer).collect::<Vec<_>>();
        prop_assert_eq!(iec(&one), iec(&other));
    }

    #[test]
    fn the_order_in_which_gases_are_set_is_of_no_matter(
        gases in prop::array::uniform9(gas()),
        order in Just((0..9).collect::<Vec<usize>>()).prop_shuffle(),
    ) {
        let mut shuffled = Sample::new();
        for i in order {
            if let Some(ppm) = gases[i] {
                shuffled = shuffled.with(Gas::ALL[i], dga::Concentration::measured(ppm).expect("it is valid"));
            }
        }
        prop_assert_eq!(zones(&sample(&gases)), zones(&shuffled));
    }

    #[test]
    fn within_its_factor_no_gas_alone_changes_a_result(
        ppm in prop::array::uniform5(1.0..3000.0_f64),
        co in 100.0..2000.0_f64,
        part in 0.0..0.999_f64,
    ) {
        let of = |ppm: [f64; 5], co: f64| {
            let co = dga::Concentration::measured(co).ok()?;
            Some(Sample::of_five(ppm).ok()?.with(Gas::Co, co))
        };
        // With one gas by a factor; none beyond what a sample may hold.
        let scaled = |gas: usize, by: f64| {
            let (mut ppm, mut co) = (ppm, co);
            if gas == 5 { co *= by } else { ppm[gas] *= by }
            of(ppm, co)
        };
        for method in [rogers::diagnose, doernenburg::diagnose, key_gas::diagnose, dlt722::diagnose] {
            let verdict = method(&of(ppm, co).expect("it is valid"));
            let changes = |sample: Option<Sample>| {
                sample.is_some_and(|sample| method(&sample).zone != verdict.zone)
            };
            let limit = match verdict.margin {
                Some(Margin::Factor { gas, factor }) => {
                    let index = if gas == Gas::Co { 5 } else { gas as usize };
                    // A little further it does change.
                    let changed = [1.0 + 1e-6, 1.0 / (1.0 + 1e-6)].into_iter().any(|beyond| {
                        [factor * beyond, 1.0 / factor * beyond]
                            .into_iter()
                            .any(|by| changes(scaled(index, by)))
                    });
                    prop_assert!(changed, "{gas:?} {factor}");
                    factor
                }
                _ => 1e3,
            };
            for i in 0..6 {
                let by = 1.0 + (limit - 1.0) * part;
                for by in [by, 1.0 / by] {
                    prop_assert!(!changes(scaled(i, by)), "{i} by {by}");
                }
            }
        }
    }
}
