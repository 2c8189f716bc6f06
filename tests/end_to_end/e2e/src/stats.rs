//! Statistics that the program writes with `--stats`.

use std::path::Path;

use serde_json::Value;

/// Statistics of a view as JSON.
pub struct Stats(pub Value);

/// Tag of the statistics.
#[derive(Clone, Debug, PartialEq)]
pub struct Tag {
    /// Last value; null if none came.
    pub value: Value,
    /// Quality: `good`, `uncertain` or `bad`.
    pub quality: String,
    /// Reason of a quality that is not good.
    pub reason: Option<String>,
    /// Seconds since the value came.
    pub age: Option<f64>,
}

impl Stats {
    /// Reads a file that the program wrote.
    ///
    /// # Panics
    /// When it is missing or is no JSON.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self(serde_json::from_slice(&text).expect("statistics are JSON"))
    }

    /// Returns a count by its name.
    ///
    /// # Panics
    /// When there is none of that name.
    pub fn count(&self, name: &str) -> u64 {
        self.0[name].as_u64().unwrap_or_else(|| panic!("no count '{name}' in {:#}", self.0))
    }

    /// Returns a tag by its id.
    ///
    /// # Panics
    /// When there is none of that id.
    pub fn tag(&self, id: &str) -> Tag {
        let mut tags = self.tags();
        let found = tags.find(|(other, _)| other == id);
        found.unwrap_or_else(|| panic!("no tag '{id}' in {:#}", self.0)).1
    }

    /// Iterates over every tag with its id.
    ///
    /// # Panics
    /// When the statistics have no tags.
    pub fn tags(&self) -> impl Iterator<Item = (String, Tag)> {
        let tags = self.0["tags"].as_array().expect("statistics have tags");
        let text = |value: &Value| value.as_str().map(str::to_owned);
        tags.iter().map(move |tag| {
            let parsed = Tag {
                value: tag["value"].clone(),
                quality: text(&tag["quality"]).unwrap_or_default(),
                reason: text(&tag["reason"]),
                age: tag["age"].as_f64(),
            };
            (text(&tag["id"]).unwrap_or_default(), parsed)
        })
    }
}
