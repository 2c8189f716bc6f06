//! Least and greatest plausible history, and what lies beyond them.

use transformer_thermal::{Parameters, Temperatures};

use crate::case::{AMBIENT, LOAD};

/// Distances from the two solutions to the bounds of other plausible histories, K: the top
/// oil less the slower difference may fall with the load before it rises, so a history in
/// between may be cooler than the least load, or hotter than the greatest.
pub(crate) fn turning(of: &Parameters) -> [f64; 2] {
    let steady = |load: f64| {
        let losses = (1.0 + of.loss_ratio * load * load) / (1.0 + of.loss_ratio);
        let rise = of.hot_spot_factor * of.gradient * load.powf(of.winding_exponent);
        of.top_oil_rise * losses.powf(of.oil_exponent) - (of.k[1] - 1.0) * rise
    };
    let loads = (0..=180).map(|load| steady(f64::from(load) / 100.0));
    let [least, greatest] = LOAD.map(steady);
    [least - loads.fold(f64::INFINITY, f64::min), (least - greatest).max(0.0)]
}

/// Least and greatest plausible history, by the exact model.
pub(crate) struct Oracle<'a> {
    pub(crate) parameters: &'a Parameters,
    pub(crate) solutions: [Temperatures; 2],
    /// Faults of the frame before.
    pub(crate) before: [bool; 2],
}

impl Oracle<'_> {
    pub(crate) fn steady(parameters: &Parameters) -> [Temperatures; 2] {
        [0, 1].map(|end| Temperatures::steady(parameters, LOAD[end], AMBIENT[end]))
    }

    /// Moves both on; what is not seen is at its end.
    pub(crate) fn step(&mut self, minutes: f64, [load, ambient]: [f64; 2], is_seen: [bool; 2]) {
        let [sees_load, sees_ambient] = [0, 1].map(|of| is_seen[of] && self.before[of]);
        self.before = is_seen;
        for end in [0, 1] {
            let load = if sees_load { load } else { LOAD[end] };
            let ambient = if sees_ambient { ambient } else { AMBIENT[end] };
            self.solutions[end] =
                self.solutions[end].after(self.parameters, minutes, load, ambient);
        }
    }
}
