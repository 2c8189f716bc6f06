//! Verdict of several methods on one sample.

use dga::c57_104::Status;
use dga::pentagon::{PENTAGON_1, PENTAGON_2};
use dga::{Sample, Verdict, Zone, dlt722, doernenburg, iec60599, key_gas, rogers, triangle_1};

use crate::settings::Settings;

/// Kinds of faults that all methods tell apart (IEC 60599:2015, 5.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Family {
    PartialDischarge,
    Discharge,
    Thermal,
}

impl Family {
    const ALL: [Self; 3] = [Self::PartialDischarge, Self::Discharge, Self::Thermal];

    /// The families of a zone; none for what names no fault.
    pub(crate) fn for_zone(zone: Zone) -> &'static [Self] {
        match zone {
            Zone::PartialDischarge => &[Self::PartialDischarge],
            Zone::Discharge | Zone::LowEnergy | Zone::HighEnergy => &[Self::Discharge],
            Zone::LowEnergyThermal | Zone::HighEnergyThermal | Zone::DischargeThermal => {
                &[Self::Discharge, Self::Thermal]
            }
            Zone::Thermal
            | Zone::Thermal0
            | Zone::Thermal1
            | Zone::Thermal2
            | Zone::Thermal3
            | Zone::Thermal3Oil
            | Zone::Carbonisation
            | Zone::Overheating => &[Self::Thermal],
            // Stray gassing is no fault (Duval & Lamarre 2014).
            Zone::StrayGassing
            | Zone::Normal
            | Zone::NoFault
            | Zone::NotDetermined
            | Zone::NotApplicable => &[],
        }
    }
}

/// Opinion of a method: its name, its results (several where zones overlap) and its rule.
pub(crate) struct Opinion {
    pub(crate) method: &'static str,
    pub(crate) zones: Vec<Zone>,
    pub(crate) rule: &'static str,
}

/// Judgement of all methods together.
pub(crate) struct Judgement {
    pub(crate) opinions: Vec<Opinion>,
    /// The family that most methods name; of two that as many name, that of triangle 1.
    pub(crate) family: Option<Family>,
    /// The zone within it that most methods name; likewise.
    pub(crate) zone: Option<Zone>,
}

/// Judges a sample by all methods.
pub(crate) fn judge(sample: &Sample, settings: &Settings) -> Judgement {
    let one = |method, verdict: Verdict| Opinion {
        method,
        zones: vec![verdict.zone],
        rule: verdict.rule,
    };
    let iec = iec60599::diagnose(sample, settings.equipment.into());
    let opinions = vec![
        one("Duval triangle 1", triangle_1::diagnose(sample)),
        one("Duval pentagon 1", PENTAGON_1.diagnose(sample)),
        one("Duval pentagon 2", PENTAGON_2.diagnose(sample)),
        Opinion {
            method: "IEC 60599 ratios",
            zones: iec.iter().map(|verdict| verdict.zone).collect(),
            rule: iec.first().map_or("", |verdict| verdict.rule),
        },
        one("Rogers ratios", rogers::diagnose(sample)),
        one("Doernenburg ratios", doernenburg::diagnose(sample)),
        one("DL/T 722 ratios", dlt722::diagnose(sample)),
        one("Key gas", key_gas::diagnose(sample)),
    ];
    let family = most(&Family::ALL, &opinions, |opinion, family| {
        opinion.zones.iter().any(|zone| Family::for_zone(*zone).contains(&family))
    });
    let is_of =
        |zone: &Zone| family.is_some_and(|family| Family::for_zone(*zone).contains(&family));
    let of_family: Vec<Zone> = Zone::ALL.into_iter().filter(is_of).collect();
    let zone = most(&of_family, &opinions, |opinion, zone| opinion.zones.contains(&zone));
    Judgement { opinions, family, zone }
}

/// Finds the result that most opinions name; of those that as many name, that of an earlier one.
fn most<T: Copy>(
    all: &[T],
    opinions: &[Opinion],
    names: impl Fn(&Opinion, T) -> bool,
) -> Option<T> {
    let count = |one: T| opinions.iter().filter(|opinion| names(opinion, one)).count();
    let first = |one: T| opinions.iter().position(|opinion| names(opinion, one));
    let best = all.iter().copied().max_by_key(|one| (count(*one), std::cmp::Reverse(first(*one))));
    best.filter(|one| count(*one) > 0)
}

/// States of the legend, by their indices.
pub(crate) const NORMAL: u32 = 0;
/// Urgency of a sample that is not judged: between those that are well and those that are not.
pub(crate) const NOT_JUDGED: u32 = 1;
pub(crate) const WATCH: u32 = 2;
pub(crate) const THERMAL: u32 = 3;
pub(crate) const DISCHARGE: u32 = 4;

/// The state that a status and a judgement come to: faults are named from status 3 on, and
/// what no method names is taken for the worse.
pub(crate) fn state(status: Option<Status>, judgement: &Judgement) -> u32 {
    match (status, judgement.family) {
        (Some(Status::Three), Some(Family::Thermal)) => THERMAL,
        (Some(Status::Three), _) => DISCHARGE,
        (Some(Status::Two), _) => WATCH,
        (Some(Status::One), _) => NORMAL,
        // Without O2 and N2 the tables have no row: whatever is found is to be watched.
        (None, Some(_)) => WATCH,
        (None, None) => NORMAL,
    }
}

/// Sums up a status and a judgement in a few words. Of little gas ratios say nothing.
pub(crate) fn in_short(status: Option<Status>, judgement: &Judgement) -> String {
    match (status, judgement.zone) {
        (Some(Status::One), _) => "status 1".into(),
        (Some(status), Some(zone)) => format!("status {status}, {}", words(zone)),
        (Some(status), None) => format!("status {status}"),
        (None, Some(zone)) => words(zone).into(),
        (None, None) => "no fault named".into(),
    }
}

/// Returns the name of a zone in a sentence.
pub(crate) fn words(zone: Zone) -> &'static str {
    match zone {
        Zone::PartialDischarge => "partial discharges of corona type (PD)",
        Zone::Discharge => "discharges (D)",
        Zone::LowEnergy => "discharges of low energy (D1)",
        Zone::LowEnergyThermal => "discharges of low energy and overheating (D1T)",
        Zone::HighEnergy => "discharges of high energy (D2)",
        Zone::HighEnergyThermal => "discharges of high energy and overheating (D2T)",
        Zone::DischargeThermal => "discharges and overheating (DT)",
        Zone::Thermal => "overheating (T)",
        Zone::Thermal0 => "overheating below 150 °C (T0)",
        Zone::Thermal1 => "overheating below 300 °C (T1)",
        Zone::Thermal2 => "overheating from 300 to 700 °C (T2)",
        Zone::Thermal3 => "overheating above 700 °C (T3)",
        Zone::Thermal3Oil => "overheating above 700 °C in oil alone (T3H)",
        Zone::Carbonisation => "overheating that may carbonise paper (C)",
        Zone::Overheating => "overheating of oil below 250 °C (O)",
        Zone::StrayGassing => "stray gassing of oil (S)",
        Zone::Normal | Zone::NoFault | Zone::NotDetermined | Zone::NotApplicable => {
            "no fault named"
        }
    }
}
