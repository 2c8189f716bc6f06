//! Report of all cases.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::finding::Finding;

/// The outcome of one case.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum CaseVerdict {
    /// The case passed without findings.
    Pass,
    /// The case has findings.
    Fail {
        /// All findings of the case.
        findings: Vec<Finding>,
    },
    /// The case does not apply.
    Skip {
        /// Reason of the skip.
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
    /// Property that a passed case proves.
    pub what: &'static str,
    /// Outcome of the case.
    #[serde(flatten)]
    pub verdict: CaseVerdict,
    /// Duration of the case, milliseconds.
    pub millis: u64,
}

/// Every case of a library.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Path of the library file.
    pub library: PathBuf,
    /// True where no case failed.
    pub passed: bool,
    /// Every case, in order.
    pub cases: Vec<CaseResult>,
}

impl Report {
    /// Counts the cases that passed, failed and were skipped.
    pub fn counts(&self) -> [usize; 3] {
        let count = |wanted: fn(&CaseVerdict) -> bool| {
            self.cases.iter().filter(|case| wanted(&case.verdict)).count()
        };
        [
            count(|verdict| matches!(verdict, CaseVerdict::Pass)),
            count(|verdict| matches!(verdict, CaseVerdict::Fail { .. })),
            count(|verdict| matches!(verdict, CaseVerdict::Skip { .. })),
        ]
    }
}

/// One line, and two for each finding.
impl fmt::Display for CaseResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, what) = (self.case, self.what);
        match &self.verdict {
            CaseVerdict::Pass => write!(f, "pass  {name:<20}  {what}"),
            CaseVerdict::Skip { reason } => write!(f, "skip  {name:<20}  {reason}"),
            CaseVerdict::Fail { findings } => {
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
        let failed = case(CaseVerdict::Fail { findings });
        let lines: Vec<_> = failed.to_string().lines().map(str::trim).map(str::to_owned).collect();
        assert_eq!(lines[1..], ["it leaks", "-> free it"]);
        let skipped = case(CaseVerdict::Skip { reason: "no tags".into() });
        let json = serde_json::to_value(&skipped).unwrap();
        assert_eq!((&json["verdict"], &json["reason"]), (&"skip".into(), &"no tags".into()));
        let report = Report { library: "a.so".into(), passed: false, cases: vec![failed, skipped] };
        assert_eq!(report.counts(), [0, 1, 1]);
    }
}
