//! Judgment on the contacts of a device: readings, bounds of the grade, and words.

use busbar_plugin_sdk::{TagValue, Verdict, VerdictSeverity};

use crate::bounds::{
    AMBIENT_RANGE, Ambient, CONTACT_RANGE, GradeBounds, LoadFactors, Surroundings, Temperature,
    bounds, coolest, is_believed,
};
use crate::contacts::{BoundContact, Input};
use crate::rules::{Contact, NETA_WORST_RISE, Rule};
use crate::settings::Settings;

/// Share of the rated current below which no correction is sound (ANSI/NETA MTS-2019, 9:
/// surveys at 40 % of the load at least).
const LEAST_LOAD: f64 = 0.4;
/// Missing inputs that a reason names.
const MAX_NAMED: usize = 3;

/// Judgment on a contact.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ContactJudgment {
    pub(crate) verdict: Verdict,
    /// Severity of an abnormal verdict.
    pub(crate) severity: VerdictSeverity,
    /// Grade that it has at least, by its place in the legend.
    pub(crate) grade: Option<usize>,
    pub(crate) reason: String,
    /// Value of the label.
    pub(crate) text: String,
    pub(crate) assumption: String,
    /// Bindings that the verdict rests on.
    pub(crate) rests_on: Vec<usize>,
}

impl ContactJudgment {
    fn unknown(reason: String) -> Self {
        Self {
            verdict: Verdict::Unknown,
            severity: VerdictSeverity::default(),
            grade: None,
            reason,
            text: String::new(),
            assumption: String::new(),
            rests_on: Vec::new(),
        }
    }
}

/// Reading of an input, with the reason for which it is not known.
#[derive(Clone, Debug, PartialEq)]
struct Reading {
    value: Option<f64>,
    doubt: Option<String>,
}

impl Reading {
    fn new(input: &Input, values: &[TagValue], [low, high]: [f64; 2]) -> Self {
        let doubt = |words: String| Self { value: None, doubt: Some(words) };
        let Some(conversion) = input.conversion else {
            return doubt(format!("{} has no unit of use", input.tag_id));
        };
        let Some(number) = values.get(input.binding).and_then(TagValue::good_number) else {
            return doubt(format!("{} has no good value", input.tag_id));
        };
        match conversion.apply(number) {
            value if (low..=high).contains(&value) => Self { value: Some(value), doubt: None },
            value => doubt(format!("{} is implausible: {value:.0}", input.tag_id)),
        }
    }
}

/// Judges the contacts of a device, in their order.
pub(crate) fn judge_device(
    settings: &Settings,
    device: &[BoundContact],
    values: &[TagValue],
) -> Vec<ContactJudgment> {
    let read = |contact: &BoundContact| match &contact.temperature {
        Some(input) => Reading::new(input, values, CONTACT_RANGE),
        None => Reading { value: None, doubt: Some("no tag has its temperature".into()) },
    };
    let readings: Vec<Reading> = device.iter().map(read).collect();
    let judge =
        |place: usize| DeviceView { settings, device, readings: &readings, values }.judge(place);
    (0..device.len()).map(judge).collect()
}

/// Contacts of a device with their readings.
struct DeviceView<'d> {
    settings: &'d Settings,
    device: &'d [BoundContact],
    readings: &'d [Reading],
    values: &'d [TagValue],
}

impl DeviceView<'_> {
    fn judge(&self, place: usize) -> ContactJudgment {
        let contact = &self.device[place];
        if contact.is_untelemetered {
            return ContactJudgment::unknown("declared untelemetered in the settings".into());
        }
        let Reading { value, doubt } = &self.readings[place];
        let Some(hot) = *value else {
            return ContactJudgment::unknown(doubt.clone().unwrap_or_default());
        };
        let airs: Vec<Reading> = contact
            .ambients
            .iter()
            .map(|input| Reading::new(input, self.values, AMBIENT_RANGE))
            .collect();
        let ambients: Vec<Ambient> = match airs.as_slice() {
            [] => vec![Ambient::Missing],
            airs => {
                airs.iter().map(|air| air.value.map_or(Ambient::Missing, Ambient::Known)).collect()
            }
        };
        let air = match ambients.as_slice() {
            [Ambient::Known(air)] => Some(*air),
            _ => None,
        };
        let tolerance = self.settings.ambient_tolerance;
        if !is_believed(hot, air, tolerance) {
            let air = air.unwrap_or_default();
            return ContactJudgment::unknown(format!(
                "implausible: {hot:.0} °C is below the air of {air:.0} °C"
            ));
        }
        let peers: Vec<Temperature> = self.peers(place).map(|(_, of)| of.value).collect();
        let (load, load_doubt) = self.load(contact);
        let surroundings =
            Surroundings { hot, peers: &peers, ambients: &ambients, load, tolerance };
        let grading = self.settings.grading();
        let found = bounds(&grading, &surroundings);
        let mut doubts: Vec<String> = self
            .peers(place)
            .filter_map(|(_, of)| match (of.value, air) {
                (None, _) => of.doubt.clone(),
                (Some(peer), Some(air)) if !is_believed(peer, Some(air), tolerance) => {
                    Some(format!("a peer of {peer:.0} °C is below the air and left out"))
                }
                _ => None,
            })
            .chain(airs.iter().filter_map(|air| air.doubt.clone()))
            .chain(airs.is_empty().then(|| "the air is not known".to_owned()))
            .chain((air.is_none() && airs.len() > 1).then(|| "several airs are as near".to_owned()))
            .chain(load_doubt)
            .collect();
        doubts.truncate(MAX_NAMED);
        let verdict = match found {
            GradeBounds { least: Some(_), .. } => Verdict::Abnormal,
            GradeBounds { greatest: None, .. } => Verdict::Normal,
            _ => Verdict::Unknown,
        };
        if verdict == Verdict::Unknown {
            let known = coolest(&surroundings, air)
                .map_or_else(String::new, |coolest| format!(", {coolest:.0} °C the coolest known"));
            let doubts = match doubts.is_empty() {
                true => "the inputs do not decide".into(),
                false => doubts.join(", "),
            };
            return ContactJudgment::unknown(format!("{hot:.0} °C{known}; {doubts}"));
        }
        let (reason, text) = self.words(&surroundings, found, air, &doubts);
        let worst = self.settings.rule.grades().len().checked_sub(1);
        ContactJudgment {
            verdict,
            severity: VerdictSeverity::from_bounds(found.least == worst, found.greatest == worst),
            grade: found.least,
            reason: if verdict == Verdict::Abnormal { reason } else { String::new() },
            text,
            assumption: self.assumption(contact, &peers),
            rests_on: self.rests_on(place, &surroundings, found),
        }
    }

    /// Other contacts of the device that have a sensor, or should have one.
    fn peers(&self, place: usize) -> impl Iterator<Item = (&BoundContact, &Reading)> {
        let all = self.device.iter().zip(self.readings).enumerate();
        all.filter(move |(other, (contact, _))| *other != place && !contact.is_untelemetered)
            .map(|(_, peer)| peer)
    }

    /// Factors to the rated load, with the reason for which they are not known.
    fn load(&self, contact: &BoundContact) -> (LoadFactors, Option<String>) {
        let Some(rated) = self.settings.rated_current else {
            return (LoadFactors::UNCORRECTED, None);
        };
        let unknown = |doubt: String| (LoadFactors::UNKNOWN, Some(doubt));
        if contact.loads.is_empty() {
            return unknown("the load is not known".into());
        }
        let range = [f64::MIN, f64::MAX];
        let readings = contact.loads.iter().map(|input| Reading::new(input, self.values, range));
        let mut least = f64::INFINITY;
        for reading in readings {
            match reading {
                Reading { value: Some(current), .. } => least = least.min(current.abs() / rated),
                Reading { doubt, .. } => return unknown(doubt.unwrap_or_default()),
            }
        }
        if least < LEAST_LOAD {
            let share = 100.0 * least;
            return unknown(format!("a load of {share:.0} % is too small to judge by"));
        }
        // More than the rated load excuses nothing.
        let factor = least.powf(-self.settings.load_exponent).max(1.0);
        (LoadFactors { low: factor, high: Some(factor) }, None)
    }

    fn assumption(&self, contact: &BoundContact, peers: &[Temperature]) -> String {
        let mut assumption = contact.assumption.clone();
        if peers.is_empty() {
            let separator = if assumption.is_empty() { "" } else { ", " };
            assumption += separator;
            assumption += match self.settings.rule {
                Rule::DlT664 => "no other phase, judged by heat and rise over the air",
                Rule::Neta => "no similar component, judged by the rise over the air",
            };
        }
        assumption
    }

    /// Reason and label of a contact with a defect.
    fn words(
        &self,
        surroundings: &Surroundings<'_>,
        found: GradeBounds,
        air: Option<f64>,
        doubts: &[String],
    ) -> (String, String) {
        let Surroundings { hot, load, .. } = *surroundings;
        let mut text = format!("{hot:.0} °C");
        let normal = coolest(surroundings, air);
        if let Some(ambient) = air {
            let contact = Contact { hot, normal, ambient, load_factor: load.low };
            match (self.settings.rule, contact.difference(), normal) {
                (Rule::DlT664, Some(difference), _)
                    if contact.corrected() - ambient >= self.settings.least_rise =>
                {
                    text += &format!(", difference {difference:.0} %");
                }
                (Rule::Neta, _, Some(normal)) => {
                    text += &format!(", {:.0} K above its like", load.low * (hot - normal));
                    let rise = load.low * (hot - ambient);
                    if rise.round() >= NETA_WORST_RISE {
                        text += &format!(", {rise:.0} K above the air");
                    }
                }
                _ => {
                    text += &format!(", {:.0} K above the air", load.low * (hot - ambient));
                }
            }
            if load.low > 1.0 {
                text += &format!(", {:.0} °C at the rated load", contact.corrected());
            }
        }
        let grades = self.settings.rule.grades();
        let grade = found.least.and_then(|grade| grades.get(grade)).copied().unwrap_or_default();
        let at_least = if found.least == found.greatest { "" } else { "at least " };
        let doubts = match doubts.is_empty() {
            true => String::new(),
            false => format!("; {}", doubts.join(", ")),
        };
        (format!("{at_least}{grade}: {text}{doubts}"), text)
    }

    /// Fewest bindings with which the verdict stays: the contact alone, with the air, or all.
    fn rests_on(
        &self,
        place: usize,
        surroundings: &Surroundings<'_>,
        found: GradeBounds,
    ) -> Vec<usize> {
        let contact = &self.device[place];
        let grading = self.settings.grading();
        let nothing: Vec<Temperature> = vec![None; surroundings.peers.len()];
        let is_abnormal = found.least.is_some();
        let stays = |of: &Surroundings<'_>| {
            let without = bounds(&grading, of);
            match is_abnormal {
                true => without.least == found.least,
                false => without.greatest.is_none(),
            }
        };
        let own = contact.temperature.iter();
        let airs = contact.ambients.iter();
        let is_corrected = surroundings.load.high.is_some();
        let loads = contact.loads.iter().filter(|_| is_corrected);
        let of_peers = self
            .peers(place)
            .filter(|(_, reading)| reading.value.is_some())
            .filter_map(|(peer, _)| peer.temperature.as_ref());
        let is_good = |input: &&Input| {
            self.values.get(input.binding).is_some_and(|value| value.good_number().is_some())
        };
        let with_air = Surroundings { peers: &nothing, ..surroundings.clone() };
        let alone = Surroundings {
            ambients: &[Ambient::Missing],
            load: if self.settings.rated_current.is_some() {
                LoadFactors::UNKNOWN
            } else {
                LoadFactors::UNCORRECTED
            },
            ..with_air.clone()
        };
        // Health always takes the air, so it is not tried without.
        let inputs: Vec<&Input> = if is_abnormal && stays(&alone) {
            own.collect()
        } else if stays(&with_air) {
            own.chain(airs).chain(loads).filter(is_good).collect()
        } else {
            own.chain(airs).chain(loads).chain(of_peers).filter(is_good).collect()
        };
        inputs.iter().map(|input| input.binding).collect()
    }
}
