//! Gas mixtures by their maker's isochores: pressure over temperature at constant density.

use std::collections::BTreeMap;

/// Isochores of one mixture.
const MAX_ISOCHORES: usize = 64;
/// Points of one isochore, and of a dew line.
const MAX_POINTS: usize = 256;
/// Gases of one mixture.
const MAX_GASES: usize = 8;
/// Departure of a composition's sum from 100 %.
const COMPOSITION_TOLERANCE: f64 = 0.5;
/// Share of an isochore's pressure beyond the outermost one that is still scaled.
const BEYOND: f64 = 0.2;
/// Names of the fluoronitrile whose condensing changes the composition of the vapor.
const FLUORONITRILE: [&str; 4] = ["C4-FN", "C4FN", "C4F7N", "NOVEC 4710"];

/// Gas mixture, as its maker's data sheet gives it. Pressures are in the unit and of the
/// kind, gauge or absolute, of the settings; gauge pressures are those at sea level.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MixtureSettings {
    /// Gases with their share by volume, %, 100 in all, such as `{ "SF6": 50, "N2": 50 }`.
    pub composition: BTreeMap<String, f64>,
    /// Isochores, each with points of temperature, °C, and pressure; one of the points, or
    /// the line between two, is at 20 °C.
    #[schemars(length(min = 1, max = MAX_ISOCHORES))]
    pub isochores: Vec<Vec<[f64; 2]>>,
    /// Dew line: points of temperature, °C, and of the pressure from which on the gas
    /// condenses at it. Verdicts without one say that no condensation is assumed.
    #[serde(default)]
    #[schemars(length(max = MAX_POINTS))]
    pub dew_line: Vec<[f64; 2]>,
}

/// Line through points that rise in their first number.
#[derive(Clone, Debug)]
struct Polyline(Vec<[f64; 2]>);

impl Polyline {
    /// Interpolates linearly; `None` outside of the points.
    fn at(&self, x: f64) -> Option<f64> {
        let after = self.0.partition_point(|[at, _]| *at < x);
        let [at, y] = *self.0.get(after)?;
        if at == x {
            return Some(y);
        }
        let [before, from] = *self.0.get(after.checked_sub(1)?)?;
        Some(from + (y - from) * (x - before) / (at - before))
    }
}

/// Mixture with absolute pressures, MPa.
#[derive(Clone, Debug)]
pub(crate) struct Mixture {
    /// Pressure at 20 °C with the isochore, rising.
    isochores: Vec<(f64, Polyline)>,
    dew_line: Option<Polyline>,
    /// Reports whether pressure and temperature give no density once it condenses.
    pub(crate) loses_density: bool,
}

impl Mixture {
    /// Reads a mixture; `absolute` converts pressures of the settings to MPa, in which
    /// `filling` is.
    ///
    /// # Errors
    /// Fault in words.
    pub(crate) fn new(
        settings: &MixtureSettings,
        absolute: impl Fn(f64) -> f64,
        filling: f64,
    ) -> Result<Self, String> {
        let MixtureSettings { composition, isochores, dew_line } = settings;
        let sum: f64 = composition.values().sum();
        let is_share = |share: &f64| (0.0..=100.0).contains(share);
        let adds_up = (sum - 100.0).abs() <= COMPOSITION_TOLERANCE;
        if composition.len() > MAX_GASES || !composition.values().all(is_share) || !adds_up {
            return Err(format!(
                "mixture.composition: the shares are {sum} % in all; give at most {MAX_GASES} \
                 gases whose shares by volume are 100 % in all"
            ));
        }
        if !(1..=MAX_ISOCHORES).contains(&isochores.len()) {
            return Err(format!("mixture.isochores: give 1 to {MAX_ISOCHORES} isochores"));
        }
        let read = |points: &[[f64; 2]], name: &str| {
            let points: Vec<_> = points.iter().map(|[at, p]| [*at, absolute(*p)]).collect();
            let rises = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
            let is_sound = |[at, p]: &[f64; 2]| (-100.0..=200.0).contains(at) && *p > 0.0;
            let is_long = (2..=MAX_POINTS).contains(&points.len());
            if is_long && rises && points.iter().all(is_sound) {
                return Ok(Polyline(points));
            }
            Err(format!(
                "{name}: give 2 to {MAX_POINTS} points [°C, pressure] with rising temperatures \
                 from -100 to 200 and pressures above vacuum"
            ))
        };
        let isochore = |(index, points): (usize, &Vec<[f64; 2]>)| {
            let name = format!("mixture.isochores[{index}]");
            let line = read(points, &name)?;
            let at_20 = line.at(20.0);
            at_20.map(|at_20| (at_20, line)).ok_or(format!("{name}: it does not reach 20 °C"))
        };
        let mut isochores: Vec<_> =
            isochores.iter().enumerate().map(isochore).collect::<Result<_, _>>()?;
        isochores.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_fluoronitrile =
            |gas: &String| FLUORONITRILE.iter().any(|name| name.eq_ignore_ascii_case(gas.trim()));
        let loses_density = composition.keys().any(is_fluoronitrile);
        if loses_density && dew_line.is_empty() {
            return Err("mixture.dew_line: C4-FN condenses in service, and pressure and \
                        temperature then give no density; give its dew line"
                .into());
        }
        let dew_line = match dew_line.as_slice() {
            [] => None,
            points => Some(read(points, "mixture.dew_line")?),
        };
        let reach = dew_line.as_ref().and_then(|Polyline(points)| points.last());
        if reach.is_some_and(|[_, pressure]| *pressure < filling) {
            return Err("mixture.dew_line: it ends below the filling pressure, so that \
                        condensation at warmer temperatures would be missed; give it up to there"
                .into());
        }
        Ok(Self { isochores, dew_line, loses_density })
    }

    /// Absolute pressure at 20 °C, MPa; `None` outside of the isochores.
    pub(crate) fn at_reference(&self, megapascals: f64, celsius: f64) -> Option<f64> {
        let mut below: Option<[f64; 2]> = None;
        for (at_20, line) in &self.isochores {
            let here = line.at(celsius)?;
            if here >= megapascals {
                let [from_20, from] = below.unwrap_or([0.0, 0.0]);
                let share = (megapascals - from) / (here - from);
                // Isochores that cross give no density.
                return (0.0..=1.0).contains(&share).then_some(from_20 + (at_20 - from_20) * share);
            }
            below = Some([*at_20, here]);
        }
        // Above the outermost isochore the pressure scales with it, for a while.
        let [at_20, here] = below?;
        let share = megapascals / here;
        (share <= 1.0 + BEYOND).then_some(at_20 * share)
    }

    /// Absolute pressure from which on it condenses at a temperature, °C; infinite where the
    /// dew line has ended to the warm, `None` without one and to the cold of it.
    pub(crate) fn dew_pressure(&self, celsius: f64) -> Option<f64> {
        let line = self.dew_line.as_ref()?;
        match line.0.last() {
            Some([last, _]) if celsius > *last => Some(f64::INFINITY),
            // Colder than the line begins: at most the pressure there.
            _ => line.at(celsius).or_else(|| line.0.first().map(|[_, p]| *p)),
        }
    }

    /// Reports whether a dew line is known.
    pub(crate) fn has_dew_line(&self) -> bool {
        self.dew_line.is_some()
    }
}
