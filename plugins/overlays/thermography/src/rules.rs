//! Rules that grade a contact of which all is known: DL/T 664-2016 and ANSI/NETA MTS.

/// Differences at which a defect is general, serious and critical, % of the rise over the
/// air (DL/T 664-2016, annex G, table G.1).
const DIFFERENCES: [f64; 3] = [35.0, 80.0, 95.0];
/// Rounding of temperatures that are sums and differences, K.
const ROUNDING: f64 = 1e-9;
/// Temperature differences of similar components at which each grade begins, K, in whole
/// kelvins (ANSI/NETA MTS-2019, table 100.18); the third grade has none.
const NETA_SIMILAR: [f64; 4] = [1.0, 4.0, f64::INFINITY, 16.0];
/// The same over the air.
const NETA_AIR: [f64; 4] = [1.0, 11.0, 21.0, NETA_WORST_RISE];
/// Rise over the air from which on the last grade holds, K.
pub(crate) const NETA_WORST_RISE: f64 = 41.0;

/// Rule that contacts are graded by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
pub enum Rule {
    /// DL/T 664-2016, annex G: defects of devices that heat by current.
    #[default]
    #[serde(rename = "dl_t_664")]
    DlT664,
    /// ANSI/NETA MTS-2019 and -2023, table 100.18: by similar components, and over the air
    /// where none can be compared; its last grade over the air holds in any case.
    #[serde(rename = "neta")]
    Neta,
}

/// Part that is measured, by which DL/T 664-2016, table G.1, sets limits of temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Joint or clamp between metal parts, disconnector blade: serious above 90 °C, critical
    /// above 130 °C.
    #[default]
    Clamp,
    /// Joint or clamp between a device and metal parts: 80 °C and 110 °C.
    Terminal,
    /// Contact inside of a breaker, connection inside of an instrument transformer, head of
    /// a bushing: 55 °C and 80 °C, measured outside.
    Internal,
}

impl Part {
    /// Temperatures above which a defect is serious and critical, °C.
    fn limits(self) -> [f64; 2] {
        match self {
            Self::Clamp => [90.0, 130.0],
            Self::Terminal => [80.0, 110.0],
            Self::Internal => [55.0, 80.0],
        }
    }
}

impl Rule {
    /// Names of the grades, the least first.
    pub fn grades(self) -> &'static [&'static str] {
        match self {
            Self::DlT664 => &["general defect", "serious defect", "critical defect"],
            Self::Neta => &[
                "possible deficiency",
                "probable deficiency",
                "deficiency to monitor",
                "major discrepancy",
            ],
        }
    }
}

/// Rule with its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grading {
    /// Rule that grades a rise.
    pub rule: Rule,
    /// Part that is measured.
    pub part: Part,
    /// Rise over the air below which differences are no ground to judge, K.
    pub least_rise: f64,
    /// Rise over the air above which a contact without peers has a defect, K.
    pub greatest_rise: f64,
}

/// Contact of which all is known, °C.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Temperature of the contact.
    pub hot: f64,
    /// Temperature of the coolest of its like; `None` where it has none.
    pub normal: Option<f64>,
    /// Temperature of the air.
    pub ambient: f64,
    /// Factor by which rises are corrected to the rated load.
    pub load_factor: f64,
}

impl Contact {
    /// Temperature that it would have at the rated load.
    pub fn corrected(&self) -> f64 {
        self.ambient + self.load_factor * (self.hot - self.ambient)
    }

    /// Relative temperature difference, % (DL/T 664-2016, 3.6): of the difference from the
    /// coolest to the rise over the air.
    pub fn difference(&self) -> Option<f64> {
        let rise = self.hot - self.ambient;
        let normal = self.normal?.max(self.ambient);
        (rise > 0.0).then(|| (self.hot - normal) / rise * 100.0)
    }
}

impl Grading {
    /// Grade of a contact by its place in [`Rule::grades`]; `None` where all is well.
    pub fn grade(&self, contact: &Contact) -> Option<usize> {
        match self.rule {
            Rule::DlT664 => self.dl_t_664(contact),
            Rule::Neta => neta(contact),
        }
    }

    fn dl_t_664(&self, contact: &Contact) -> Option<usize> {
        let hot = contact.corrected();
        let rise = hot - contact.ambient;
        let [serious, critical] = self.part.limits();
        let by_heat = match hot {
            hot if hot > critical + ROUNDING => Some(2),
            hot if hot > serious + ROUNDING => Some(1),
            _ => None,
        };
        let can_compare = rise >= self.least_rise - ROUNDING;
        let difference = contact.difference().filter(|_| can_compare);
        let reached = |place: usize| {
            difference.is_some_and(|difference| difference >= DIFFERENCES[place] - ROUNDING)
        };
        // The ratio alone makes nothing critical: the contact must be hot as well.
        let by_difference = match hot {
            hot if reached(2) && hot > serious + ROUNDING => Some(2),
            _ if reached(1) => Some(1),
            _ if reached(0) => Some(0),
            _ => None,
        };
        let is_alone = contact.normal.is_none();
        let by_rise = (is_alone && rise > self.greatest_rise + ROUNDING).then_some(0);
        by_heat.max(by_difference).max(by_rise)
    }

    /// Temperatures of the air, °C, at which the grade of a contact may change, given its
    /// own, that of the coolest, and a load factor.
    pub(crate) fn ambient_breakpoints(&self, hot: f64, coolest: f64, factor: f64) -> Vec<f64> {
        let rises = [self.least_rise, self.greatest_rise]
            .into_iter()
            .chain(NETA_AIR.iter().chain(&NETA_SIMILAR).map(|rise| rise - 0.5))
            .map(|rise| hot - rise / factor);
        let shares = DIFFERENCES.iter().map(|share| hot - (hot - coolest) / (share / 100.0));
        let limits = self.part.limits();
        let heats = limits.iter().map(|limit| (factor * hot - limit) / (factor - 1.0));
        rises.chain(shares).chain(heats).chain([coolest]).filter(|of| of.is_finite()).collect()
    }
}

fn neta(contact: &Contact) -> Option<usize> {
    let corrected = |other: f64| (contact.load_factor * (contact.hot - other) + ROUNDING).round();
    let grade =
        |rise: f64, limits: [f64; 4]| (0..limits.len()).rev().find(|place| rise >= limits[*place]);
    let by_air = grade(corrected(contact.ambient), NETA_AIR);
    match contact.normal {
        // Phases that are all far too hot differ by nothing.
        Some(normal) => {
            let worst = by_air.filter(|grade| *grade == NETA_AIR.len() - 1);
            grade(corrected(normal), NETA_SIMILAR).max(worst)
        }
        None => by_air,
    }
}

#[cfg(test)]
#[path = "rules_tests.rs"]
mod tests;
