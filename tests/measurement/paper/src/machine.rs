//! Machine of the run: processor and graphics device.

use std::fs;
use std::thread;

use serde::Serialize;

/// Processor and graphics device of the machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Model of the processor, or "unknown".
    pub processor: String,
    /// Hardware threads that this process may use.
    pub threads: usize,
    /// Graphics device as its driver names it.
    pub device: String,
}

impl Machine {
    /// Describes this machine with the given graphics device.
    pub fn detect(device: &str) -> Self {
        let facts = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        Self {
            processor: processor(&facts).unwrap_or("unknown").to_owned(),
            threads: thread::available_parallelism().map_or(1, usize::from),
            device: device.to_owned(),
        }
    }
}

fn processor(facts: &str) -> Option<&str> {
    let line = facts.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named() {
        let facts = "processor\t: 0\nmodel name\t: Some CPU @ 2.1GHz\nflags: a b";
        assert_eq!(processor(facts), Some("Some CPU @ 2.1GHz"));
        assert_eq!(processor(""), None);
        assert!(Machine::detect("device").threads > 0);
    }
}
