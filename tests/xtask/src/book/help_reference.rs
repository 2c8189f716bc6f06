//! Command-line reference, from the help texts of the program.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, bail};

use crate::process;

const INTRODUCTION: &str = "\
# Command line

`cargo xtask book` generates this page from `busbar --help` and from the help of every verb.
Plugins add verbs of their own (`dga`, `scl`); `busbar plugin list` names them, and
`busbar NAME --help` shows their options.
";
/// Depth of verbs below verbs, such as `plugin new`.
const MAX_DEPTH: usize = 4;

/// Returns the page; each verb of the program has a section.
pub(super) fn page(program: &Path) -> Result<String> {
    let mut page = INTRODUCTION.to_owned();
    let help = help(program, &[])?;
    let common = entries(&help);
    page += &format!("\n## busbar\n\n```text\n{}\n```\n", help.trim());
    add_verbs(program, &help, &[], &common, &mut page)?;
    Ok(page)
}

fn add_verbs(
    program: &Path,
    parent_help: &str,
    parent: &[&str],
    common: &[String],
    page: &mut String,
) -> Result<()> {
    if parent.len() == MAX_DEPTH {
        bail!("verbs are nested deeper than {MAX_DEPTH}");
    }
    for verb in verbs(parent_help) {
        let verb_path: Vec<_> = parent.iter().copied().chain([verb]).collect();
        let help = help(program, &verb_path)?;
        let text = without_entries(&help, common);
        *page += &format!("\n## busbar {}\n\n```text\n{}\n```\n", verb_path.join(" "), text.trim());
        add_verbs(program, &help, &verb_path, common, page)?;
    }
    Ok(())
}

fn help(program: &Path, verb_path: &[&str]) -> Result<String> {
    let output = process::quiet_output(Command::new(program).args(verb_path).arg("--help"))?;
    if !output.status.success() {
        bail!("`busbar {} --help` failed ({})", verb_path.join(" "), output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Returns the verbs that a help text lists, without `help` itself.
fn verbs(help: &str) -> Vec<&str> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let verbs = lines
        .take_while(|line| !line.trim().is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    verbs.filter(|verb| *verb != "help").collect()
}

/// Returns the options of a help text, each with its description.
fn entries(help: &str) -> Vec<String> {
    split_entries(help).into_iter().filter(|(is_option, _)| *is_option).map(|(_, t)| t).collect()
}

/// Returns a help text without options that equal one of `common`.
fn without_entries(help: &str, common: &[String]) -> String {
    let entries = split_entries(help).into_iter();
    let kept = entries.filter(|(is_option, text)| {
        !is_option || !common.iter().any(|option| option.trim_end() == text.trim_end())
    });
    kept.map(|(_, text)| text).collect()
}

/// Splits a help text before each option and each heading; tells which parts are options.
fn split_entries(help: &str) -> Vec<(bool, String)> {
    let mut parts: Vec<(bool, String)> = vec![(false, String::new())];
    for line in help.lines() {
        let is_option = line.trim_start().starts_with('-') && line.starts_with("  ");
        if is_option {
            parts.push((true, String::new()));
        } else if !line.is_empty() && !line.starts_with(' ') {
            parts.push((false, String::new()));
        }
        if let Some((_, part)) = parts.last_mut() {
            *part += line;
            part.push('\n');
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOT: &str = "Shows.\n\nUsage: p <COMMAND>\n\nCommands:\n  view  Show\n  plugin  Look\n  \
                        help  Print\n\nOptions:\n      --log <FILE>\n          Write it here\n\n  -h, \
                        --help\n          Print help\n";
    const VIEW: &str = "Show\n\nOptions:\n      --seconds <S>\n          Close\n\n      --log <FILE>\n          \
                        Write it here\n\n  -h, --help\n          Print help\n";

    #[test]
    fn verbs_are_listed_without_help() {
        assert_eq!(verbs(ROOT), ["view", "plugin"]);
        assert!(verbs(VIEW).is_empty());
    }

    #[test]
    fn options_of_the_program_are_told_once() {
        let text = without_entries(VIEW, &entries(ROOT));
        assert_eq!(text, "Show\n\nOptions:\n      --seconds <S>\n          Close\n\n");
    }
}
