//! Environment variables passed to a plugin's process.

use std::collections::BTreeSet;
use std::process::Command;

use serde_json::Value;

/// Variables passed to every plugin's process. Variables that direct the loader
/// (`LD_LIBRARY_PATH`, `LD_PRELOAD`) are not among them.
const ALWAYS: [&str; 9] = [
    "HOME",
    "LANG",
    "LC_ALL",
    "PATH",
    "RUST_BACKTRACE",
    "SSL_CERT_DIR",
    "SSL_CERT_FILE",
    "TZ",
    "BUSBAR_LOG",
];
/// Prefixes of variables that direct the loader or the allocator of a process; these are never
/// passed on.
const NEVER: [&str; 4] = ["LD_", "GLIBC_", "GCONV_", "MALLOC_"];
/// Variables that the settings of one instance can refer to.
const MAX_REFERENCES: usize = 16;
/// The key of an object in settings that refers to a variable.
const REFERENCE: &str = "env";

/// The variables that one instance's process sees besides.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Environment(BTreeSet<String>);

impl Environment {
    /// Collects the variables that settings refer to by `{"env": "NAME"}`, at any depth.
    ///
    /// # Errors
    /// When a reference cannot be followed: which, why, and what to do.
    pub(crate) fn of_settings(settings: &Value) -> Result<Self, String> {
        let mut names = BTreeSet::new();
        collect(settings, &mut names);
        if let Some(name) = names.iter().find(|name| NEVER.iter().any(|n| name.starts_with(n))) {
            return Err(format!(
                "the settings refer to the environment variable {name}, which is not handed to \
                 plugins: it directs how programs are loaded; use another name"
            ));
        }
        if names.len() > MAX_REFERENCES {
            return Err(format!(
                "the settings refer to {} environment variables; at most {MAX_REFERENCES} are \
                 handed to a plugin: use files instead",
                names.len()
            ));
        }
        Ok(Self(names))
    }

    /// Restricts a command's environment to these variables.
    pub(crate) fn apply(&self, command: &mut Command) {
        command.env_clear();
        for name in ALWAYS.into_iter().chain(self.0.iter().map(String::as_str)) {
            if let Some(value) = std::env::var_os(name) {
                command.env(name, value);
            }
        }
    }
}

/// Gathers the names in all references. How deep settings go is limited where their text
/// is read.
fn collect(settings: &Value, names: &mut BTreeSet<String>) {
    match settings {
        Value::Object(fields) => {
            if let (1, Some(Value::String(name))) = (fields.len(), fields.get(REFERENCE))
                && is_name(name)
            {
                names.insert(name.clone());
            }
            fields.values().for_each(|value| collect(value, names));
        }
        Value::Array(items) => items.iter().for_each(|item| collect(item, names)),
        _ => {}
    }
}

/// Reports whether a text can name a variable (POSIX.1-2024, Base Definitions 3.216).
fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn names(settings: Value) -> Vec<String> {
        Environment::of_settings(&settings).unwrap().0.into_iter().collect()
    }

    #[test]
    fn references_are_found_wherever_they_are() {
        let settings = json!({
            "password": {"env": "PG_PASSWORD"},
            "ways": [{"token": {"env": "TOKEN_2"}}, {"token": {"env": "TOKEN_2"}}],
            "file": {"file": "/run/secret"},
        });
        assert_eq!(names(settings), ["PG_PASSWORD", "TOKEN_2"]);
    }

    #[test]
    fn only_references_are_followed() {
        let settings = json!({
            "env": {"A": "B"},
            "one": {"env": 5},
            "two": {"env": "A B"},
            "three": {"env": "A=B"},
            "four": {"env": ""},
            "five": {"env": "NAME", "and": "more"},
            "six": "PATH",
        });
        assert_eq!(names(settings), [""; 0]);
    }

    #[test]
    fn what_directs_the_loader_is_refused() {
        for name in ["LD_PRELOAD", "LD_LIBRARY_PATH", "GLIBC_TUNABLES", "MALLOC_ARENA_MAX"] {
            let fault = Environment::of_settings(&json!([{"env": name}])).unwrap_err();
            assert!(fault.contains(name) && fault.contains("another name"), "{fault}");
        }
    }

    #[test]
    fn there_is_a_limit() {
        let settings = |count: usize| {
            (0..count).map(|number| json!({"env": format!("A{number}")})).collect::<Value>()
        };
        assert_eq!(names(settings(MAX_REFERENCES)).len(), MAX_REFERENCES);
        let fault = Environment::of_settings(&settings(MAX_REFERENCES + 1)).unwrap_err();
        assert!(fault.contains("at most 16"), "{fault}");
    }

    #[test]
    fn a_process_gets_no_other_variable() {
        // PATH is always handed on; the others are set for every test by Cargo.
        let environment =
            Environment::of_settings(&json!({"password": {"env": "CARGO_PKG_NAME"}})).unwrap();
        let mut command = Command::new("env");
        command.env("SET_BEFORE", "1");
        environment.apply(&mut command);
        let output = String::from_utf8(command.output().unwrap().stdout).unwrap();
        let seen: Vec<_> =
            output.lines().filter_map(|line| Some(line.split_once('=')?.0)).collect();
        assert!(seen.contains(&"CARGO_PKG_NAME") && seen.contains(&"PATH"), "{seen:?}");
        let known = |name: &&str| ALWAYS.contains(name) || *name == "CARGO_PKG_NAME";
        assert!(seen.iter().all(known), "{seen:?}");
    }
}
