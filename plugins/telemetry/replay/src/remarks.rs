//! Remarks on oddities of a recording, each reported once and in limited number.

use busbar_plugin_sdk::{Host, LogLevel};

/// Remarks on one recording; what comes after is counted.
pub(crate) const MAX_REMARKS: usize = 20;

/// Tells remarks to the host's log.
pub(crate) struct Remarks {
    host: Host,
    file: String,
    told: Vec<String>,
    left_out: usize,
}

impl Remarks {
    pub(crate) fn new(host: Host, file: String) -> Self {
        Self { host, file, told: Vec::new(), left_out: 0 }
    }

    /// Tells what is odd, unless it was told before: a loop comes to it again.
    pub(crate) fn add(&mut self, remark: impl Into<String>) {
        let remark = remark.into();
        if self.told.contains(&remark) {
            return;
        }
        if self.told.len() == MAX_REMARKS {
            self.left_out = self.left_out.saturating_add(1);
            return;
        }
        self.host.log(LogLevel::Warning, &format!("'{}': {remark}", self.file));
        self.told.push(remark);
    }

    /// After the first pass: how many were not told.
    pub(crate) fn close(&mut self) {
        let left_out = std::mem::take(&mut self.left_out);
        if left_out > 0 {
            let text = format!("'{}': {left_out} further remarks are left out", self.file);
            self.host.log(LogLevel::Warning, &text);
        }
    }

    #[cfg(test)]
    pub(crate) fn told(&self) -> (&[String], usize) {
        (&self.told, self.left_out)
    }
}
