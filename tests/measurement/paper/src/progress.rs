//! Progress bar of the measurement on a terminal.

use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};

/// Progress bar for each stage; hidden where the output is not a terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Creates a bar at zero.
    ///
    /// # Errors
    /// When the bar's template is wrong.
    pub fn new() -> Result<Self> {
        let bar = ProgressBar::new(0);
        bar.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg} ({elapsed})")?);
        Ok(Self { bar })
    }

    /// Creates a bar that is not drawn.
    pub fn hidden() -> Self {
        Self { bar: ProgressBar::hidden() }
    }

    /// Begins a stage of `steps` steps.
    pub fn stage(&self, name: &str, steps: usize) {
        self.bar.set_length(steps as u64);
        self.bar.set_position(0);
        self.bar.set_message(name.to_owned());
        self.bar.tick();
    }

    /// Advances the bar by one step.
    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// Removes the bar from the terminal.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
