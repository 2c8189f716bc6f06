//! Report of figures as a table, as a document and as JSON.

use std::fmt::Write;

use report_writer::{Block, Claim, Document, Verdict};
use serde_json::{Map, Value};

use crate::series::Series;

/// Results of one section.
pub(crate) struct Section {
    pub(crate) series: Vec<Series>,
}

impl Section {
    /// Formats the figures as lines.
    pub(crate) fn table(&self, name: &str) -> String {
        let mut text = format!(
            "{name:<38}{:>11}{:>11}{:>11}{:>11}{:>7}  bar\n",
            "median", "min", "max", "p99", "count"
        );
        for series in &self.series {
            let [median, min, max, p99] = quantiles(series);
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "  {:<36}{median:>11.3}{min:>11.3}{max:>11.3}{p99:>11.3}{:>7}  {}",
                label(series),
                series.len(),
                verdict(series)
            );
        }
        text
    }

    /// Writes the figures as a table of the report.
    pub(crate) fn write(&self, document: &mut Document, name: &str) {
        let row = |series: &Series| {
            let figures = quantiles(series).map(|figure| format!("{figure:.3}"));
            let ends = [series.len().to_string(), verdict(series)];
            std::iter::once(label(series)).chain(figures).chain(ends).collect()
        };
        let head = [name, "median", "min", "max", "p99", "count", "bar"];
        document.table(name, &head, self.series.iter().map(row).collect());
    }

    /// Judges the bars of the figures.
    pub(crate) fn bars(&self, name: &str) -> Vec<Claim> {
        let claim = |series: &Series| {
            let bar = series.bar?;
            Some(Claim {
                claim: format!("{name}: {} at most {bar}", label(series)),
                verdict: Verdict::of_bar(series.is_met()?),
                figure: format!("{:.3}", series.quantile(0.5)),
            })
        };
        self.series.iter().filter_map(claim).collect()
    }

    pub(crate) fn json(&self) -> Value {
        let figures = self.series.iter().map(|series| (series.name.clone(), series.json()));
        Value::Object(figures.collect::<Map<_, _>>())
    }
}

fn quantiles(series: &Series) -> [f64; 4] {
    [0.5, 0.0, 1.0, 0.99].map(|share| series.quantile(share))
}

fn label(series: &Series) -> String {
    match series.unit {
        "" => series.name.clone(),
        unit => format!("{} [{unit}]", series.name),
    }
}

fn verdict(series: &Series) -> String {
    match (series.bar, series.is_met()) {
        (Some(bar), Some(true)) => format!("<= {bar:.3}: met"),
        (Some(bar), _) => format!("<= {bar:.3}: MISSED"),
        (None, _) => String::new(),
    }
}

/// Adds a heading and claims under it.
pub(crate) fn claims(document: &mut Document, heading: &str, claims: Vec<Claim>) {
    if !claims.is_empty() {
        document.heading(heading);
        document.blocks.push(Block::Claims(claims));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missed_bar_shows() {
        let figure = |name, value| Series::exact(name, "", value).at_most(0.5);
        let section = Section { series: vec![figure("good", 0.25), figure("bad", 0.75)] };
        let table = section.table("test");
        let line = |name: &str| table.lines().find(|line| line.contains(name)).unwrap().to_owned();
        assert!(line("good").ends_with("<= 0.500: met"));
        assert!(line("bad").ends_with("<= 0.500: MISSED"));
        assert_eq!(section.json()["bad"]["met"], Value::Bool(false));
        assert_eq!(section.json()["good"]["median"], 0.25);
        let verdicts: Vec<_> = section.bars("test").iter().map(|claim| claim.verdict).collect();
        assert_eq!(verdicts, [Verdict::Met, Verdict::Missed]);
    }
}
