//! Section on the costs of initialisation and of changes of theta.

use std::collections::BTreeSet;

use crate::theta_change::MAX_SHARE_OF_FRAME;
use report_writer::Document;
use report_writer::number_format::{millis, percent, size};

use crate::Results;

/// Stages in the order of their happening; others follow by name.
const ORDER: [&str; 13] = [
    "config",
    "plugins",
    "import",
    "scene",
    "optimize",
    "optimize/edges",
    "optimize/weights",
    "optimize/sort",
    "optimize/collapse",
    "stacks",
    "cache",
    "cache/store",
    "upload",
];

pub(super) fn write(document: &mut Document, results: &Results) {
    document.heading("Initialisation");
    let stages = &results.stages;
    let known: BTreeSet<&String> = stages.first.keys().chain(stages.second.keys()).collect();
    let listed = ORDER.into_iter().filter(|&name| known.iter().any(|k| *k == name));
    let others = known.iter().map(|k| k.as_str()).filter(|name| !ORDER.contains(name));
    let rows = listed.chain(others).map(|name| {
        let of = |load: &std::collections::BTreeMap<String, f64>| {
            load.get(name).map_or_else(|| "-".to_owned(), |&v| millis(v))
        };
        vec![name.to_owned(), of(&stages.first), of(&stages.second)]
    });
    document.table(
        "Milliseconds a stage, first and second load of the scene",
        &["stage", "first load", "second load"],
        rows.collect(),
    );
    document.text(format!(
        "import includes welding, which takes {} ms by itself (the same vertex arrays, welded \
         again). optimize is the whole call of the plugin, and optimize/... its parts: the list L \
         of the paper. stacks makes parents and death indices; upload brings vertices to the \
         device. cache looks on disk for what an earlier load made, and cache/store leaves it \
         there.{}",
        millis(stages.weld),
        stages.cached_share().map_or_else(String::new, |share| format!(
            " The second load found it: cache takes {} of what optimize and stacks took.",
            percent(share)
        ))
    ));
    theta_change(document, results);
}

fn theta_change(document: &mut Document, results: &Results) {
    let change = &results.theta_change;
    document.heading("A change of theta of the whole scene");
    let row = |name: &str, series: crate::series::Series| {
        let share = series.p50_ms / change.full_frame.p50_ms;
        vec![name.to_owned(), millis(series.p50_ms), millis(series.p99_ms), percent(share)]
    };
    document.table(
        &format!("{} random thetas, {}, 1 sample", change.change.count, size(change.size)),
        &["", "p50, ms", "p99, ms", "p50 of a frame at theta 0"],
        vec![
            row("resolve alone", change.resolve),
            row("change: resolve and upload", change.change),
            row("frame at theta 0", change.full_frame),
        ],
    );
    let Some([large, small]) = results.shares_of_frame() else { return };
    document.text(format!(
        "The change is what a frame at a new theta takes longer than the next frame, which shows \
         the same; its 99th percentile carries the noise of two frames. The median is {} of a frame \
         at theta 0 and 1280 x 720, {} the bar of {}; of the cheaper frame at 320 x 180 it is {}.",
        percent(large),
        if large < MAX_SHARE_OF_FRAME { "under" } else { "over" },
        percent(MAX_SHARE_OF_FRAME),
        percent(small)
    ));
}
