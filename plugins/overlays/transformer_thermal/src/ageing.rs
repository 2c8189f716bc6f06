//! Relative ageing rate of winding paper (IEC 60076-7:2018, 6.3 and annex A).

/// Molar gas constant, J/(mol K).
const GAS_CONSTANT: f64 = 8.314;
/// Zero of the Celsius scale as the standard's equations have it, K.
const KELVIN: f64 = 273.0;
/// Rated hot-spot temperature of normal paper, degrees Celsius.
const NORMAL_RATED: f64 = 98.0;
/// Rated hot-spot temperature of thermally upgraded paper, degrees Celsius.
const UPGRADED_RATED: f64 = 110.0;
/// Wettest paper that annex A has factors for, % of mass.
pub(crate) const MAX_MOISTURE: f64 = 3.5;
/// Moisture up to which paper counts as dry, % of mass.
const DRY: f64 = 0.5;
/// Moisture of the middle class of annex A, % of mass.
const MOIST: f64 = 1.5;

/// Environment factor A, 1/h, and activation energy, J/mol, of a reaction (annex A).
#[derive(Clone, Copy)]
struct Reaction {
    factor: f64,
    energy: f64,
}

/// Reactions of a kind of paper: without air at 0.5, 1.5 and 3.5 % of moisture, and with
/// air at 0.5 % of moisture (IEC 60076-7:2018, annex A).
struct PaperReactions {
    without_air: [Reaction; 3],
    with_air: Reaction,
}

const fn reaction(factor: f64, energy: f64) -> Reaction {
    Reaction { factor, energy }
}

static NORMAL_PAPER: PaperReactions = PaperReactions {
    without_air: [reaction(4.1e10, 128e3), reaction(1.5e11, 128e3), reaction(4.5e11, 128e3)],
    with_air: reaction(4.6e5, 89e3),
};
static UPGRADED_PAPER: PaperReactions = PaperReactions {
    without_air: [reaction(1.6e4, 86e3), reaction(3.0e4, 86e3), reaction(6.1e4, 86e3)],
    with_air: reaction(3.2e4, 82e3),
};

/// Oxygen in the oil around the paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Oxygen {
    /// Oil kept from the air, as by a membrane.
    #[default]
    Free,
    /// Oil in contact with the air, as in a breathing conservator.
    Air,
}

/// Paper of the winding, and what is known of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paper {
    pub(crate) is_upgraded: bool,
    /// Moisture, % of mass; `None` where it is not given.
    pub(crate) moisture: Option<f64>,
    pub(crate) oxygen: Option<Oxygen>,
}

impl Paper {
    /// Reports whether dry, oxygen-free paper is assumed.
    pub(crate) fn is_assumed_dry(&self) -> bool {
        self.moisture.is_none() && self.oxygen.is_none()
    }

    /// Relative ageing rate at a hot-spot temperature, degrees Celsius. Between classes of
    /// moisture the wetter one counts; with air the faster of its reactions.
    pub(crate) fn ageing_rate(&self, hot_spot: f64) -> f64 {
        if self.is_assumed_dry() {
            return dry_ageing_rate(hot_spot, self.is_upgraded);
        }
        let (reactions, rated) = match self.is_upgraded {
            true => (&UPGRADED_PAPER, UPGRADED_RATED),
            false => (&NORMAL_PAPER, NORMAL_RATED),
        };
        let class = match self.moisture.unwrap_or(DRY) {
            moisture if moisture <= DRY => 0,
            moisture if moisture <= MOIST => 1,
            _ => 2,
        };
        let [dry, ..] = reactions.without_air;
        let rate = |of: Reaction| of.relative_rate(hot_spot, dry, rated);
        let hydrolysis = rate(reactions.without_air[class]);
        match self.oxygen {
            Some(Oxygen::Air) => hydrolysis.max(rate(reactions.with_air)),
            Some(Oxygen::Free) | None => hydrolysis,
        }
    }
}

impl Reaction {
    /// Rate over that of a reference reaction at its rated temperature.
    fn relative_rate(self, hot_spot: f64, reference: Self, rated: f64) -> f64 {
        let exponent = |energy: f64, degrees: f64| energy / (GAS_CONSTANT * (degrees + KELVIN));
        let difference = exponent(reference.energy, rated) - exponent(self.energy, hot_spot);
        self.factor / reference.factor * difference.exp()
    }
}

/// Relative ageing rate of dry, oxygen-free paper (6.3, equations 2 and 3).
pub(crate) fn dry_ageing_rate(hot_spot: f64, is_upgraded: bool) -> f64 {
    if is_upgraded {
        (15_000.0 / (UPGRADED_RATED + KELVIN) - 15_000.0 / (hot_spot + KELVIN)).exp()
    } else {
        ((hot_spot - NORMAL_RATED) / 6.0).exp2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hours in which paper falls from a degree of polymerization of 1000 to 200 (annex A).
    fn life_hours(reaction: Reaction, hot_spot: f64) -> f64 {
        let broken_bonds = 1.0 / 200.0 - 1.0 / 1000.0;
        let exponent = reaction.energy / (GAS_CONSTANT * (hot_spot + KELVIN));
        broken_bonds / reaction.factor * exponent.exp()
    }

    #[test]
    fn expected_life_is_that_of_annex_a() {
        // Years for normal paper without air at 0.5 % of moisture.
        for (hot_spot, years) in [(80.0, 97.3), (90.0, 29.3)] {
            let [dry, ..] = NORMAL_PAPER.without_air;
            let ours = life_hours(dry, hot_spot) / 8760.0;
            assert!((ours - years).abs() < 0.01 * years, "{hot_spot}: {ours}");
        }
    }

    #[test]
    fn wet_paper_and_air_age_faster() {
        for is_upgraded in [false, true] {
            let rate = |moisture, oxygen| {
                let paper = Paper { is_upgraded, moisture: Some(moisture), oxygen: Some(oxygen) };
                paper.ageing_rate(if is_upgraded { 110.0 } else { 98.0 })
            };
            let [dry, moist, wet] = [0.5, 1.5, 3.5].map(|moisture| rate(moisture, Oxygen::Free));
            assert!((dry - 1.0).abs() < 1e-12);
            let [factor, wetter] = if is_upgraded { [1.875, 3.8125] } else { [3.66, 10.98] };
            assert!((moist - factor).abs() < 0.01 && (wet - wetter).abs() < 0.01, "{moist} {wet}");
            assert!(rate(0.5, Oxygen::Air) > 2.0 * dry);
            // Between classes the wetter one counts.
            assert_eq!(rate(0.6, Oxygen::Free), moist);
        }
    }
}
