//! Probabilities of zones against a Monte Carlo of a million draws.
#![allow(clippy::print_stdout, reason = "the difference measured is a result")]

mod common;

use std::collections::BTreeMap;

use common::Random;
use dga::iec60599::{self, Equipment};
use dga::pentagon::{PENTAGON_1, PENTAGON_2};
use dga::uncertainty::{Uncertainty, probabilities};
use dga::{Gas, Sample, Zone};
use dga::{dlt722, doernenburg, key_gas, rogers, triangle_1, triangle_4, triangle_5};

const DRAWS: u32 = 1_000_000;
const SEED: u64 = 60_599;
/// Greatest difference that is allowed.
const TOLERANCE: f64 = 0.005;

type Method = fn(&Sample) -> Vec<Zone>;

const METHODS: [Method; 10] = [
    |sample| iec60599::zones(sample, Equipment::Transformer).collect(),
    |sample| vec![rogers::zone(sample)],
    |sample| vec![doernenburg::zone(sample)],
    |sample| vec![key_gas::zone(sample)],
    |sample| vec![dlt722::zone(sample)],
    |sample| vec![triangle_1::zone(sample)],
    |sample| vec![triangle_4::zone(sample)],
    |sample| vec![triangle_5::zone(sample)],
    |sample| vec![PENTAGON_1.zone(sample)],
    |sample| vec![PENTAGON_2.zone(sample)],
];

/// Returns the greatest difference of any probability of any method over some random samples.
fn greatest_difference(samples: u32) -> f64 {
    let mut random = Random(SEED);
    let mut greatest = 0.0_f64;
    for _ in 0..samples {
        // Near each other, so that several zones are in reach.
        let scale = random.log(20.0, 2000.0);
        let ppm: [f64; 5] = std::array::from_fn(|_| scale * random.log(0.05, 3.0));
        let sample = Sample::of_five(ppm).expect("it is valid");
        let mut counts: [BTreeMap<Vec<Zone>, u32>; METHODS.len()] = Default::default();
        for _ in 0..DRAWS {
            let drawn = ppm.map(|ppm| ppm * (0.85 + 0.3 * random.unit()));
            let drawn = Sample::of_five(drawn).expect("it is valid");
            for (counts, method) in counts.iter_mut().zip(METHODS) {
                *counts.entry(method(&drawn)).or_default() += 1;
            }
        }
        for (mut counts, method) in counts.into_iter().zip(METHODS) {
            let ours = probabilities(&sample, Uncertainty::DEFAULT, &Gas::FIVE, method);
            assert!((ours.values().sum::<f64>() - 1.0).abs() < 1e-12);
            for (zone, ours) in ours {
                let drawn = f64::from(counts.remove(&zone).unwrap_or(0)) / f64::from(DRAWS);
                greatest = greatest.max((ours - drawn).abs());
            }
            // What the points missed.
            let missed = counts.into_values().max().unwrap_or(0);
            greatest = greatest.max(f64::from(missed) / f64::from(DRAWS));
        }
    }
    println!("greatest difference over {samples} samples: {greatest:.5}");
    greatest
}

#[test]
fn probabilities_are_those_of_a_million_draws() {
    assert!(greatest_difference(2) < TOLERANCE);
}

/// Measures the difference on request: `cargo nextest run --workspace -E 'package(dga)'
/// --run-ignored only`.
#[test]
#[ignore = "minutes"]
fn probabilities_of_two_hundred_samples_are_those_of_a_million_draws() {
    assert!(greatest_difference(200) < TOLERANCE);
}
