//! Subcommand `busbar plugin new`: a project from the SDK's templates.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::default_directories;
use crate::arguments::{PluginKind, PluginLanguage, PluginNewOptions};
use crate::output;

/// Path of the SDK in the sources that this program was built from.
const BUILT_FROM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../plugins/sdk/sdk");
/// Folder of the C headers, from the SDK. A project has those that it includes in `busbar/`.
const HEADERS: &str = "../abi/include/busbar";
/// Greatest length of a name, letters.
const MAX_NAME: usize = 64;
/// Greatest number of files of a template, and of folder levels.
const MAX_FILES: usize = 64;
const MAX_DEPTH: usize = 8;
/// Reserved words of Rust and C, and words that the templates use.
const RESERVED: [&str; 24] = [
    "abstract", "async", "await", "box", "break", "const", "core", "crate", "default", "enum",
    "extern", "fn", "host", "impl", "main", "match", "mod", "plugin", "self", "static", "std",
    "struct", "super", "test",
];

pub(crate) fn run(options: &PluginNewOptions) -> anyhow::Result<ExitCode> {
    check_name(&options.name)?;
    let sdk = sdk_folder(options.sdk.as_deref())?;
    let parent = options.path.clone().unwrap_or_else(|| PathBuf::from("."));
    let project = parent.join(&options.name);
    if project.symlink_metadata().is_ok() {
        let path = project.display();
        bail!("'{path}' exists already; choose another name, or remove it");
    }
    let files = instantiate(options, &sdk)?;
    // Made beside its place and moved there, so that it appears whole or not at all.
    let unfinished = parent.join(format!(".{}.{}.tmp", options.name, std::process::id()));
    let made = write(&unfinished, &files)
        .and_then(|()| fs::rename(&unfinished, &project))
        .with_context(|| format!("cannot make '{}'; may you write there?", project.display()));
    if made.is_err() {
        let _ = fs::remove_dir_all(&unfinished);
    }
    made?;
    let path = project.display();
    output::result(&format!("{path} is ready: its README.md says how to build, test and run it"));
    Ok(ExitCode::SUCCESS)
}

/// Checks that a name can be a crate, a C identifier and a part of a plugin id.
fn check_name(name: &str) -> anyhow::Result<()> {
    let mut letters = name.chars();
    let good = letters.next().is_some_and(|c| c.is_ascii_lowercase())
        && letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && name.len() <= MAX_NAME;
    if !good {
        bail!(
            "'{name}' is no name for a plugin: use a lower-case letter, then lower-case letters, \
             digits and '_', at most {MAX_NAME}, such as oil_monitor"
        );
    }
    if RESERVED.contains(&name) {
        bail!("'{name}' means something else already; choose another name");
    }
    Ok(())
}

fn sdk_folder(asked: Option<&Path>) -> anyhow::Result<PathBuf> {
    let (folder, remedy) = match asked {
        Some(asked) => (asked, "give the folder `plugins/sdk/sdk` of Busbar's sources"),
        None => (
            Path::new(BUILT_FROM),
            "the sources this program was built from are not there: give Busbar's `plugins/sdk/sdk` \
             with --sdk",
        ),
    };
    let there = folder.join("templates/any").is_dir() && folder.join(HEADERS).is_dir();
    if !there {
        bail!("'{}' is no plugin SDK; {remedy}", folder.display());
    }
    folder.canonicalize().with_context(|| format!("cannot use '{}'; {remedy}", folder.display()))
}

/// File of a project: its path in the project, and its contents.
type NewFile = (PathBuf, Vec<u8>);

/// Instantiates the files of a project from the layers of its template: common files, those of the
/// language, those of the kind, and those of both together.
fn instantiate(options: &PluginNewOptions, sdk: &Path) -> anyhow::Result<Vec<NewFile>> {
    let language = match options.lang {
        PluginLanguage::Rust => "rust",
        PluginLanguage::C => "c",
    };
    let kind = match options.kind {
        PluginKind::Telemetry => "telemetry",
        PluginKind::Overlay => "overlay",
        PluginKind::Optimizer => "optimizer",
    };
    let mut files = Vec::new();
    for layer in ["any", language, kind, &format!("{kind}_{language}")] {
        let folder = sdk.join("templates").join(layer);
        read(&folder, Path::new(""), &mut files)
            .with_context(|| format!("cannot read the template '{}'", folder.display()))?;
    }
    let words = words(options, sdk)?;
    for (path, bytes) in &mut files {
        let Ok(mut text) = String::from_utf8(std::mem::take(bytes)) else {
            bail!("the template file '{}' is not UTF-8; is the SDK whole?", path.display());
        };
        for (word, value) in &words {
            text = text.replace(word, value);
        }
        *bytes = text.into_bytes();
    }
    add_headers(&sdk.join(HEADERS), &mut files)?;
    Ok(files)
}

/// Adds the headers that files of a project include, and those that they include in turn.
fn add_headers(folder: &Path, files: &mut Vec<NewFile>) -> anyhow::Result<()> {
    let mut at = 0;
    while let Some((_, bytes)) = files.get(at) {
        for name in included_headers(&String::from_utf8_lossy(bytes)) {
            let path = Path::new("busbar").join(&name);
            if files.iter().any(|(known, _)| *known == path) {
                continue;
            }
            let header = folder.join(&name);
            let text = fs::read(&header).with_context(|| format!("cannot read {header:?}"))?;
            files.push((path, text));
        }
        at += 1;
    }
    Ok(())
}

/// Returns the names of the headers of the plugin ABI that a source includes.
fn included_headers(source: &str) -> Vec<String> {
    let names = source.lines().filter_map(|line| line.trim().strip_prefix("#include <busbar/"));
    names.filter_map(|name| name.strip_suffix('>')).map(str::to_owned).collect()
}

/// Returns the placeholders of the templates, with their values in this project.
fn words(options: &PluginNewOptions, sdk: &Path) -> anyhow::Result<[(&'static str, String); 5]> {
    let utf8 = |path: &Path| {
        path.to_str()
            .map(str::to_owned)
            .with_context(|| format!("'{}' is not UTF-8", path.display()))
    };
    let plugins = default_directories()?.swap_remove(0);
    let library = match options.lang {
        PluginLanguage::Rust => "target/debug",
        PluginLanguage::C => "build",
    };
    Ok([
        ("my_plugin", options.name.clone()),
        ("MyPlugin", camel_case(&options.name)),
        ("SDK_PATH", utf8(sdk)?),
        ("BUSBAR_PLUGINS", utf8(&plugins)?),
        ("LIBRARY_FOLDER", library.to_owned()),
    ])
}

fn camel_case(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        let first = letters.next().map(|c| c.to_ascii_uppercase());
        first.into_iter().chain(letters).collect::<String>()
    };
    name.split('_').map(word).collect()
}

/// Reads a folder with all below it. `x.in` becomes `x`, and `gitignore` `.gitignore`: their
/// original names would affect the template itself.
fn read(folder: &Path, below: &Path, files: &mut Vec<NewFile>) -> anyhow::Result<()> {
    if below.components().count() > MAX_DEPTH {
        bail!("its folders are nested more than {MAX_DEPTH} deep");
    }
    for entry in fs::read_dir(folder.join(below))? {
        let entry = entry?;
        let path = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            read(folder, &path, files)?;
            continue;
        }
        if files.len() >= MAX_FILES {
            bail!("it has more than {MAX_FILES} files");
        }
        let name = match path.file_name().and_then(|name| name.to_str()) {
            Some("gitignore.in") => path.with_file_name(".gitignore"),
            Some(name) => path.with_file_name(name.strip_suffix(".in").unwrap_or(name)),
            None => bail!("a file's name is not UTF-8"),
        };
        files.push((name, fs::read(folder.join(&path))?));
    }
    Ok(())
}

fn write(project: &Path, files: &[NewFile]) -> std::io::Result<()> {
    fs::create_dir_all(project)?;
    for (path, bytes) in files {
        let path = project.join(path);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(path, bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The headers of the sources that this test was built from.
    #[test]
    fn headers_are_added_with_those_that_they_include() {
        let source = b"#include <stdint.h>\n#include <busbar/simulator.h>\n".to_vec();
        let mut files = vec![(PathBuf::from("plugin.c"), source)];
        let folder = Path::new(BUILT_FROM).join(HEADERS);
        add_headers(&folder, &mut files).expect("all headers are there");
        let mut names: Vec<_> = files.iter().map(|(path, _)| path.display().to_string()).collect();
        names.sort_unstable();
        let needed = ["plugin.h", "simulator.h", "telemetry.h", "values.h"];
        let needed = needed.map(|name| format!("busbar/{name}"));
        assert_eq!(names, [&needed[..], &["plugin.c".to_owned()]].concat());
        let unknown = b"#include <busbar/nothing.h>\n".to_vec();
        assert!(add_headers(&folder, &mut vec![(PathBuf::from("plugin.c"), unknown)]).is_err());
    }

    #[test]
    fn names_are_checked() {
        assert!(["a", "oil_monitor", "x2"].iter().all(|name| check_name(name).is_ok()));
        let long = "a".repeat(MAX_NAME + 1);
        for name in ["", "2x", "_x", "Oil", "oil-monitor", "a/b", "..", "öl", "std", &long] {
            assert!(check_name(name).is_err(), "{name}");
        }
        assert_eq!(camel_case("oil_monitor_2x"), "OilMonitor2x");
    }
}
