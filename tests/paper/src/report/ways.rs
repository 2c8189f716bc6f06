//! Readings and orders, side by side.

use super::figures::{LAST, LEVEL_HEAD, caption, level_row};
use crate::chart::LineChart;
use crate::document::{Block, Captioned, Chart};
use crate::study::{Level, SubjectStudy, THETAS, VariantResult};
use crate::words::{grouped, millis, percent, theta};
use crate::{Document, Results};

/// What the chart compares.
const DRAWN: [(&str, &str); 6] = [
    ("busbar", "paper, as read"),
    ("eq4_printed", "Eq. 4 as printed"),
    ("literal", "paper, literally"),
    ("guarded", "guarded"),
    ("reweighted", "re-weighted"),
    ("meshoptimizer", "meshoptimizer"),
];

pub(super) fn write(document: &mut Document, results: &Results) {
    let study = &results.study.welded;
    document.heading("Readings and orders: error and picture");
    let variants = &study.variants;
    document.table(
        "Surface error of the transformer, relative to the diagonal of its box",
        &[
            "way",
            "mean, 70 %",
            "mean, 85 %",
            "mean, 95 %",
            "greatest, 70 %",
            "greatest, 85 %",
            "greatest, 95 %",
            "made in, ms",
        ],
        variants.iter().map(errors).collect(),
    );
    document.text(
        "Points drawn uniformly by area, with one seed, on the original and on the simplified \
         surface; the distance of each to the other surface. The larger of both means, and the \
         larger of both maxima, are shown; the JSON has all four.",
    );
    document.blocks.push(Block::Chart(error_chart(study)));
    let rows = variants.iter().filter_map(|variant| {
        let level = variant.levels.iter().find(|level| level.theta == LAST)?;
        Some(level_row(variant.name, level))
    });
    document.table(&format!("What is left at {}", theta(LAST)), &LEVEL_HEAD, rows.collect());
    document.table(
        "Share of each factor in the variance of W",
        &["mesh", "edges at a border", "L", "F", "S", "C"],
        vec![
            shares("welded", &results.study.welded),
            shares("split vertices", &results.study.split),
        ],
    );
    document.sheet("The transformer in each way", THETAS.len(), pictures(variants));
    split_errors(document, &results.study.split);
}

fn errors(variant: &VariantResult) -> Vec<String> {
    let all = |of: fn(&Level) -> Option<f64>| {
        variant.levels.iter().map(move |level| of(level).map_or_else(|| "-".to_owned(), percent))
    };
    let means = all(|level| level.error.map(|error| error.mean()));
    let greatest = all(|level| level.error.map(|error| error.max()));
    std::iter::once(variant.name.to_owned())
        .chain(means)
        .chain(greatest)
        .chain([millis(variant.millis)])
        .collect()
}

fn shares(name: &str, study: &SubjectStudy) -> Vec<String> {
    let shares = study.variance_shares.map(percent);
    [name.to_owned(), grouped(study.full.border_edges)].into_iter().chain(shares).collect()
}

fn pictures(variants: &[VariantResult]) -> Vec<Captioned> {
    let picture = |variant: &VariantResult, level: &Level| Captioned {
        file: level.picture.clone(),
        caption: caption(variant.name, level.theta, &level.counts),
    };
    let of = |variant: &'_ VariantResult| -> Vec<Captioned> {
        variant.levels.iter().map(|level| picture(variant, level)).collect()
    };
    variants.iter().flat_map(of).collect()
}

fn error_chart(study: &SubjectStudy) -> Chart {
    let line = |&(id, name): &(&str, &str)| {
        let levels = &study.variant(id)?.levels;
        let point = |level: &Level| Some([level.theta * 100.0, level.error?.mean() * 100.0]);
        Some((name.to_owned(), levels.iter().filter_map(point).collect()))
    };
    let lines = DRAWN.iter().filter_map(line).collect();
    let chart = LineChart { x: "theta, %", y: "mean error, % of diagonal", log_y: true, lines };
    Chart {
        caption: "Mean surface error of the transformer".to_owned(),
        file: "errors.svg".to_owned(),
        svg: chart.svg(),
    }
}

fn split_errors(document: &mut Document, split: &SubjectStudy) {
    document.table(
        "The same with split vertices: every seam of normals is a border",
        &[
            "way",
            "mean, 70 %",
            "mean, 85 %",
            "mean, 95 %",
            "greatest, 70 %",
            "greatest, 85 %",
            "greatest, 95 %",
            "made in, ms",
        ],
        split.variants.iter().map(errors).collect(),
    );
}
