//! A configuration's lines and their fields.

pub(super) use text_table::shorten;

use super::cfg_error::CfgError;

/// Goes through the lines of a configuration, and knows where it is.
pub(super) struct Lines<'a> {
    rest: std::str::Lines<'a>,
    number: usize,
}

/// A line cut at its commas.
pub(super) struct Fields<'a> {
    line: usize,
    fields: Vec<&'a str>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text.lines(), number: 0 }
    }

    /// The next line, which has `what`.
    pub(super) fn next(&mut self, what: &str) -> Result<Fields<'a>, CfgError> {
        self.next_if_any().ok_or_else(|| CfgError {
            line: self.number,
            what: format!("{what} is missing: the file ends"),
        })
    }

    /// The next line without going on.
    pub(super) fn peek(&self) -> Option<&'a str> {
        self.rest.clone().next()
    }

    /// The next line, unless the file ends or has nothing but blanks there.
    pub(super) fn next_if_any(&mut self) -> Option<Fields<'a>> {
        let text = self.rest.next()?.trim_matches(|c: char| c == '\u{1a}' || c.is_whitespace());
        self.number += 1;
        Some(Fields { line: self.number, fields: text.split(',').map(str::trim).collect() })
    }
}

impl<'a> Fields<'a> {
    pub(super) fn all(&self) -> &[&'a str] {
        &self.fields
    }

    pub(super) fn len(&self) -> usize {
        self.fields.len()
    }

    pub(super) fn is_blank(&self) -> bool {
        self.fields.iter().all(|field| field.is_empty())
    }

    pub(super) fn get(&self, index: usize) -> &'a str {
        self.fields.get(index).copied().unwrap_or_default()
    }

    /// The whole line again.
    pub(super) fn joined(&self) -> String {
        self.fields.join(",")
    }

    pub(super) fn fault(&self, what: impl Into<String>) -> CfgError {
        CfgError { line: self.line, what: what.into() }
    }

    /// A number; nothing where the field is empty.
    pub(super) fn number(&self, index: usize, what: &str) -> Result<Option<f64>, CfgError> {
        let text = self.get(index);
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(self.fault(format!("{what}: '{}' is no number", shorten(text)))),
        }
    }

    /// A whole number; nothing where the field is empty.
    pub(super) fn whole(&self, index: usize, what: &str) -> Result<Option<u64>, CfgError> {
        let text = self.get(index);
        if text.is_empty() {
            return Ok(None);
        }
        let parsed = text.parse().map(Some);
        parsed.map_err(|_| self.fault(format!("{what}: '{}' is no whole number", shorten(text))))
    }
}
