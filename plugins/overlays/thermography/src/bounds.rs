//! Bounds of a contact's grade from inputs that may be missing.
//!
//! A missing input is every value that it may have: the grade is certain where all agree. Of
//! peers only the coolest counts, and a hotter or cooler one moves the grade one way, as the
//! load does. Of the air the grade is no monotone function, so it is worked out at every
//! temperature at which it may change, and between these.

use crate::rules::{Contact, Grading, Rule};

/// Temperatures that contacts have, °C: others are faults of the sensor.
pub(crate) const CONTACT_RANGE: [f64; 2] = [-60.0, 300.0];
/// Temperatures that the air has, °C (IEC 62271-1:2017, 4.1.4, with some margin).
pub(crate) const AMBIENT_RANGE: [f64; 2] = [-60.0, 60.0];

/// Rounding of temperatures that are sums and differences, K.
const ROUNDING: f64 = 1e-9;

/// Temperature that may be missing, °C.
pub(crate) type Temperature = Option<f64>;

/// Air around a contact, °C.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ambient {
    Known(f64),
    Missing,
}

/// Factors to the rated load that are possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LoadFactors {
    pub(crate) low: f64,
    /// `None` where there is no end: at no load a defect does not show.
    pub(crate) high: Option<f64>,
}

impl LoadFactors {
    /// Load as it is.
    pub(crate) const UNCORRECTED: Self = Self { low: 1.0, high: Some(1.0) };
    /// Load of which nothing is known.
    pub(crate) const UNKNOWN: Self = Self { low: 1.0, high: None };
}

/// Contact with what is known of its surroundings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Surroundings<'s> {
    /// Temperature of the contact, within [`CONTACT_RANGE`].
    pub(crate) hot: f64,
    /// Temperatures of the peers of the contact.
    pub(crate) peers: &'s [Temperature],
    /// Temperatures of the air; several where it is not known which counts.
    pub(crate) ambients: &'s [Ambient],
    pub(crate) load: LoadFactors,
    /// Distance below the air from which on a temperature is not believed, K.
    pub(crate) tolerance: f64,
}

/// Least and greatest grade that the inputs admit, the latter `None` where none is admitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GradeBounds {
    pub(crate) least: Option<usize>,
    pub(crate) greatest: Option<usize>,
}

impl GradeBounds {
    fn join(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), greatest: self.greatest.max(other.greatest) }
    }
}

/// Works out the grades that are possible.
pub(crate) fn bounds(grading: &Grading, surroundings: &Surroundings<'_>) -> GradeBounds {
    let worst = grading.rule.grades().len() - 1;
    let anything = GradeBounds { least: None, greatest: Some(worst) };
    let at = |ambient: f64| at_ambient(grading, surroundings, ambient, worst);
    let of_air = |ambient: &Ambient| match *ambient {
        Ambient::Known(ambient) => at(ambient),
        Ambient::Missing => {
            let temperatures = possible_ambients(grading, surroundings);
            temperatures.into_iter().map(at).reduce(GradeBounds::join).unwrap_or(anything)
        }
    };
    surroundings.ambients.iter().map(of_air).reduce(GradeBounds::join).unwrap_or(anything)
}

/// Coolest of the temperatures that are believed, the contact's own included.
pub(crate) fn coolest(surroundings: &Surroundings<'_>, ambient: Option<f64>) -> Option<f64> {
    let peers = surroundings.peers.iter().flatten().copied();
    let believed = peers.filter(|peer| is_believed(*peer, ambient, surroundings.tolerance));
    believed.reduce(f64::min).map(|coolest| coolest.min(surroundings.hot))
}

/// Reports whether a temperature of a contact is plausible in the air around.
pub(crate) fn is_believed(celsius: f64, ambient: Option<f64>, tolerance: f64) -> bool {
    let [low, high] = CONTACT_RANGE;
    (low..=high).contains(&celsius)
        && ambient.is_none_or(|ambient| celsius >= ambient - tolerance - ROUNDING)
}

fn at_ambient(
    grading: &Grading,
    surroundings: &Surroundings<'_>,
    ambient: f64,
    worst: usize,
) -> GradeBounds {
    let Surroundings { hot, peers, load, tolerance, .. } = *surroundings;
    if !is_believed(hot, Some(ambient), tolerance) {
        return GradeBounds { least: None, greatest: Some(worst) };
    }
    let is_known =
        |peer: &Temperature| peer.is_some_and(|peer| is_believed(peer, Some(ambient), tolerance));
    let known = coolest(surroundings, Some(ambient));
    // A peer that is not known may be as cool as the air, or as hot as any.
    let is_missing = !peers.iter().all(is_known);
    let [hottest, coldest] = match known {
        Some(known) => {
            [Some(known), Some(if is_missing { known.min(ambient - tolerance) } else { known })]
        }
        // The air is what is left to compare with.
        None if !is_missing || grading.rule == Rule::Neta => [None, None],
        None => [Some(hot), Some(ambient)],
    };
    let grade = |normal, load_factor| grading.grade(&Contact { hot, normal, ambient, load_factor });
    GradeBounds {
        least: grade(hottest, load.low),
        greatest: match load.high {
            Some(high) => grade(coldest, high),
            None => Some(worst),
        },
    }
}

/// Temperatures of the air that stand for all that agree with the contacts: those at which
/// the grade may change, and one between each two.
fn possible_ambients(grading: &Grading, surroundings: &Surroundings<'_>) -> Vec<f64> {
    let Surroundings { hot, peers, load, tolerance, .. } = *surroundings;
    let believed = peers.iter().flatten().copied().filter(|of| is_believed(*of, None, tolerance));
    let all = believed.chain([hot]);
    let [low, high] = AMBIENT_RANGE;
    // No contact is much cooler than the air.
    let high = all.clone().fold(high, |high, celsius| high.min(celsius + tolerance));
    if high < low {
        return vec![low];
    }
    let factors = [Some(load.low), load.high].into_iter().flatten();
    let coolest = all.fold(hot, f64::min);
    let mut points: Vec<f64> = factors
        .flat_map(|factor| grading.ambient_breakpoints(hot, coolest, factor))
        .filter(|celsius| (low..=high).contains(celsius))
        .chain([low, high])
        .collect();
    points.sort_by(f64::total_cmp);
    let between: Vec<f64> = points.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    points.extend(between);
    points
}
