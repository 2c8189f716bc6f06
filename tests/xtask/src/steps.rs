//! Named steps with their times.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

/// The steps run so far.
#[derive(Default)]
pub(crate) struct Steps {
    done: Vec<(&'static str, Duration)>,
}

impl Steps {
    /// Runs one step, telling its name before and its time after it.
    pub(crate) fn run<T>(
        &mut self,
        name: &'static str,
        step: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        println!("== {name}");
        let start = Instant::now();
        let result = step();
        let duration = start.elapsed();
        println!("== {name}: {:.1} s\n", duration.as_secs_f64());
        self.done.push((name, duration));
        result.with_context(|| format!("step '{name}'"))
    }

    /// A line for each step and one for all.
    pub(crate) fn table(&self) -> String {
        let total = self.done.iter().map(|(_, duration)| *duration).sum();
        let mut text = String::new();
        for (name, duration) in self.done.iter().chain([&("all", total)]) {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<16}{:>8.1} s", duration.as_secs_f64());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_adds_up() {
        let done =
            vec![("build", Duration::from_millis(61_500)), ("tests", Duration::from_millis(8_200))];
        assert_eq!(
            Steps { done }.table(),
            "build               61.5 s\n\
             tests                8.2 s\n\
             all                 69.7 s\n"
        );
    }

    #[test]
    fn a_failed_step_is_named_and_timed() {
        let mut steps = Steps::default();
        let error = steps.run::<()>("lint", || anyhow::bail!("broken")).unwrap_err();
        assert_eq!(format!("{error:#}"), "step 'lint': broken");
        assert!(steps.table().starts_with("lint"));
    }
}
