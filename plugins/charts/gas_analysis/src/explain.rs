//! Explanation of a sample in words, tables and diagrams.

use busbar_plugin_sdk::{
    Diagram, DiagramZone, Evidence, ExplainedRow, ExplainedTable, Explanation, Severity,
};
use dga::c57_104::{self, GASES, Status};
use dga::pentagon::{self, PENTAGON_1, PENTAGON_2, Pentagon};
use dga::{Sample, Zone, triangle_1};

use crate::history::Trend;
use crate::judged::{Judged, Judging};
use crate::settings::Settings;
use crate::verdict::{Family, Judgement, words};

/// Samples before this one that diagrams show.
pub(crate) const MAX_TRAIL: usize = 24;

/// Explains a sample by those of its transformer before it.
pub(crate) fn explain(last: &Judged, before: &[&Judged], settings: &Settings) -> Explanation {
    let Judging { judgement, trend } = last.again(before, settings);
    let told = Explanation {
        unix_nanos: last.unix_nanos,
        state: last.state,
        tables: vec![gases(last, &trend, settings)],
        ..Explanation::default()
    };
    if let Some(doubt) = &last.doubt {
        let verdict = format!("N{} at that time.", &doubt[1..]);
        return Explanation { verdict, ..told };
    }
    Explanation {
        verdict: verdict(last, &judgement),
        evidence: evidence(&judgement),
        diagrams: diagrams(last, before),
        ..told
    }
}

fn verdict(last: &Judged, judgement: &Judgement) -> String {
    let status = match last.status {
        None => "Without O2 and N2 there is no status by IEEE C57.104-2019.".to_owned(),
        Some(status) => format!("Status {status} by IEEE C57.104-2019."),
    };
    let named = judgement.zone.zip(judgement.family);
    let agreeing = |family| {
        let agrees = |zone: &Zone| Family::for_zone(*zone).contains(&family);
        judgement.opinions.iter().filter(|opinion| opinion.zones.iter().any(agrees)).count()
    };
    match (last.status, named) {
        (Some(Status::One), _) => {
            format!("{status} Gases are typical: ratios of so little gas mean nothing.")
        }
        (_, None) => format!("{status} No method names a fault."),
        (_, Some((zone, family))) => {
            let (words, agreeing) = (words(zone), agreeing(family));
            let all = judgement.opinions.len();
            format!("{status} Most likely {words}: {agreeing} of {all} methods name this kind.")
        }
    }
}

fn evidence(judgement: &Judgement) -> Vec<Evidence> {
    let opinion = |opinion: &crate::verdict::Opinion| {
        let families: Vec<Family> =
            opinion.zones.iter().flat_map(|zone| Family::for_zone(*zone)).copied().collect();
        let names: Vec<&str> = opinion.zones.iter().map(|zone| zone.name()).collect();
        Evidence {
            method: opinion.method.into(),
            result: if names.is_empty() { "ND".into() } else { names.join(" or ") },
            reason: opinion.rule.into(),
            agrees: judgement
                .family
                .filter(|_| !families.is_empty())
                .map(|family| families.contains(&family)),
        }
    };
    judgement.opinions.iter().map(opinion).collect()
}

/// Each gas against its limits, with its rate.
fn gases(last: &Judged, trend: &Trend, settings: &Settings) -> ExplainedTable {
    let limits = c57_104::limits(&last.sample, settings.age.into());
    let rows = GASES.into_iter().zip(limits).zip(trend.rates).filter_map(
        |((gas, [typical, high]), rate)| {
            let measured = last.sample.concentration(gas)?;
            let ppm = measured.ppm();
            let shown = match measured.detection_limit() {
                Some(limit) => format!("< {limit}"),
                None => number(ppm),
            };
            let severity = match ppm {
                ppm if ppm > high => Severity::Alarm,
                ppm if ppm > typical => Severity::Warning,
                _ => Severity::Normal,
            };
            let rate = rate.map_or("–".to_owned(), |rate| format!("{rate:+.1}"));
            let cells = vec![gas.formula().into(), shown, number(typical), number(high), rate];
            Some(ExplainedRow { cells, severity })
        },
    );
    ExplainedTable {
        title: "Gases against IEEE C57.104-2019".into(),
        columns: ["gas", "ppm", "90 % (table 1)", "95 % (table 2)", "ppm a year"]
            .map(String::from)
            .to_vec(),
        rows: rows.collect(),
    }
}

fn number(ppm: f64) -> String {
    if ppm >= 10.0 { format!("{ppm:.0}") } else { format!("{ppm:.1}") }
}

fn diagrams(last: &Judged, before: &[&Judged]) -> Vec<Diagram> {
    let samples: Vec<&Sample> = before[before.len().saturating_sub(MAX_TRAIL)..]
        .iter()
        .chain([&last])
        .filter(|judged| judged.doubt.is_none())
        .map(|judged| &judged.sample)
        .collect();
    let trail = |place: fn(&Sample) -> Option<[f64; 2]>| -> Vec<[f32; 2]> {
        // One that has no place leaves a gap that a line must not hide: the trail begins anew.
        let mut trail = Vec::new();
        for sample in &samples {
            match place(sample) {
                Some(place) => trail.push(place.map(|part| part as f32)),
                None => trail.clear(),
            }
        }
        trail
    };
    let triangle = Diagram {
        title: "Duval triangle 1".into(),
        zones: zones(triangle_1::outlines(), triangle_1::zone(&last.sample)),
        marks: vec![
            ("CH4".into(), [0.0, -3.0]),
            ("C2H4".into(), [100.0, -3.0]),
            ("C2H2".into(), [50.0, 88.0]),
        ],
        trail: trail(triangle_1::point),
    };
    let pentagon = |title: &str, pentagon: &Pentagon| Diagram {
        title: title.into(),
        zones: zones(
            pentagon.outlines().map(|(zone, outline)| (zone, outline.to_vec())),
            pentagon.zone(&last.sample),
        ),
        marks: vec![
            ("H2".into(), [0.0, 41.0]),
            ("C2H6".into(), [-36.0, 14.0]),
            ("CH4".into(), [-23.5, -34.0]),
            ("C2H4".into(), [23.5, -34.0]),
            ("C2H2".into(), [36.0, 14.0]),
        ],
        trail: trail(pentagon::point),
    };
    vec![
        triangle,
        pentagon("Duval pentagon 1", &PENTAGON_1),
        pentagon("Duval pentagon 2", &PENTAGON_2),
    ]
}

fn zones(outlines: impl Iterator<Item = (Zone, Vec<[f64; 2]>)>, hit: Zone) -> Vec<DiagramZone> {
    outlines
        .map(|(zone, outline)| DiagramZone {
            name: zone.name().into(),
            outline: outline.into_iter().map(|place| place.map(|part| part as f32)).collect(),
            is_hit: zone == hit,
        })
        .collect()
}
