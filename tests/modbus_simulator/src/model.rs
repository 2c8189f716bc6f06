//! A 220 kV transformer bay that lives: load moves, oil follows.
//!
//! Temperatures are after IEC 60076-7 (exponents of ONAN/ONAF power
//! transformers), in fast motion, so that a demo of minutes shows hours.

use std::f64::consts::TAU;

use serde::Deserialize;

/// Simulated time of one step, seconds. Fixed, so that a seed gives one story.
pub(crate) const STEP_SECONDS: f64 = 0.2;

const RATED_MVA: f64 = 180.0;
const NOMINAL_KV: f64 = 225.0;
const POWER_FACTOR: f64 = 0.96;
/// Simulated over real speed of heat.
const THERMAL_SPEED: f64 = 60.0;
const OIL_SECONDS: f64 = 150.0 * 60.0 / THERMAL_SPEED;
const WINDING_SECONDS: f64 = 7.0 * 60.0 / THERMAL_SPEED;
/// Ratio of load losses at rated current to no-load losses.
const LOSS_RATIO: f64 = 6.0;
const OIL_EXPONENT: f64 = 0.8;
const WINDING_EXPONENT: f64 = 1.6;
/// Top-oil rise at rated load without fans, kelvin.
const RATED_OIL_RISE: f64 = 50.0;
/// Hot-spot over top-oil at rated load, kelvin.
const RATED_HOT_SPOT_GRADIENT: f64 = 22.0;
/// What is left of the rise with no, one and two stages of fans.
const FAN_FACTOR: [f64; 3] = [1.0, 0.85, 0.75];
/// Top-oil temperature at which each stage starts.
const FAN_START_CELSIUS: [f64; 2] = [60.0, 70.0];
/// A stage stops this much below its start.
const FAN_HYSTERESIS: f64 = 5.0;
const NEUTRAL_TAP: f64 = 9.0;
const LAST_TAP: f64 = 17.0;
const TAP_STEP_KV: f64 = 2.75;

/// What the model can tell.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Quantity {
    VoltageL12Kv,
    VoltageL23Kv,
    VoltageL31Kv,
    CurrentL1A,
    CurrentL2A,
    CurrentL3A,
    ActivePowerMw,
    ReactivePowerMvar,
    FrequencyHz,
    LoadPercent,
    AmbientCelsius,
    TopOilCelsius,
    HotSpotCelsius,
    OilLevelPercent,
    TapPosition,
    FanStage,
    #[serde(rename = "fan_stage_1")]
    FanStage1,
    #[serde(rename = "fan_stage_2")]
    FanStage2,
    Sf6PressureBar,
    BreakerPosition,
    DisconnectorPosition,
    BuchholzAlarm,
    StatusWord,
}

/// Slow noise: an Ornstein-Uhlenbeck process of unit deviation.
#[derive(Clone, Copy, Debug, Default)]
struct Noise(f64);

impl Noise {
    fn step(&mut self, random: &mut fastrand::Rng, seconds: f64) {
        let share = STEP_SECONDS / seconds;
        // Twelve uniforms less six: nearly normal, and bounded.
        let normal = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        self.0 += -self.0 * share + (2.0 * share).sqrt() * normal;
    }
}

/// The bay at one moment.
#[derive(Debug)]
pub(crate) struct Bay {
    random: fastrand::Rng,
    seconds: f64,
    phases: [f64; 4],
    noise: [Noise; 8],
    breaker_closed: bool,
    voltage_kv: f64,
    /// Share of the rated power.
    load: f64,
    top_oil: f64,
    hot_spot_gradient: f64,
    tap: f64,
    fan_stage: usize,
}

impl Bay {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = fastrand::Rng::with_seed(seed);
        let phases = std::array::from_fn(|_| random.f64() * TAU);
        let mut bay = Self {
            random,
            seconds: 0.0,
            phases,
            noise: Default::default(),
            breaker_closed: true,
            voltage_kv: NOMINAL_KV,
            load: 0.0,
            top_oil: 0.0,
            hot_spot_gradient: 0.0,
            tap: NEUTRAL_TAP,
            fan_stage: 0,
        };
        bay.step(true);
        // It has run for long: warm from the first moment.
        bay.top_oil = bay.ambient() + bay.ultimate_oil_rise();
        bay.hot_spot_gradient = bay.ultimate_gradient();
        bay
    }

    /// Goes on by [`STEP_SECONDS`].
    pub(crate) fn step(&mut self, breaker_closed: bool) {
        self.seconds += STEP_SECONDS;
        self.breaker_closed = breaker_closed;
        for noise in &mut self.noise {
            noise.step(&mut self.random, 20.0);
        }
        self.voltage_kv = NOMINAL_KV + 3.5 * self.wave(0, 420.0) + 0.15 * self.noise[0].0;
        let demand =
            0.75 + 0.2 * self.wave(1, 600.0) + 0.04 * self.wave(2, 97.0) + 0.008 * self.noise[1].0;
        self.load = if breaker_closed { demand.max(0.0) } else { 0.0 };
        self.warm();
        self.switch_fans();
        self.change_tap();
    }

    fn wave(&self, phase: usize, period_seconds: f64) -> f64 {
        (TAU * self.seconds / period_seconds + self.phases[phase]).sin()
    }

    fn ambient(&self) -> f64 {
        24.0 + 2.0 * self.wave(3, 1800.0) + 0.05 * self.noise[2].0
    }

    fn ultimate_oil_rise(&self) -> f64 {
        let losses = (1.0 + LOSS_RATIO * self.load.powi(2)) / (1.0 + LOSS_RATIO);
        RATED_OIL_RISE * losses.powf(OIL_EXPONENT) * FAN_FACTOR[self.fan_stage]
    }

    fn ultimate_gradient(&self) -> f64 {
        RATED_HOT_SPOT_GRADIENT * self.load.powf(WINDING_EXPONENT)
    }

    fn warm(&mut self) {
        let ultimate = self.ambient() + self.ultimate_oil_rise();
        self.top_oil += (ultimate - self.top_oil) * STEP_SECONDS / OIL_SECONDS;
        let ultimate = self.ultimate_gradient();
        self.hot_spot_gradient +=
            (ultimate - self.hot_spot_gradient) * STEP_SECONDS / WINDING_SECONDS;
    }

    fn switch_fans(&mut self) {
        if self.fan_stage < 2 && self.top_oil >= FAN_START_CELSIUS[self.fan_stage] {
            self.fan_stage += 1;
        } else if self.fan_stage > 0
            && self.top_oil < FAN_START_CELSIUS[self.fan_stage - 1] - FAN_HYSTERESIS
        {
            self.fan_stage -= 1;
        }
    }

    /// Keeps the lower side's voltage, with a dead band.
    fn change_tap(&mut self) {
        let ideal = NEUTRAL_TAP + (self.voltage_kv - NOMINAL_KV) / TAP_STEP_KV;
        if (ideal - self.tap).abs() > 0.7 {
            self.tap = (self.tap + (ideal - self.tap).signum()).clamp(1.0, LAST_TAP);
        }
    }

    /// A quantity, in the unit that its name gives.
    pub(crate) fn read(&self, quantity: Quantity) -> f64 {
        let small = |noise: usize, deviation: f64| 1.0 + deviation * self.noise[noise].0;
        let power_mva = self.load * RATED_MVA;
        let current_a = power_mva * 1000.0 / (3_f64.sqrt() * self.voltage_kv);
        let position = if self.breaker_closed { 2.0 } else { 1.0 };
        match quantity {
            Quantity::VoltageL12Kv => self.voltage_kv * small(3, 0.0004),
            Quantity::VoltageL23Kv => self.voltage_kv * small(4, 0.0004),
            Quantity::VoltageL31Kv => self.voltage_kv * small(5, 0.0004),
            Quantity::CurrentL1A => current_a * small(3, 0.002),
            Quantity::CurrentL2A => current_a * small(4, 0.002),
            Quantity::CurrentL3A => current_a * small(5, 0.002),
            Quantity::ActivePowerMw => power_mva * POWER_FACTOR,
            Quantity::ReactivePowerMvar => power_mva * (1.0 - POWER_FACTOR.powi(2)).sqrt(),
            Quantity::FrequencyHz => 50.0 + 0.012 * self.noise[6].0,
            Quantity::LoadPercent => 100.0 * self.load,
            Quantity::AmbientCelsius => self.ambient(),
            Quantity::TopOilCelsius => self.top_oil,
            Quantity::HotSpotCelsius => self.top_oil + self.hot_spot_gradient,
            // Oil grows with heat.
            Quantity::OilLevelPercent => 55.0 + 0.5 * (self.top_oil - 50.0),
            Quantity::TapPosition => self.tap,
            Quantity::FanStage => self.fan_stage as f64,
            Quantity::FanStage1 => f64::from(u8::from(self.fan_stage >= 1)),
            Quantity::FanStage2 => f64::from(u8::from(self.fan_stage >= 2)),
            Quantity::Sf6PressureBar => 6.4 + 0.02 * (self.ambient() - 20.0) * small(7, 0.02),
            Quantity::BreakerPosition => position,
            Quantity::DisconnectorPosition => 2.0,
            Quantity::BuchholzAlarm => 0.0,
            // Bits 0-1 breaker, 2-3 disconnector, 4 Buchholz alarm, 5-6 fans.
            Quantity::StatusWord => {
                let fans = [0.0, 32.0, 96.0][self.fan_stage];
                position + 4.0 * 2.0 + fans
            }
        }
    }

    /// Simulated time since the start, seconds.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs an hour and gives a quantity at every step.
    fn hour(seed: u64, quantity: Quantity) -> Vec<f64> {
        let mut bay = Bay::new(seed);
        (0..18_000)
            .map(|_| {
                bay.step(true);
                bay.read(quantity)
            })
            .collect()
    }

    #[test]
    fn quantities_stay_believable_and_move_slowly() {
        let cases = [
            (Quantity::VoltageL12Kv, 219.0, 231.0, 0.5),
            (Quantity::CurrentL2A, 220.0, 500.0, 5.0),
            (Quantity::ActivePowerMw, 80.0, 175.0, 2.0),
            (Quantity::ReactivePowerMvar, 20.0, 52.0, 1.0),
            (Quantity::FrequencyHz, 49.9, 50.1, 0.02),
            (Quantity::TopOilCelsius, 40.0, 75.0, 0.1),
            (Quantity::HotSpotCelsius, 48.0, 98.0, 0.6),
            (Quantity::OilLevelPercent, 45.0, 70.0, 0.1),
            (Quantity::TapPosition, 6.0, 12.0, 1.0),
            (Quantity::Sf6PressureBar, 6.3, 6.6, 0.02),
        ];
        for (quantity, low, high, most_a_step) in cases {
            let values = hour(7, quantity);
            for pair in values.windows(2) {
                assert!((low..=high).contains(&pair[1]), "{quantity:?} {}", pair[1]);
                let step = (pair[1] - pair[0]).abs();
                assert!(step <= most_a_step, "{quantity:?} jumps by {step}");
            }
            assert!(values.iter().any(|v| *v != values[0]), "{quantity:?} rests");
        }
    }

    #[test]
    fn fans_run_at_times() {
        let stages = hour(7, Quantity::FanStage);
        assert!(stages.contains(&0.0) && stages.contains(&1.0));
    }

    #[test]
    fn a_seed_tells_one_story() {
        assert_eq!(hour(1, Quantity::CurrentL1A), hour(1, Quantity::CurrentL1A));
        assert_ne!(hour(1, Quantity::CurrentL1A), hour(2, Quantity::CurrentL1A));
    }

    #[test]
    fn an_open_breaker_carries_nothing_and_the_oil_cools() {
        let mut bay = Bay::new(3);
        let warm = bay.read(Quantity::TopOilCelsius);
        for _ in 0..3000 {
            bay.step(false);
        }
        assert_eq!(bay.read(Quantity::CurrentL1A), 0.0);
        assert_eq!(bay.read(Quantity::ActivePowerMw), 0.0);
        assert_eq!(bay.read(Quantity::BreakerPosition), 1.0);
        assert!(bay.read(Quantity::TopOilCelsius) < warm - 10.0);
        assert!(bay.read(Quantity::VoltageL12Kv) > 200.0);
    }
}
