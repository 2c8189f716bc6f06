//! Simulated gas histories of transformers.

use fastrand::Rng;
use time::{Date, Duration};

use crate::{Row, TRANSFORMERS};

/// Fault that develops in a transformer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransformerFault {
    /// Normal ageing without a fault.
    None,
    /// Partial discharges of corona type.
    Pd,
    /// Discharges of low energy.
    D1,
    /// Discharges of high energy.
    D2,
    /// Overheating below 300 °C.
    T1,
    /// Overheating from 300 to 700 °C.
    T2,
    /// Overheating above 700 °C.
    T3,
    /// Discharges together with overheating.
    Dt,
}

impl TransformerFault {
    /// Fault classes without `None`, in order.
    pub const ALL: [Self; 7] =
        [Self::Pd, Self::D1, Self::D2, Self::T1, Self::T2, Self::T3, Self::Dt];

    /// Returns the shares of H2, CH4, C2H6, C2H4 and C2H2 that the fault produces, which need not
    /// sum up to 1: the middles of zones of Duval's triangle 1 and of the ratios of IEC 60599.
    fn gases(self) -> [f64; 5] {
        match self {
            Self::None => [0.0; 5],
            Self::Pd => [0.86, 0.06, 0.004, 0.0003, 0.0002],
            Self::D1 => [0.55, 0.10, 0.02, 0.05, 0.24],
            Self::D2 => [0.40, 0.15, 0.03, 0.20, 0.22],
            Self::T1 => [0.10, 0.42, 0.45, 0.05, 0.0],
            Self::T2 => [0.10, 0.45, 0.15, 0.30, 0.002],
            Self::T3 => [0.12, 0.26, 0.08, 0.56, 0.008],
            Self::Dt => [0.20, 0.36, 0.06, 0.40, 0.09],
        }
    }
}

/// Fault of each transformer, by its index.
const FAULTS: [TransformerFault; TRANSFORMERS] = [
    TransformerFault::None,
    TransformerFault::D1,
    TransformerFault::T3,
    TransformerFault::None,
    TransformerFault::Pd,
    TransformerFault::T1,
    TransformerFault::None,
    TransformerFault::D2,
    TransformerFault::T2,
    TransformerFault::None,
    TransformerFault::Dt,
    TransformerFault::None,
];
/// Transformer that was not sampled in the last years; the one whose laboratory did not always
/// measure acetylene follows.
const FORGOTTEN: usize = 11;
const INCOMPLETE: usize = 6;
/// Number of samples of each transformer; days between them follow.
const SAMPLES: usize = 20;
const DAYS: i64 = 182;
/// Number of samples over which a fault develops; its gas in the end follows, ppm.
const DEVELOPING: usize = 7;
const FAULT_PPM: f64 = 900.0;

/// Generates the histories of all transformers, the last sample some days before `until`.
pub fn histories(seed: u64, until: Date) -> Vec<Row> {
    let mut random = Rng::with_seed(seed);
    let mut rows = Vec::new();
    for (transformer, fault) in FAULTS.into_iter().enumerate() {
        // Corona shows in oil that holds little else.
        let share = if fault == TransformerFault::Pd { 0.05 } else { 1.0 };
        let ageing = share * (0.6 + 0.8 * random.f64());
        for sample in 0..SAMPLES {
            let before_last = (SAMPLES - 1 - sample) as i64;
            let mut days = before_last * DAYS + 3 + 2 * transformer as i64;
            if transformer == FORGOTTEN {
                days += 3 * DAYS;
            }
            let years = sample as f64 * 0.5;
            let begun = sample as f64 - (SAMPLES - DEVELOPING) as f64;
            let grown = ((begun + 1.0) / DEVELOPING as f64).max(0.0).powi(2) * FAULT_PPM;
            let mut row = self::row(&mut random, transformer, until - Duration::days(days));
            add(&mut row, &mut random, ageing * (1.0 + 0.25 * years), fault, grown);
            if transformer == INCOMPLETE && sample % 3 == 1 {
                row.ppm[4] = None;
            }
            rows.push(row);
        }
    }
    rows
}

/// Generates samples of monitors: `count` of each transformer over ten years, the last one on the
/// day before `until`.
pub fn monitored(seed: u64, count: usize, until: Date) -> Vec<Row> {
    const SECONDS: u64 = 10 * 365 * 86_400;
    let mut random = Rng::with_seed(seed);
    let mut rows = Vec::with_capacity(count * TRANSFORMERS);
    for (transformer, fault) in FAULTS.into_iter().enumerate() {
        let share = if fault == TransformerFault::Pd { 0.05 } else { 1.0 };
        let ageing = share * (0.6 + 0.8 * random.f64());
        for sample in 0..count {
            let progress = sample as f64 / count as f64;
            let before = SECONDS - (progress * SECONDS as f64) as u64;
            let day = until - Duration::days(1 + (before / 86_400) as i64);
            let grown = ((progress - 0.65) / 0.35).max(0.0).powi(2) * FAULT_PPM;
            let mut row = self::row(&mut random, transformer, day);
            row.second = 86_399 - (before % 86_400) as u32;
            let scatter = 0.5 + random.f64() + random.f64();
            add(&mut row, &mut random, scatter * ageing * (1.0 + progress), fault, grown);
            rows.push(row);
        }
    }
    rows
}

/// Generates samples with a fault each, one a day on one transformer after the other, all classes
/// in turn; the last one on `until`.
pub fn one_by_one(seed: u64, count: usize, until: Date) -> Vec<(TransformerFault, Row)> {
    let mut random = Rng::with_seed(seed);
    let sample = |index: usize| {
        let day = until - Duration::days((count - 1 - index) as i64);
        let fault = TransformerFault::ALL[index % TransformerFault::ALL.len()];
        let mut row = row(&mut random, index % TRANSFORMERS, day);
        let ppm = FAULT_PPM * (1.0 + 3.0 * random.f64());
        add(&mut row, &mut random, 0.02, fault, ppm);
        (fault, row)
    };
    (0..count).map(sample).collect()
}

fn row(random: &mut Rng, transformer: usize, day: Date) -> Row {
    let load = 0.35 + 0.5 * random.f64();
    let top_oil = 25.0 + 45.0 * load * load + 8.0 * random.f64();
    Row { transformer, day, second: 0, ppm: [None; 9], top_oil, load }
}

/// Adds the gases of ageing and a fault, with the accuracy of a laboratory.
fn add(row: &mut Row, random: &mut Rng, ageing: f64, fault: TransformerFault, fault_ppm: f64) {
    // H2, CH4, C2H6, C2H4, C2H2, CO, CO2, O2, N2 of a sealed transformer.
    const AGED: [f64; 9] = [14.0, 7.0, 9.0, 5.0, 0.1, 150.0, 1300.0, 2400.0, 62_000.0];
    let made = fault.gases();
    for (gas, ppm) in row.ppm.iter_mut().enumerate() {
        let grows = if gas < 7 { ageing } else { 1.0 };
        let of_fault = made.get(gas).copied().unwrap_or(0.0) * fault_ppm;
        let accuracy = 0.94 + 0.12 * random.f64();
        *ppm = Some((AGED[gas] * grows + of_fault) * accuracy);
    }
}
