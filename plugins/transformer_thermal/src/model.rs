//! Top-oil and hot-spot temperatures of an oil-immersed transformer from its load: the
//! exponential model of IEC 60076-7:2018, 8.2.2, in steps of any length (the load and the
//! ambient temperature are constant within one).

/// What a transformer is like. Temperatures in kelvin of rise, times in minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Time constant of the oil, minutes.
    pub oil_minutes: f64,
    /// Time constant of the winding, minutes.
    pub winding_minutes: f64,
    /// Top-oil rise at rated load, K.
    pub top_oil_rise: f64,
    /// Gradient from the winding to the oil at rated load, K.
    pub gradient: f64,
    /// Hot-spot factor H.
    pub hot_spot_factor: f64,
    /// Load losses over no-load losses, R.
    pub loss_ratio: f64,
    /// Oil exponent x.
    pub oil_exponent: f64,
    /// Winding exponent y.
    pub winding_exponent: f64,
    /// Constants k11, k21 and k22.
    pub k: [f64; 3],
}

/// Temperatures at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperatures {
    /// Top oil, degrees Celsius.
    pub top_oil: f64,
    /// Two differences whose difference is the hot-spot's rise over the top oil, K.
    rises: [f64; 2],
}

impl Temperatures {
    /// With a known top oil and no load before.
    pub fn with_top_oil(top_oil: f64) -> Self {
        Self { top_oil, rises: [0.0; 2] }
    }

    /// After a load that has been constant for long. `load`: per unit of the rated one;
    /// `ambient`: degrees Celsius.
    pub fn steady(parameters: &Parameters, load: f64, ambient: f64) -> Self {
        Self {
            top_oil: parameters.steady_top_oil(load, ambient),
            rises: parameters.steady_rises(load),
        }
    }

    /// The winding's hot spot, degrees Celsius.
    pub fn hot_spot(&self) -> f64 {
        self.top_oil + self.rises[0] - self.rises[1]
    }

    /// After so many minutes of a load and an ambient temperature.
    pub fn after(&self, parameters: &Parameters, minutes: f64, load: f64, ambient: f64) -> Self {
        let Parameters { oil_minutes, winding_minutes, k: [k11, _, k22], .. } = *parameters;
        let towards =
            |from: f64, to: f64, constant: f64| to + (from - to) * (-minutes / constant).exp();
        let [first, second] = parameters.steady_rises(load);
        Self {
            top_oil: towards(
                self.top_oil,
                parameters.steady_top_oil(load, ambient),
                oil_minutes * k11,
            ),
            rises: [
                towards(self.rises[0], first, winding_minutes * k22),
                towards(self.rises[1], second, oil_minutes / k22),
            ],
        }
    }

    /// How many times as fast paper ages than at its rated temperature: normal paper at
    /// 98 degrees Celsius, or thermally upgraded paper at 110 (IEC 60076-7, 6.3).
    pub fn ageing(&self, upgraded_paper: bool) -> f64 {
        let hot_spot = self.hot_spot();
        if upgraded_paper {
            (15_000.0 / (110.0 + 273.0) - 15_000.0 / (hot_spot + 273.0)).exp()
        } else {
            ((hot_spot - 98.0) / 6.0).exp2()
        }
    }
}

impl Parameters {
    fn steady_top_oil(&self, load: f64, ambient: f64) -> f64 {
        let losses = (1.0 + self.loss_ratio * load * load) / (1.0 + self.loss_ratio);
        ambient + self.top_oil_rise * losses.powf(self.oil_exponent)
    }

    fn steady_rises(&self, load: f64) -> [f64; 2] {
        let [_, k21, _] = self.k;
        let rise = self.hot_spot_factor * self.gradient * load.abs().powf(self.winding_exponent);
        [k21 * rise, (k21 - 1.0) * rise]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The transformer of the example in IEC 60076-7.
    const EXAMPLE: Parameters = Parameters {
        oil_minutes: 150.0,
        winding_minutes: 7.0,
        top_oil_rise: 38.3,
        gradient: 14.5,
        hot_spot_factor: 1.4,
        loss_ratio: 1000.0,
        oil_exponent: 0.8,
        winding_exponent: 1.3,
        k: [0.5, 2.0, 2.0],
    };
    const AMBIENT: f64 = 25.6;
    const FIRST_TOP_OIL: f64 = 38.3;
    /// Load until a minute, and the printed top-oil and hot-spot temperatures then.
    const PRINTED: [(f64, f64, [f64; 2]); 6] = [
        (190.0, 1.0, [61.9, 83.8]),
        (365.0, 0.6, [44.4, 54.0]),
        (500.0, 1.5, [89.2, 127.0]),
        (705.0, 0.3, [35.0, 37.5]),
        (730.0, 2.1, [67.9, 138.6]),
        (745.0, 0.0, [60.3, 75.3]),
    ];

    /// Temperatures at the printed points, in steps of so many minutes at most.
    fn walk(step: f64) -> Vec<[f64; 2]> {
        let mut temperatures = Temperatures::with_top_oil(FIRST_TOP_OIL);
        let mut minute = 0.0;
        let mut all = Vec::new();
        for (until, load, _) in PRINTED {
            while minute < until {
                let minutes = f64::min(step, until - minute);
                temperatures = temperatures.after(&EXAMPLE, minutes, load, AMBIENT);
                minute += minutes;
            }
            all.push([temperatures.top_oil, temperatures.hot_spot()]);
        }
        all
    }

    #[test]
    fn the_standards_example_is_met_within_a_kelvin_and_a_tenth() {
        for ((until, _, printed), ours) in PRINTED.into_iter().zip(walk(1.0)) {
            println!("minute {until}: {ours:.2?}, printed {printed:?}");
            for (printed, ours) in printed.into_iter().zip(ours) {
                assert!((printed - ours).abs() <= 1.1, "minute {until}: {ours} for {printed}");
            }
        }
    }

    #[test]
    fn the_length_of_steps_changes_nothing() {
        for (fine, coarse) in walk(0.05).into_iter().zip(walk(1e9)) {
            for (fine, coarse) in fine.into_iter().zip(coarse) {
                assert!((fine - coarse).abs() < 1e-6, "{fine} {coarse}");
            }
        }
    }

    #[test]
    fn a_long_load_comes_to_the_steady_state() {
        let steady = Temperatures::steady(&EXAMPLE, 0.8, 20.0);
        let after = Temperatures::with_top_oil(90.0).after(&EXAMPLE, 1e5, 0.8, 20.0);
        assert!((after.top_oil - steady.top_oil).abs() < 1e-9);
        assert!((after.hot_spot() - steady.hot_spot()).abs() < 1e-9);
        // Of the rated load: rises add up to the limits of a transformer as built.
        let rated = Temperatures::steady(&EXAMPLE, 1.0, 20.0);
        assert!((rated.top_oil - 58.3).abs() < 1e-9);
        assert!((rated.hot_spot() - (58.3 + 1.4 * 14.5)).abs() < 1e-9);
    }

    #[test]
    fn paper_ages_at_its_rated_temperature_as_rated() {
        let at = |hot_spot| Temperatures::with_top_oil(hot_spot);
        assert!((at(98.0).ageing(false) - 1.0).abs() < 1e-12);
        assert!((at(104.0).ageing(false) - 2.0).abs() < 1e-12);
        assert!((at(110.0).ageing(true) - 1.0).abs() < 1e-12);
        // IEC 60076-7, table 2: thermally upgraded paper at 98 degrees Celsius.
        assert!((at(98.0).ageing(true) - 0.282).abs() < 1e-3);
    }
}
