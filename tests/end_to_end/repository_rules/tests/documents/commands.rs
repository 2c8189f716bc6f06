//! Command lines in documents, judged by the help texts of the programs that they start.

use std::collections::BTreeMap;
use std::fmt;
use std::process::Command;

use e2e::{built, built_folder, busbar, finish};

use crate::repository::Repository;

/// Verbs of cargo that take a package and a target.
const CARGO_VERBS: [&str; 6] = ["bench", "build", "doc", "nextest", "run", "test"];
/// Options of cargo that name a target, and the kind of it.
const TARGETS: [(&str, &str); 2] = [("--test", "test"), ("--example", "example")];

/// Text in the help of every name that is no verb of the program: plugins may offer it.
const HELP_OF_PLUGIN_VERBS: &str = "Further arguments for the command";

/// Verbs of plugins that documents take as examples.
const EXAMPLE_VERBS: [&str; 1] = ["count"];

/// One command of a shell line, split into words.
pub(crate) struct CommandLine(Vec<String>);

impl fmt::Display for CommandLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0.join(" "))
    }
}

/// Help texts by program and verb.
#[derive(Default)]
pub(crate) struct Help(BTreeMap<Vec<String>, Option<String>>);

impl Help {
    /// Returns the help of a verb; nothing where there is no such verb.
    fn of_verb(&mut self, verb: &[String]) -> Option<&str> {
        let entry = self.0.entry(verb.to_vec()).or_insert_with(|| {
            let (program, words) = verb.split_first()?;
            let mut command = match program.as_str() {
                "busbar" => busbar(),
                _ => Command::new(built(built_folder().join("xtask"))),
            };
            let output = finish(command.args(words).arg("--help"));
            let is_there = output.code == Some(0)
                && (!output.stdout.contains(HELP_OF_PLUGIN_VERBS) || is_plugin_verb(words));
            is_there.then_some(output.stdout)
        });
        entry.as_deref()
    }
}

impl CommandLine {
    /// Returns the commands of a shell text that start Busbar's programs or cargo.
    pub(crate) fn of_shell(text: &str) -> Vec<Self> {
        let text = text.replace("\\\n", " ");
        let commands = text.lines().flat_map(split);
        commands.filter_map(|words| Self::starting_with_a_program(&words)).collect()
    }

    fn starting_with_a_program(words: &[String]) -> Option<Self> {
        let is_assignment = |word: &&String| {
            word.split_once('=').is_some_and(|(name, _)| {
                !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_')
            })
        };
        let words: Vec<_> = words.iter().skip_while(is_assignment).cloned().collect();
        let (program, rest) = words.split_first()?;
        let is_ours = program == "busbar" || program.ends_with("/busbar");
        let program = if is_ours { "busbar".to_owned() } else { program.clone() };
        // Prose names programs by a word of code alone.
        let starts_something = !rest.is_empty() && (is_ours || program == "cargo");
        starts_something.then(|| Self([program].into_iter().chain(rest.iter().cloned()).collect()))
    }

    /// Returns what follows `busbar`.
    pub(crate) fn busbar_arguments(&self) -> Option<&[String]> {
        self.0.split_first().filter(|(program, _)| *program == "busbar").map(|(_, rest)| rest)
    }

    /// Returns what is wrong with the command, if anything is.
    pub(crate) fn fault(&self, help: &mut Help, repository: &Repository) -> Option<String> {
        match self.0.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["cargo", "xtask", ..] => {
                let words: Vec<_> = std::iter::once("xtask".to_owned())
                    .chain(self.0[2..].iter().cloned())
                    .collect();
                verb_fault(&words, help)
            }
            ["cargo", verb, ..] if CARGO_VERBS.contains(&verb) => self.cargo_fault(repository),
            ["cargo", ..] => None,
            _ => verb_fault(&self.0, help),
        }
    }

    fn cargo_fault(&self, repository: &Repository) -> Option<String> {
        let own: Vec<_> = self.0.iter().take_while(|word| *word != "--").collect();
        let values = |names: &[&str]| -> Vec<&str> {
            let pairs = own.windows(2).filter(|pair| names.contains(&pair[0].as_str()));
            pairs.map(|pair| pair[1].as_str()).collect()
        };
        let packages = values(&["-p", "--package"]);
        let packages = packages.into_iter().filter(|package| !is_placeholder(package));
        for package in packages.clone() {
            if !repository.has(package, None) {
                return Some(format!("there is no package {package}"));
            }
        }
        for (option, kind) in TARGETS {
            for name in values(&[option]) {
                let found = match packages.clone().next() {
                    Some(package) => repository.has(package, Some((kind, name))),
                    // Without a package, examples are those of the reader's project.
                    None => kind == "example" || repository.has_test(name),
                };
                if !found {
                    return Some(format!("there is no {kind} {name}"));
                }
            }
        }
        None
    }
}

/// Reports whether a plugin offers a verb.
fn is_plugin_verb(words: &[String]) -> bool {
    let list = finish(busbar().args(["plugin", "list"])).expect_code(0);
    list.stdout.contains(&format!("busbar {}:", words.join(" ")))
}

/// Returns what is wrong with a verb or its options.
fn verb_fault(words: &[String], help: &mut Help) -> Option<String> {
    let mut verb = vec![words[0].clone()];
    let mut text = help.of_verb(&verb)?.to_owned();
    let mut rest = &words[1..];
    while text.contains("\nCommands:\n") {
        let Some((next, others)) = rest.split_first() else { break };
        if next.starts_with('-') {
            break;
        }
        if is_placeholder(next) || EXAMPLE_VERBS.contains(&next.as_str()) {
            return None;
        }
        verb.push(next.clone());
        let Some(found) = help.of_verb(&verb) else {
            return Some(format!("there is no verb `{}`", verb.join(" ")));
        };
        text = found.to_owned();
        rest = others;
    }
    let options = rest.iter().take_while(|word| *word != "--").filter(|w| w.starts_with("--"));
    for option in options {
        let option = option.split('=').next().unwrap_or_default();
        let mut known = text.split(|c: char| c.is_whitespace() || ",[]=".contains(c));
        if option != "--help" && !known.any(|word| word == option) {
            return Some(format!("`{}` has no option {option}", verb.join(" ")));
        }
    }
    None
}

/// Reports whether a word stands for what the reader chooses, such as `NAME` or `...`.
fn is_placeholder(word: &str) -> bool {
    word.chars().all(|c| c.is_ascii_uppercase() || "_.…".contains(c))
}

/// Splits a shell line into commands, and these into words; comments are left out.
fn split(line: &str) -> Vec<Vec<String>> {
    let mut commands = vec![Vec::new()];
    let mut word = String::new();
    let mut quote = None;
    let end_word = |word: &mut String, commands: &mut Vec<Vec<String>>| {
        if !word.is_empty() {
            commands.last_mut().expect("there is a command").push(std::mem::take(word));
        }
    };
    for character in line.chars() {
        match (quote, character) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), c) => word.push(c),
            (None, '\'' | '"') => quote = Some(character),
            (None, '#') if word.is_empty() => break,
            (None, '&' | '|' | ';' | '(' | ')' | '>') => {
                end_word(&mut word, &mut commands);
                commands.push(Vec::new());
            }
            (None, c) if c.is_whitespace() => end_word(&mut word, &mut commands),
            (None, c) => word.push(c),
        }
    }
    end_word(&mut word, &mut commands);
    commands
}

#[test]
fn lines_are_split_as_a_shell_does() {
    let lines = CommandLine::of_shell(
        "A_B=1 busbar render x \\\n  --out 'a b.png' & # busbar no\ncd y && cargo test; ls\nbusbar\n",
    );
    let lines: Vec<_> = lines.iter().map(ToString::to_string).collect();
    assert_eq!(lines, ["busbar render x --out a b.png", "cargo test"]);
}

#[test]
fn wrong_commands_are_found() {
    let repository = Repository::find();
    let mut help = Help::default();
    for (line, expected) in [
        ("busbar vieww x.json", Some("there is no verb `busbar vieww`")),
        ("busbar view x.json --kiosky", Some("`busbar view` has no option --kiosky")),
        ("busbar plugin lst", Some("there is no verb `busbar plugin lst`")),
        ("busbar view x.json --seconds 8 -- --kiosky", None),
        ("busbar NAME FILE", None),
        ("cargo xtask tset", Some("there is no verb `xtask tset`")),
        ("cargo xtask soak --target x", None),
        ("cargo run -p no_such", Some("there is no package no_such")),
        ("cargo test -p repository_rules --test no_such", Some("there is no test no_such")),
        ("cargo test -p repository_rules --test documents", None),
    ] {
        let lines = CommandLine::of_shell(line);
        assert_eq!(lines[0].fault(&mut help, &repository).as_deref(), expected, "{line}");
    }
}
