//! Least and greatest solution of the exponential model under inputs known between bounds.
//!
//! Each part of the state is a first-order lag, so its bounds are solutions of the same
//! equation from the bounds of its input. In every column of table 4 either k21 is 1 or
//! k11 times the oil's time constant is that constant over k22: the top oil and the slower
//! of the hot spot's differences then have one time constant, and their difference is kept
//! as one lag. Without that the bounds of the hot spot would be far wider than its course.

use crate::interval::Interval;
use crate::model::Parameters;

/// Greatest load in the search for the turning point of the oil less lag, per unit.
const MAX_TURNING_LOAD: f64 = 10.0;
/// Halvings in that search: the turning point to within 1e-8 per unit.
const TURNING_STEPS: usize = 30;
/// Share of the past below which a state says nothing of it.
const FORGOTTEN: f64 = 1e-9;

/// Thermal parameters of a stage of cooling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CoolingStage {
    pub(crate) parameters: Parameters,
    /// Rated load of the stage over that of the transformer.
    pub(crate) rated_share: f64,
    /// Load of the least steady oil less lag, per unit of the stage's rated load.
    turning_load: f64,
}

impl CoolingStage {
    pub(crate) fn new(parameters: Parameters, rated_share: f64) -> Self {
        Self { parameters, rated_share, turning_load: turning_load(&parameters) }
    }

    /// Steady state that a load and an ambient temperature lead to.
    fn steady(&self, load: Interval, ambient: Interval) -> TemperatureBand {
        let parameters = &self.parameters;
        let load = load.map(|load| load / self.rated_share);
        let rises = |part: usize| load.map(|load| parameters.steady_rises(load)[part]);
        let less_lag =
            |load: f64| parameters.steady_top_oil_rise(load) - parameters.steady_rises(load)[1];
        let turning = self.turning_load.clamp(load.low, load.high);
        let ends = Interval::point(less_lag(load.low)).hull(Interval::point(less_lag(load.high)));
        TemperatureBand {
            top_oil: ambient + load.map(|load| parameters.steady_top_oil_rise(load)),
            oil_less_lag: ambient + ends.hull(Interval::point(less_lag(turning))),
            winding_rise: rises(0),
            oil_lag: rises(1),
        }
    }

    /// Time constants of the parts, in the order of [`TemperatureBand::parts`].
    fn minutes(&self) -> [f64; 4] {
        let Parameters { oil_minutes, winding_minutes, k: [k11, _, k22], .. } = self.parameters;
        let oil = oil_minutes * k11;
        [oil, oil, winding_minutes * k22, oil_minutes / k22]
    }
}

/// Finds the load at which the steady top oil less the slower difference turns from
/// falling to rising: it falls at first where k21 is above 1.
fn turning_load(parameters: &Parameters) -> f64 {
    let Parameters { loss_ratio, oil_exponent, winding_exponent, .. } = *parameters;
    let [_, lag] = parameters.steady_rises(1.0);
    let slope = |load: f64| {
        let losses = (1.0 + loss_ratio * load * load) / (1.0 + loss_ratio);
        let of_losses = 2.0 * loss_ratio * load / (1.0 + loss_ratio);
        parameters.top_oil_rise * oil_exponent * losses.powf(oil_exponent - 1.0) * of_losses
            - lag * winding_exponent * load.powf(winding_exponent - 1.0)
    };
    let mut bounds = Interval::new(0.0, MAX_TURNING_LOAD);
    for _ in 0..TURNING_STEPS {
        match slope(bounds.middle()) < 0.0 {
            true => bounds.low = bounds.middle(),
            false => bounds.high = bounds.middle(),
        }
    }
    bounds.middle()
}

/// Inputs of the model in a step, and the stages of cooling that may run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive<'a> {
    /// Load, per unit of the transformer's rated load.
    pub(crate) load: Interval,
    /// Ambient temperature, degrees Celsius.
    pub(crate) ambient: Interval,
    /// Stages of cooling; one where it is known.
    pub(crate) stages: &'a [CoolingStage],
}

impl Drive<'_> {
    /// Steady state between the least and the greatest that the inputs lead to.
    pub(crate) fn steady(&self) -> TemperatureBand {
        let mut stages = self.stages.iter().map(|of| of.steady(self.load, self.ambient));
        let first = stages.next().unwrap_or_default();
        stages.fold(first, TemperatureBand::hull)
    }

    /// Shortest and longest time constant of each part.
    fn minutes(&self) -> [Interval; 4] {
        let mut stages = self.stages.iter().map(|of| of.minutes().map(Interval::point));
        let first = stages.next().unwrap_or([Interval::point(1.0); 4]);
        stages.fold(first, |all, of| std::array::from_fn(|part| all[part].hull(of[part])))
    }
}

/// Bounds of the model's state, degrees Celsius and K.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct TemperatureBand {
    /// Top oil, degrees Celsius.
    pub(crate) top_oil: Interval,
    /// Top oil less the slower difference, degrees Celsius.
    oil_less_lag: Interval,
    /// Faster of the hot spot's differences, K.
    winding_rise: Interval,
    /// Slower of the hot spot's differences, K.
    oil_lag: Interval,
}

impl Default for TemperatureBand {
    fn default() -> Self {
        let zero = Interval::point(0.0);
        Self { top_oil: zero, oil_less_lag: zero, winding_rise: zero, oil_lag: zero }
    }
}

impl TemperatureBand {
    /// Hot spot of the winding, degrees Celsius.
    pub(crate) fn hot_spot(&self) -> Interval {
        self.oil_less_lag + self.winding_rise
    }

    /// Rise of the hot spot over a top oil that is measured, K.
    pub(crate) fn hot_spot_rise(&self) -> Interval {
        self.winding_rise - self.oil_lag
    }

    /// Bounds after minutes of a drive.
    pub(crate) fn after(&self, minutes: f64, drive: &Drive<'_>) -> Self {
        let targets = drive.steady().parts();
        let constants = drive.minutes();
        self.map_parts(|part, from| approach(from, targets[part], minutes, constants[part]))
    }

    /// Bounds so many minutes before, under a drive that is not known any better. They hold
    /// the present ones: no time may have passed at all.
    pub(crate) fn before(&self, minutes: f64, drive: &Drive<'_>) -> Self {
        let targets = drive.steady().parts();
        let constants = drive.minutes();
        self.map_parts(|part, now| {
            let all = targets[part].hull(now);
            let kept = (-minutes / constants[part].low).exp();
            if kept < FORGOTTEN {
                return all;
            }
            let low = (now.low - (1.0 - kept) * all.high) / kept;
            let high = (now.high - (1.0 - kept) * all.low) / kept;
            Interval::new(low.max(all.low), high.min(all.high)).hull(now)
        })
    }

    /// Narrows the band to where the top oil lies; `None` where the band has nothing there.
    pub(crate) fn with_top_oil(&self, measured: Interval) -> Option<Self> {
        let top_oil = self.top_oil.intersection(measured)?;
        let oil_less_lag = self.oil_less_lag.intersection(top_oil - self.oil_lag)?;
        Some(Self { top_oil, oil_less_lag, ..*self })
    }

    /// Reports whether the numbers can be those of a transformer.
    pub(crate) fn is_plausible(&self) -> bool {
        let is_ordered = |of: &Interval| of.low <= of.high && of.low > -1e3 && of.high < 1e4;
        self.parts().iter().all(is_ordered)
    }

    fn hull(self, other: Self) -> Self {
        let others = other.parts();
        self.map_parts(|part, of| of.hull(others[part]))
    }

    fn parts(&self) -> [Interval; 4] {
        [self.top_oil, self.oil_less_lag, self.winding_rise, self.oil_lag]
    }

    fn map_parts(&self, map: impl Fn(usize, Interval) -> Interval) -> Self {
        let parts = self.parts();
        let [top_oil, oil_less_lag, winding_rise, oil_lag] =
            std::array::from_fn(|part| map(part, parts[part]));
        Self { top_oil, oil_less_lag, winding_rise, oil_lag }
    }
}

/// Bounds of a first-order lag after minutes. Where the time constant is not known the
/// fastest approach outwards and the slowest inwards count.
fn approach(from: Interval, target: Interval, minutes: f64, constants: Interval) -> Interval {
    let towards = |from: f64, to: f64, is_outwards: bool| {
        let constant = if is_outwards { constants.low } else { constants.high };
        to + (from - to) * (-minutes / constant).exp()
    };
    Interval {
        low: towards(from.low, target.low, target.low < from.low),
        high: towards(from.high, target.high, target.high > from.high),
    }
}

#[cfg(test)]
#[path = "temperature_band_tests.rs"]
mod tests;
