//! Cases in processes of their own: started, timed, ended, and read.

use std::fs::File;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};
use thiserror::Error;

use crate::cases::{CASES, Case, Scope};
use crate::environment::{Sentinels, limit_resources};
use crate::finding::{Finding, Stop};
use crate::journal::{self, Entry, PluginFacts};
use crate::probe::Probe;
use crate::report::{CaseResult, CaseVerdict, Report};
use crate::request::{Options, Request};

/// Interval between two polls of a child.
const LOOK_PERIOD: Duration = Duration::from_millis(5);
/// Bytes of a child's output in which a panic is looked for.
const MAX_OUTPUT_BYTES: usize = 1 << 20;
/// Exit code of a case that could not be run at all.
const EXIT_UNUSABLE: i32 = 2;

/// Errors that prevent all checks.
#[derive(Debug, Error)]
pub enum CheckError {
    /// The library is not there.
    #[error("cannot read '{path}': {source}; give the path of a built plugin library")]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Reason from the system.
        source: std::io::Error,
    },
    /// No case has this name.
    #[error("there is no case '{0}'; the report lists their names")]
    UnknownCase(String),
    /// A process or a file of the checker's own could not be made.
    #[error("cannot run a case: {0}; check that the temporary folder may be written")]
    Unable(#[from] std::io::Error),
}

/// Checks a library. `case_command` gives a command that hands its one argument, the
/// path of a request, to [`run_case`]; `on_result` hears of each case as it ends.
///
/// # Errors
/// [`CheckError`]: nothing is known of the plugin then.
pub fn check(
    library: &Path,
    options: &Options,
    case_command: &dyn Fn(&Path) -> Command,
    on_result: &mut dyn FnMut(&CaseResult),
) -> Result<Report, CheckError> {
    let unreadable = |source| CheckError::Unreadable { path: library.to_owned(), source };
    let library = library.canonicalize().map_err(unreadable)?;
    if let Some(name) = options.only.iter().find(|name| CASES.iter().all(|c| c.name != **name)) {
        return Err(CheckError::UnknownCase(name.clone()));
    }
    let folder = tempfile::tempdir()?;
    let mut run =
        CheckRun { library, options, case_command, folder: folder.path(), done: Vec::new() };
    let mut plugins: Option<Vec<PluginFacts>> = None;
    let (check_library, of_plugins): (Vec<_>, Vec<_>) =
        CASES.iter().filter(|case| run.wants(case)).partition(|c| c.scope == Scope::Library);
    for case in check_library {
        let found = run.case(case, 0, None, on_result)?;
        plugins = plugins.or(found);
    }
    match plugins {
        None => {
            for case in of_plugins {
                run.blocked(case, "descriptors", on_result);
            }
        }
        Some(plugins) => {
            for (index, facts) in plugins.iter().enumerate() {
                for case in of_plugins.iter().filter(|case| applies(case, facts)) {
                    run.case(case, index as u32, Some(facts), on_result)?;
                }
            }
        }
    }
    let cases: Vec<_> = run.done.into_iter().map(|done| done.result).collect();
    let passed = cases.iter().all(|case| !matches!(case.verdict, CaseVerdict::Fail { .. }));
    Ok(Report { library: run.library, passed, cases })
}

/// Reports whether a case applies to a plugin with these capabilities.
fn applies(case: &Case, facts: &PluginFacts) -> bool {
    match case.scope {
        Scope::Capability(id) => facts.capabilities.iter().any(|other| other == id),
        Scope::Library | Scope::Plugin => true,
    }
}

/// A check under way.
struct CheckRun<'a> {
    library: PathBuf,
    options: &'a Options,
    case_command: &'a dyn Fn(&Path) -> Command,
    folder: &'a Path,
    done: Vec<FinishedCase>,
}

struct FinishedCase {
    result: CaseResult,
    /// False where cases that depend on this one make no sense.
    sound: bool,
}

impl CheckRun<'_> {
    /// Reports whether a case was selected, or is a dependency of a selected one.
    fn wants(&self, case: &Case) -> bool {
        let only = &self.options.only;
        let needed = |name: &str| {
            let needs = |asked: &str| CASES.iter().any(|c| c.name == asked && needs(c, name));
            only.iter().any(|asked| asked == name || needs(asked))
        };
        only.is_empty() || needed(case.name)
    }

    /// Runs one case, unless one that it needs failed; plugins that it named.
    fn case(
        &mut self,
        case: &Case,
        plugin: u32,
        facts: Option<&PluginFacts>,
        on_result: &mut dyn FnMut(&CaseResult),
    ) -> Result<Option<Vec<PluginFacts>>, CheckError> {
        let id = facts.map(|facts| facts.id.clone());
        let unsound = case.needs.iter().find(|need| {
            let of_this = |done: &&FinishedCase| {
                done.result.case == **need
                    && (done.result.plugin.is_none() || done.result.plugin == id)
            };
            self.done.iter().find(of_this).is_some_and(|done| !done.sound)
        });
        if let Some(need) = unsound {
            let result = blocked(case, need, id);
            on_result(&result);
            self.done.push(FinishedCase { result, sound: false });
            return Ok(None);
        }
        let started = Instant::now();
        let ended = self.process(case, plugin)?;
        let (verdict, sound) = verdict_of(&ended, self.options.case_limit);
        let millis = started.elapsed().as_millis() as u64;
        let result = CaseResult { case: case.name, plugin: id, what: case.what, verdict, millis };
        on_result(&result);
        self.done.push(FinishedCase { result, sound });
        let named = ended.journal.into_iter().filter_map(|entry| match entry {
            Entry::Plugin(facts) => Some(facts),
            _ => None,
        });
        let named: Vec<_> = named.collect();
        Ok(if named.is_empty() || !sound { None } else { Some(named) })
    }

    fn blocked(&mut self, case: &Case, need: &str, on_result: &mut dyn FnMut(&CaseResult)) {
        let result = blocked(case, need, None);
        on_result(&result);
        self.done.push(FinishedCase { result, sound: false });
    }

    /// The process of one case, to its end.
    fn process(&self, case: &Case, plugin: u32) -> Result<CaseExit, CheckError> {
        let name = format!("{}-{plugin}", case.name);
        let path = |suffix: &str| self.folder.join(format!("{name}.{suffix}"));
        let request = Request {
            library: self.library.clone(),
            case: case.name.to_owned(),
            plugin,
            sample: self.options.sample.clone(),
            journal: path("journal"),
            limit_millis: self.options.case_limit.as_millis() as u64,
        };
        let text = serde_json::to_vec(&request).map_err(std::io::Error::from)?;
        std::fs::write(path("request"), text)?;
        let output = File::create(path("output"))?;
        let mut command = (self.case_command)(&path("request"));
        command.stdin(Stdio::null()).stdout(output.try_clone()?).stderr(output);
        command.env("RUST_BACKTRACE", "0").process_group(0);
        let mut child = command.spawn()?;
        let status = wait(&mut child, self.options.case_limit)?;
        // A plugin's own children must not outlive the case either.
        kill_group(&child);
        Ok(CaseExit {
            status,
            journal: journal::read(&request.journal),
            panic: first_panic(&path("output")),
        })
    }
}

fn needs(case: &Case, name: &str) -> bool {
    case.needs.iter().any(|need| {
        *need == name || CASES.iter().any(|other| other.name == *need && needs(other, name))
    })
}

fn blocked(case: &Case, need: &str, plugin: Option<String>) -> CaseResult {
    let reason = format!("needs `{need}`, which failed");
    let verdict = CaseVerdict::Skip { reason };
    CaseResult { case: case.name, plugin, what: case.what, verdict, millis: 0 }
}

/// Exit and journal of a case's process.
struct CaseExit {
    /// None if it was ended for taking too long.
    status: Option<ExitStatus>,
    journal: Vec<Entry>,
    panic: Option<String>,
}

/// The exit status, or none after the limit, when the process is killed.
fn wait(child: &mut Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
    let deadline = Instant::now() + limit;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if Instant::now() > deadline {
            kill_group(child);
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(LOOK_PERIOD);
    }
}

fn kill_group(child: &Child) {
    // It may be gone already.
    if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        let _ = kill_process_group(pid, Signal::KILL);
    }
}

/// A verdict, and whether cases that need this one make sense.
fn verdict_of(ended: &CaseExit, limit: Duration) -> (CaseVerdict, bool) {
    let mut findings: Vec<_> = ended
        .journal
        .iter()
        .filter_map(|entry| match entry {
            Entry::Found(finding) => Some(finding.clone()),
            _ => None,
        })
        .collect();
    let calling = ended.journal.iter().rev().find_map(|entry| match entry {
        Entry::Calling(name) => Some(name.as_str()),
        _ => None,
    });
    let place = calling.map_or_else(|| "before any call".into(), |name| format!("in {name}"));
    let last = ended.journal.last();
    let came_to_end = matches!(last, Some(Entry::Ended | Entry::Stopped | Entry::Skipped(_)));
    match ended.status {
        None => findings.push(Finding::new(
            format!("it did not end within {limit:?}: it hangs {place}"),
            "look for endless loops, locks taken twice and waits without a limit",
        )),
        Some(status) if !came_to_end => findings.push(death(status, &place)),
        // Killed on its way out, by what a plugin left behind.
        Some(status) if !status.success() => {
            findings.push(death(status, "at the end of the process"));
        }
        Some(_) => {}
    }
    if let Some(panic) = &ended.panic {
        findings.push(Finding::new(
            format!("it panicked: {panic}"),
            "a panic is caught at the boundary, but is a fault: return an error instead",
        ));
    }
    let sound = ended.status.is_some_and(|status| status.success())
        && matches!(last, Some(Entry::Ended | Entry::Skipped(_)));
    let verdict = match last {
        _ if !findings.is_empty() => CaseVerdict::Fail { findings },
        Some(Entry::Skipped(reason)) => CaseVerdict::Skip { reason: reason.clone() },
        _ => CaseVerdict::Pass,
    };
    (verdict, sound)
}

fn death(status: ExitStatus, place: &str) -> Finding {
    let Some(signal) = status.signal() else {
        let code = status.code().unwrap_or_default();
        return Finding::new(
            format!("it ended the process with exit code {code} {place}"),
            "return an error instead of calling exit",
        );
    };
    let (name, remedy) = match signal {
        4 => ("SIGILL, illegal instruction", "build it for this machine's processor"),
        6 => (
            "SIGABRT, aborted",
            "look for abort, double free, memory that ran out, and panics or exceptions that \
             leave a C function; its output says more",
        ),
        7 => ("SIGBUS, bad address", "look for misaligned access and files cut short"),
        8 => ("SIGFPE, arithmetic", "look for integer division by zero"),
        11 => (
            "SIGSEGV, bad address",
            "look for null and dangling pointers, indices out of bounds, and deep recursion",
        ),
        25 => ("SIGXFSZ, file too large", "write less"),
        _ => ("a signal", "see signal(7)"),
    };
    Finding::new(format!("the process died of signal {signal} ({name}) {place}"), remedy)
}

/// Returns the first panic in the output of a process, in one line.
fn first_panic(output: &Path) -> Option<String> {
    let bytes = std::fs::read(output).ok()?;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_OUTPUT_BYTES)]).into_owned();
    let mut lines = text.lines().skip_while(|line| !line.contains("panicked at "));
    let place = lines.next()?.split("panicked at ").nth(1)?.trim_end_matches(':').to_owned();
    let message = lines.next().unwrap_or_default();
    Some(format!("{message} ({place})"))
}

/// Runs the case that a request names, in a process that is there for nothing else.
/// The exit code to end it with.
pub fn run_case(request: &Path) -> i32 {
    let request = std::fs::read(request).ok().and_then(|text| serde_json::from_slice(&text).ok());
    let Some(request): Option<Request> = request else { return EXIT_UNUSABLE };
    let Some(case) = CASES.iter().find(|case| case.name == request.case) else {
        return EXIT_UNUSABLE;
    };
    limit_resources();
    let sentinels = Sentinels::open();
    let probe = Probe::new(request);
    let outcome = (case.run)(&probe);
    probe.check_environment(&sentinels);
    sentinels.forget();
    match outcome {
        Ok(()) => probe.journal.note(Entry::Ended),
        Err(Stop::Skip(reason)) => probe.journal.note(Entry::Skipped(reason)),
        Err(Stop::Fail(finding)) => {
            probe.find(finding);
            probe.journal.note(Entry::Stopped);
        }
    }
    0
}
