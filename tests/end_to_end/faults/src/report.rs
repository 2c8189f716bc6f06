//! Results as Markdown and HTML for people, and as JSON.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use fault_injector::{CallSite, Misbehavior};
use report_writer::number_format::grouped;
use report_writer::{Block, Document, Series, machine};
use serde_json::json;

use crate::injection::Outcome;
use crate::process_boundary::BoundaryCosts;
use crate::results::Results;
use crate::scene::FRESHNESS_MILLIS;

/// Writes the report; returns its files.
pub(crate) fn write(results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = report_writer::write(&document(results), folder)?.to_vec();
    let path = folder.join("report.json");
    let value = json!({
        "machine": machine(),
        "injections": results.records.len(),
        "outcomes": results.outcomes().iter().map(|(outcome, &count)| {
            json!({ "outcome": words(outcome), "count": count })
        }).collect::<Vec<_>>(),
        "to_bad_millis": results.to_bad(),
        "to_good_millis": results.to_good(),
        "frame_gap_millis": results.gaps(),
        "load_millis": results.loads(),
        "close_millis": results.closes(),
        "bars": results.bars().iter().map(|bar| {
            json!({ "bar": bar.claim, "verdict": bar.verdict.word(), "figure": bar.figure })
        }).collect::<Vec<_>>(),
        "run": results,
    });
    fs::write(&path, serde_json::to_vec_pretty(&value)?)
        .with_context(|| format!("cannot write {}", path.display()))?;
    files.push(path);
    Ok(files)
}

fn document(results: &Results) -> Document {
    let mut document =
        Document { title: "Faults of plugins beside a live view".into(), blocks: Vec::new() };
    let (kinds, places) = (Misbehavior::ALL.len(), in_view().count());
    document.text(format!(
        "{} injections in {} rounds and {:.0} s: {kinds} kinds of fault at {places} functions of \
         the plugin ABI, in {} processes of plugins beside one view, which survived all of them. \
         Each round loads the scene, lets every fault strike once, and closes the scene; plugins \
         start again at once, calls have 1 s, values stay fresh for {FRESHNESS_MILLIS} ms. In \
         every frame a healthy plugin beside them had good values, and its process never ended. \
         Measured on {}.",
        grouped(results.records.len() as u64),
        results.rounds,
        results.seconds,
        results.processes,
        machine()
    ));
    document.heading("Bars");
    document.blocks.push(Block::Claims(results.bars()));
    document.heading("What became of the injections");
    let rows = results.outcomes().into_iter();
    let rows = rows.map(|(outcome, count)| vec![words(&outcome), grouped(count as u64)]).collect();
    document.table("Injections an outcome", &["Outcome", "Injections"], rows);
    document.table("Where and what", &HEAD, matrix(results));
    document.heading("Times");
    let times = [
        ("from the strike until a frame shows it bad", results.to_bad()),
        ("from the death until a frame has correct data", results.to_good()),
        ("between frames", results.gaps()),
        ("loading, with hangs in it", results.loads()),
        ("closing, with hangs in it", results.closes()),
    ];
    document.table("In the storm, ms", &SERIES, times.map(row).to_vec());
    document.text(
        "Deaths that were mended between two frames were never seen bad; they have no time to \
         bad.",
    );
    if let Some(border) = &results.border {
        write_border(&mut document, border);
    }
    document.heading("What this process uses");
    let ends = [results.usage.first(), results.usage.last()].into_iter().flatten();
    let rows =
        ["after the first round", "at the end"].into_iter().zip(ends).map(|(when, usage)| {
            let megabytes = format!("{:.1}", usage.resident_bytes as f64 / 1e6);
            vec![
                when.to_owned(),
                megabytes,
                usage.descriptors.to_string(),
                usage.threads.to_string(),
            ]
        });
    let head = ["", "Memory, MB", "Descriptors", "Threads"];
    document.table("", &head, rows.collect());
    document
}

fn write_border(document: &mut Document, border: &BoundaryCosts) {
    let quiet = [
        ("from SIGKILL to correct data", border.away_millis),
        ("between frames beside a storm in one plugin", border.storm_gap_millis),
    ];
    document.table("Without other load, ms", &SERIES, quiet.map(row).to_vec());
    document.text(format!(
        "The plugin of that storm died {} times while frames were timed.",
        border.storm_deaths
    ));
    document.heading("What the border costs");
    let rows = border.modes.iter().map(|mode| {
        let trip = mode.round_trip_millis;
        let millis = [trip.p50, trip.p99, trip.longest].map(|value| format!("{value:.4}"));
        let samples = format!("{:.2} million", mode.samples_per_second / 1e6);
        [vec![mode.isolation.to_owned()], millis.to_vec(), vec![samples]].concat()
    });
    let head = ["Isolation", "Call p50, ms", "p99", "longest", "Samples a second"];
    document.table("A call with 14 lines; samples that reach the tags", &head, rows.collect());
}

const SERIES: [&str; 5] = ["", "Count", "p50", "p99", "longest"];

fn row((what, series): (&str, Series)) -> Vec<String> {
    let millis = [series.p50, series.p99, series.longest].map(|value| format!("{value:.1}"));
    [vec![what.to_owned(), grouped(series.count as u64)], millis.to_vec()].concat()
}

fn words(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Died(how) => how.clone(),
        Outcome::Bad => "shown as bad".into(),
        Outcome::Refused => "its result was refused".into(),
        Outcome::Harmless => "no harm".into(),
        Outcome::Closed => "the scene closed all the same".into(),
    }
}

const HEAD: [&str; 7] =
    ["Function", "Injections", "Died", "Shown as bad", "Refused", "No harm", "Closed"];

/// Counts injections by function and outcome.
fn matrix(results: &Results) -> Vec<Vec<String>> {
    let row = |&at: &CallSite| {
        let records: Vec<_> = results.records.iter().filter(|record| record.at == at).collect();
        let count = |is: fn(&Outcome) -> bool| {
            grouped(records.iter().filter(|record| is(&record.outcome)).count() as u64)
        };
        vec![
            format!("{at:?}"),
            grouped(records.len() as u64),
            count(|outcome| matches!(outcome, Outcome::Died(_))),
            count(|outcome| *outcome == Outcome::Bad),
            count(|outcome| *outcome == Outcome::Refused),
            count(|outcome| *outcome == Outcome::Harmless),
            count(|outcome| *outcome == Outcome::Closed),
        ]
    };
    in_view().map(row).collect()
}

/// Iterates over the plugin functions that a view calls.
fn in_view() -> impl Iterator<Item = &'static CallSite> {
    CallSite::ALL.iter().filter(|at| at.is_in_view())
}
