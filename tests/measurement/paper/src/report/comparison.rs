//! Section that compares readings and orders.

use super::figures::{LAST, LEVEL_HEAD, caption, level_row};
use crate::study::{Level, SubjectStudy, THETAS, VariantResult};
use report_writer::Document;
use report_writer::chart::LineChart;
use report_writer::number_format::{grouped, millis, percent, theta};
use report_writer::{Block, CaptionedPicture, Chart};

use crate::Results;

const ERROR_HEAD: [&str; 8] = [
    "way",
    "mean, 70 %",
    "mean, 85 %",
    "mean, 95 %",
    "greatest, 70 %",
    "greatest, 85 %",
    "greatest, 95 %",
    "made in, ms",
];

pub(super) fn write(document: &mut Document, results: &Results) {
    let (welded, open) = (&results.study.welded, &results.study.open);
    document.heading("Orders of collapse: error and picture");
    compare(document, "Transformer", welded);
    document.text(
        "Points are drawn uniformly by area, with one seed, on the original and on the simplified \
         surface, and each one's distance to the other surface is taken, relative to the diagonal \
         of the box around the original. Of both ways the larger mean and the larger maximum are \
         shown; report.json has all four. The shells are closed, so that every reading of borders \
         gives the same order.",
    );
    document.blocks.push(Block::Chart(error_chart(welded)));
    document.sheet("The transformer in each order", THETAS.len(), pictures(welded));

    document.heading("Readings of the equations: error and picture");
    compare(document, "Transformer without undersides", open);
    document.sheet("Without undersides, in each reading", THETAS.len(), pictures(open));
    let shares = |(name, study): (&str, &SubjectStudy)| {
        let shares = study.variance_shares.map(percent);
        [name.to_owned(), grouped(study.full.border_edges)].into_iter().chain(shares).collect()
    };
    let subjects = [
        ("closed", welded),
        ("without undersides", open),
        ("split vertices", &results.study.split),
    ];
    document.table(
        "Share of each term in the variance of W",
        &["transformer", "border edges", "length L", "flag F", "area S", "curvature C"],
        subjects.map(shares).to_vec(),
    );
}

fn compare(document: &mut Document, subject: &str, study: &SubjectStudy) {
    let title = format!("{subject}: surface error, share of the diagonal");
    document.table(&title, &ERROR_HEAD, study.variants.iter().map(errors).collect());
    let rows = study.variants.iter().filter_map(|variant| {
        let level = variant.levels.iter().find(|level| level.theta == LAST)?;
        Some(level_row(variant.name, level))
    });
    let title = format!("{subject}: what is left at {}", theta(LAST));
    document.table(&title, &LEVEL_HEAD, rows.collect());
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

fn pictures(study: &SubjectStudy) -> Vec<CaptionedPicture> {
    let levels = study
        .variants
        .iter()
        .flat_map(|variant| variant.levels.iter().map(move |level| (variant.name, level)));
    let picture = |(name, level): (&str, &Level)| CaptionedPicture {
        file: level.picture.clone(),
        caption: caption(name, level.theta, &level.counts),
    };
    levels.map(picture).collect()
}

fn error_chart(study: &SubjectStudy) -> Chart {
    // Closed shells: without border protection the line would be the same.
    let drawn = study.variants.iter().filter(|variant| variant.id != "unprotected");
    let line = |variant: &VariantResult| {
        let point = |level: &Level| Some([level.theta * 100.0, level.error?.mean() * 100.0]);
        (variant.id.replace('_', " "), variant.levels.iter().filter_map(point).collect())
    };
    let lines = drawn.map(line).collect();
    let chart = LineChart { x: "theta, %", y: "mean error, % of diagonal", log_y: true, lines };
    Chart {
        caption: "Mean surface error of the transformer".to_owned(),
        file: "errors.svg".to_owned(),
        svg: chart.svg(),
    }
}
