//! Results as Markdown and HTML for people, and as JSON.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use report_writer::number_format::grouped;
use report_writer::{Block, Claim, Document, Series, Verdict, machine};
use serde_json::json;

use crate::requests::{POINTS, REGISTERS, Rates, Requests};
use crate::sustained::{UPDATES_PER_SECOND, median};
use crate::{Results, avalanche, drain};

/// Longest time for draining [`drain::TAGS`] updates, milliseconds.
const MAX_DRAIN_MILLIS: f64 = 1.0;
/// Greatest ratio of the 99th percentile of frame times beside sustained updates to that without.
const MAX_P99_RATIO: f64 = 1.1;
/// Lowest share of the requested updates a second that must arrive; the rest is the clock's.
const MIN_SHARE: f64 = 0.98;
/// Longest time between frames in an avalanche, milliseconds.
const MAX_GAP_MILLIS: f64 = 100.0;

/// Longest time of a general interrogation of [`POINTS`], milliseconds.
const MAX_INTERROGATION_MILLIS: f64 = 250.0;

const RATES_HEAD: [&str; 4] = ["", "plugin", "peer", "ratio"];
const HEAD: [&str; 5] = ["", "median", "99th percentile", "longest", "count"];

/// Writes the report; returns its files.
pub(crate) fn write(results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = report_writer::write(&document(results), folder)?.to_vec();
    let path = folder.join("report.json");
    let bars = bars(results);
    let value = json!({
        "machine": machine(),
        "results": results,
        "bars": bars.iter().map(|bar| {
            json!({ "bar": bar.claim, "verdict": bar.verdict.word(), "figure": bar.figure })
        }).collect::<Vec<_>>(),
    });
    fs::write(&path, serde_json::to_vec_pretty(&value)?)
        .with_context(|| format!("cannot write {}", path.display()))?;
    files.push(path);
    Ok(files)
}

/// Judges the bars of this project.
pub(crate) fn bars(results: &Results) -> Vec<Claim> {
    let Results { drain, sustained, avalanche, .. } = results;
    let [quiet, busy] = sustained.p99();
    let bar =
        |claim: String, reached, figure| Claim { claim, verdict: Verdict::of_bar(reached), figure };
    let mut bars = vec![
        bar(
            format!(
                "{} updates drained in at most {MAX_DRAIN_MILLIS} ms",
                grouped(u64::from(drain::TAGS))
            ),
            drain.millis.p50 <= MAX_DRAIN_MILLIS,
            format!("{:.3} ms", drain.millis.p50),
        ),
        bar(
            format!("{} updates a second reach the table", grouped(UPDATES_PER_SECOND)),
            sustained.slowest() >= MIN_SHARE * UPDATES_PER_SECOND as f64 && sustained.lost == 0,
            format!("{:.0} at least, {} lost", sustained.slowest(), sustained.lost),
        ),
        bar(
            format!("beside them, p99 of frames at most {MAX_P99_RATIO} times that without"),
            busy <= MAX_P99_RATIO * quiet,
            format!("{busy:.1} ms against {quiet:.1} ms, {:.2} times", busy / quiet),
        ),
        bar(
            format!(
                "an avalanche of {} changes in a second: none lost, order kept",
                grouped(avalanche::SWITCHES)
            ),
            avalanche.noted == avalanche.made && avalanche.in_order,
            format!(
                "{} of {} noted in {:.2} s, {}",
                avalanche.noted,
                avalanche.made,
                avalanche.seconds,
                if avalanche.in_order { "in order" } else { "out of order" }
            ),
        ),
        bar(
            format!("no gap between its frames over {MAX_GAP_MILLIS} ms"),
            avalanche.gap_millis.longest <= MAX_GAP_MILLIS,
            format!("{:.1} ms", avalanche.gap_millis.longest),
        ),
    ];
    for interrogation in results.requests.iter().flat_map(|requests| &requests.interrogations) {
        let Series { p50, longest, .. } = Series::from_values(interrogation.ours.clone());
        bars.push(bar(
            format!(
                "a general interrogation of {} points of {} in at most {MAX_INTERROGATION_MILLIS} \
                 ms",
                grouped(u64::from(POINTS)),
                interrogation.server
            ),
            longest <= MAX_INTERROGATION_MILLIS,
            format!("{p50:.0} ms, {longest:.0} ms at most, with connecting"),
        ));
    }
    bars
}

fn document(results: &Results) -> Document {
    let Results { drain, sustained, pixel, avalanche, requests } = results;
    let title = "The way of values, from a plugin to the picture".into();
    let mut document = Document { title, blocks: Vec::new() };
    document.text(format!(
        "Values come from a generator in a process of its own, through shared memory into the \
         tag table, which a view of the demo's transformer shows. Measured on {}.",
        machine()
    ));
    document.heading("Bars");
    document.blocks.push(Block::Claims(bars(results)));
    document.heading("Taking updates over");
    let rows = [
        ("read, checked and put into the table", drain.millis),
        ("of it, read and checked", drain.reading_millis),
    ];
    let caption = format!("{} waiting updates, ms", grouped(u64::from(drain::TAGS)));
    document.table(&caption, &HEAD, rows.map(row).to_vec());
    document.heading("From change to picture");
    let rows = [
        ("from source time to the picture read back", pixel.millis),
        ("a frame, reading it back among it", pixel.frame_millis),
    ];
    document.table(
        "One value that changes seven times a second, ms",
        &HEAD,
        rows.map(row).to_vec(),
    );
    document.heading("Frames beside sustained updates");
    document.text(format!(
        "{} tags in the configuration; from its first byte to the first frame {:.1} s.",
        grouped(sustained.tags),
        median(sustained.load_seconds.iter().copied())
    ));
    let rounds = |name: &'static str, series: &[Series]| -> Vec<Vec<String>> {
        series.iter().map(|&series| row((name, series))).collect()
    };
    let mut rows = rounds("without updates", &sustained.quiet);
    rows.extend(rounds("beside a million a second", &sustained.busy));
    document.table("Frames in alternating rounds, ms", &HEAD, rows);
    document.heading("Avalanche");
    document.table(
        "Every switch once a second, ms",
        &HEAD,
        vec![row(("from frame to frame", avalanche.gap_millis))],
    );
    if let Some(requests) = requests {
        describe(requests, &mut document);
    }
    document
}

fn describe(requests: &Requests, document: &mut Document) {
    document.heading("Requests a second, beside the peers' own clients");
    document.text(format!(
        "Modbus: reads of {REGISTERS} holding registers, one at a time, by the adapter, which \
         makes 63 values of each and hands them to the host, and by pymodbus' asynchronous \
         client in a loop. A bare connection exchanges as many bytes {} times a second.",
        grouped(requests.wire as u64)
    ));
    let caption = "Requests a second, medians of alternating rounds";
    document.table(caption, &RATES_HEAD, requests.modbus.iter().map(rates_row).collect());
    document.text(format!(
        "IEC 104: general interrogations of {} points each, one after the other, by the plugin, \
         which hands the values to the host, and by c104's client.",
        grouped(u64::from(POINTS))
    ));
    let caption = "Points a second, medians of alternating rounds";
    document.table(caption, &RATES_HEAD, requests.iec104.iter().map(rates_row).collect());
    let rows = requests.interrogations.iter().flat_map(|found| {
        let ours = format!("at {}, by the plugin, from its start", found.server);
        let peers = format!("at {}, by c104, from the request", found.server);
        [(ours, &found.ours), (peers, &found.peers)]
    });
    let rows = rows.map(|(name, millis)| row((&name, Series::from_values(millis.clone()))));
    let caption = format!("One interrogation of {} points, ms", grouped(u64::from(POINTS)));
    document.table(&caption, &HEAD, rows.collect());
}

fn rates_row(rates: &Rates) -> Vec<String> {
    let [ours, peers] = [&rates.ours, &rates.peers].map(|rates| median(rates.iter().copied()));
    let figures = [ours, peers].map(|rate| grouped(rate as u64));
    let ratio = format!("{:.2}", ours / peers);
    std::iter::once(format!("at {}", rates.server)).chain(figures).chain([ratio]).collect()
}

fn row((name, series): (&str, Series)) -> Vec<String> {
    let Series { count, p50, p99, longest } = series;
    let figures = [p50, p99, longest].map(|figure| format!("{figure:.3}"));
    std::iter::once(name.to_owned()).chain(figures).chain([grouped(count as u64)]).collect()
}
