//! Figures as a table and as JSON.

use std::fmt::Write;
use std::thread;

use anyhow::Result;
use serde_json::{Map, Value, json};

use crate::scene::Scene;
use crate::series::Series;

/// What one bench found.
pub(crate) struct Section {
    pub(crate) series: Vec<Series>,
}

/// What all benches found.
pub(crate) struct Report {
    head: Value,
    sections: Map<String, Value>,
}

impl Section {
    /// The figures as lines.
    pub(crate) fn table(&self, name: &str) -> String {
        let mut text = format!(
            "{name:<34}{:>11}{:>11}{:>11}{:>11}{:>7}  bar\n",
            "median", "min", "max", "p99", "count"
        );
        for series in &self.series {
            let label = match series.unit {
                "" => series.name.to_owned(),
                unit => format!("{} [{unit}]", series.name),
            };
            let [median, min, max, p99] = [0.5, 0.0, 1.0, 0.99].map(|q| series.quantile(q));
            let bar = match (series.bar, series.is_met()) {
                (Some(bar), Some(true)) => format!("<= {bar:.3}: met"),
                (Some(bar), _) => format!("<= {bar:.3}: MISSED"),
                (None, _) => String::new(),
            };
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "  {label:<32}{median:>11.3}{min:>11.3}{max:>11.3}{p99:>11.3}{:>7}  {bar}",
                series.len()
            );
        }
        text
    }

    fn json(&self) -> Value {
        self.series.iter().map(|series| (series.name.to_owned(), series.json())).collect()
    }
}

impl Report {
    /// A report without sections.
    pub(crate) fn new(scene: &Scene, rounds: usize) -> Self {
        let head = json!({
            "cores": thread::available_parallelism().map_or(1, usize::from),
            "rounds": rounds,
            "vertices": scene.positions.len(),
            "triangles": scene.triangles.len(),
        });
        Self { head, sections: Map::new() }
    }

    pub(crate) fn add(&mut self, name: &str, section: &Section) {
        self.sections.insert(name.to_owned(), section.json());
    }

    /// The whole report.
    pub(crate) fn json(mut self) -> Result<String> {
        self.head["sections"] = Value::Object(self.sections);
        Ok(serde_json::to_string_pretty(&self.head)?)
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
    }
}
