//! Summary of a render's statistics as readable text.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;

/// Subset of the statistics that `busbar render --stats` writes.
#[derive(Deserialize)]
struct Stats {
    triangles: u64,
    vertices: u64,
    gpu: String,
    tags: Vec<Tag>,
}

#[derive(Deserialize)]
struct Tag {
    id: String,
    value: Value,
    quality: String,
    reason: Option<String>,
}

/// Formats some lines about the picture and a table of its tags.
pub(crate) fn format(stats: &str) -> Result<String> {
    let stats: Stats = serde_json::from_str(stats)
        .context("cannot read the statistics that `busbar render` wrote")?;
    let mut text = format!(
        "triangles  {}\nvertices   {}\ngpu        {}\n",
        stats.triangles, stats.vertices, stats.gpu
    );
    let widths = stats.tags.iter().map(|tag| tag.id.chars().count());
    let width = widths.max().unwrap_or_default();
    for tag in &stats.tags {
        let reason = tag.reason.as_deref().filter(|reason| !reason.is_empty());
        let reason = reason.map_or_else(String::new, |reason| format!(" ({reason})"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "tag        {:<width$} {:>12}  {}{reason}",
            tag.id,
            shown(&tag.value),
            tag.quality
        );
    }
    Ok(text)
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => {
            format!("{:.2}", number.as_f64().unwrap_or(f64::NAN))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_a_table() {
        let stats = r#"{"vertices": 1200, "triangles": 2100, "theta": 0.0, "gpu": "llvmpipe",
            "tags": [
            {"id": "T1.oil", "value": 61.04999, "quality": "good", "reason": null, "age": 0.2},
            {"id": "Q0.closed", "value": true, "quality": "good"},
            {"id": "F", "value": null, "quality": "bad", "reason": "no connection"}]}"#;
        assert_eq!(
            format(stats).unwrap(),
            "triangles  2100\n\
             vertices   1200\n\
             gpu        llvmpipe\n\
             tag        T1.oil           61.05  good\n\
             tag        Q0.closed         true  good\n\
             tag        F                    -  bad (no connection)\n"
        );
    }

    #[test]
    fn statistics_without_tags_are_refused() {
        let error = format(r#"{"vertices": 1, "triangles": 1, "gpu": "x"}"#).unwrap_err();
        assert!(format!("{error:#}").contains("`tags`"), "{error:#}");
    }
}
