//! What came of all cases.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::finding::Finding;

/// The outcome of one case.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum Verdict {
    /// All is as it must be.
    Pass,
    /// Something is not.
    Fail {
        /// Each fault.
        findings: Vec<Finding>,
    },
    /// The case does not apply.
    Skip {
        /// Why.
        reason: String,
    },
}

/// One case, of one plugin or of the library.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CaseResult {
    /// Name of the case.
    pub case: &'static str,
    /// Plugin id, for a case of a plugin.
    pub plugin: Option<String>,
    /// What holds when it passes.
    pub what: &'static str,
    /// Outcome.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// How long it took, milliseconds.
    pub millis: u64,
}

/// Every case of a library.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The library's file.
    pub library: PathBuf,
    /// Whether no case failed.
    pub passed: bool,
    /// Every case, in order.
    pub cases: Vec<CaseResult>,
}

impl Report {
    /// How many cases passed, failed and were skipped.
    pub fn counts(&self) -> [usize; 3] {
        let count = |wanted: fn(&Verdict) -> bool| {
            self.cases.iter().filter(|case| wanted(&case.verdict)).count()
        };
        [
            count(|verdict| matches!(verdict, Verdict::Pass)),
            count(|verdict| matches!(verdict, Verdict::Fail { .. })),
            count(|verdict| matches!(verdict, Verdict::Skip { .. })),
        ]
    }
}

/// One line, and two for each finding.
impl fmt::Display for CaseResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, what) = (self.case, self.what);
        match &self.verdict {
            Verdict::Pass => write!(f, "pass  {name:<20}  {what}"),
            Verdict::Skip { reason } => write!(f, "skip  {name:<20}  {reason}"),
            Verdict::Fail { findings } => {
                write!(f, "FAIL  {name:<20}  not so: {what}")?;
                for Finding { fault, remedy } in findings {
                    write!(f, "\n        {fault}")?;
                    if !remedy.is_empty() {
                        write!(f, "\n          -> {remedy}")?;
                    }
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_read_with_its_remedy() {
        let findings = vec![Finding::new("it leaks", "free it")];
        let case =
            |verdict| CaseResult { case: "leaks", plugin: None, what: "none", verdict, millis: 1 };
        let failed = case(Verdict::Fail { findings });
        let lines: Vec<_> = failed.to_string().lines().map(str::trim).map(str::to_owned).collect();
        assert_eq!(lines[1..], ["it leaks", "-> free it"]);
        let skipped = case(Verdict::Skip { reason: "no tags".into() });
        let json = serde_json::to_value(&skipped).unwrap();
        assert_eq!((&json["verdict"], &json["reason"]), (&"skip".into(), &"no tags".into()));
        let report = Report { library: "a.so".into(), passed: false, cases: vec![failed, skipped] };
        assert_eq!(report.counts(), [0, 1, 1]);
    }
}
