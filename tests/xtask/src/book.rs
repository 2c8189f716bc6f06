//! `book`: the manual, generated, built by mdBook and link-checked.

mod configuration_reference;
mod help_reference;
mod html_links;
mod sdk_chapters;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process;
use crate::workspace::{Profile, Workspace};

/// Folder of the book's sources.
const BOOK: &str = "host/app/busbar/book";
/// Folder of chapters that are generated and not committed.
const GENERATED: &str = "host/app/busbar/book/src/generated";
/// Folder of the built book.
const BUILT: &str = "target/book";
/// Version requirement of mdBook.
const MDBOOK: &str = "mdbook@^0.4";
/// JSON Schema of configurations.
const SCHEMA: &str = "config/busbar.schema.json";
/// Folder of the SDK's chapters, which its crate documentation contains too.
const SDK_CHAPTERS: &str = "plugins/sdk/sdk/src/book";
/// Environment variable that turns skipped steps into failures.
const REQUIRE: &str = "BUSBAR_REQUIRE_PEERS";
/// Most lines of mdBook's output that are searched for faults.
const MAX_OUTPUT_LINES: usize = 1024;

/// Options of the command `book`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Write the generated chapters and build nothing.
    #[arg(long)]
    generate: bool,
}

/// Runs the command; mdBook must be there or be installable.
pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    process::run(process::cargo().current_dir(&workspace.root).args([
        "build",
        "--package",
        "busbar",
    ]))?;
    generate(workspace)?;
    if arguments.generate {
        return Ok(());
    }
    let mdbook = install(workspace)?;
    build(workspace, &mdbook)
}

/// Builds the book in CI, where the program is built already. Without mdBook the step is
/// skipped with a message, unless `BUSBAR_REQUIRE_PEERS` is `1`.
pub(crate) fn build_or_skip(workspace: &Workspace) -> Result<()> {
    generate(workspace)?;
    match install(workspace) {
        Ok(mdbook) => build(workspace, &mdbook),
        Err(error) if std::env::var_os(REQUIRE).is_none_or(|value| value != "1") => {
            println!("SKIPPED: mdBook cannot be installed, so the book is not built: {error:#}");
            Ok(())
        }
        Err(error) => Err(error),
    }
}

/// Writes the chapters that are generated from schema, help texts and SDK.
fn generate(workspace: &Workspace) -> Result<()> {
    let folder = workspace.path(GENERATED);
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            return Err(error).with_context(|| format!("cannot replace {}", folder.display()));
        }
        _ => {}
    }
    let schema = read(&workspace.path(SCHEMA))?;
    let schema = serde_json::from_str(&schema).with_context(|| format!("cannot read {SCHEMA}"))?;
    write(&folder.join("configuration.md"), &configuration_reference::page(&schema)?)?;
    let program = workspace.program(Profile::Dev, "busbar");
    write(&folder.join("command_line.md"), &help_reference::page(&program)?)?;
    let chapters = workspace.path(SDK_CHAPTERS);
    let list =
        fs::read_dir(&chapters).with_context(|| format!("cannot list {}", chapters.display()))?;
    for entry in list {
        let path = entry.with_context(|| format!("cannot list {}", chapters.display()))?.path();
        if let Some(name) = path.file_name().filter(|_| path.extension().is_some_and(|e| e == "md"))
        {
            write(&folder.join("sdk").join(name), &sdk_chapters::page(&read(&path)?))?;
        }
    }
    Ok(())
}

/// Returns the path of mdBook, which is installed below the target folder where it is missing.
fn install(workspace: &Workspace) -> Result<PathBuf> {
    let tools = workspace.tools();
    let mdbook = tools.join("bin/mdbook");
    if !process::succeeds(Command::new(&mdbook).arg("--version")) {
        let mut command = process::cargo();
        command.args(["install", "--locked", "--root"]).arg(&tools).arg(MDBOOK);
        process::run(&mut command).context("cannot install mdBook from crates.io")?;
    }
    Ok(mdbook)
}

/// Builds the book and checks each link of its pages.
fn build(workspace: &Workspace, mdbook: &Path) -> Result<()> {
    let built = workspace.path(BUILT);
    let mut command = Command::new(mdbook);
    command.arg("build").arg(workspace.path(BOOK)).arg("--dest-dir").arg(&built);
    let (status, faults) = process::run_and_keep(&mut command, MAX_OUTPUT_LINES, is_fault)?;
    // A missing include is a line in the log, and no failure of mdBook.
    if !status.success() || !faults.is_empty() {
        bail!("mdBook reports faults ({status}):\n{}", faults.join("\n"));
    }
    let (pages, broken) = html_links::check(&built)?;
    if !broken.is_empty() {
        bail!("broken links of the book:\n{}", broken.join("\n"));
    }
    println!("{pages} pages, no broken link: {}", built.join("index.html").display());
    Ok(())
}

/// Reports whether a line of mdBook's output tells a fault.
fn is_fault(line: &str) -> bool {
    line.contains("[ERROR]") || line.contains("[WARN]")
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<()> {
    let folder = path.parent().context("a chapter is in a folder")?;
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(path, text))
        .with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_warnings_of_mdbook_are_faults() {
        assert!(is_fault("2026-11-26 12:00:00 [ERROR] (mdbook::preprocess): no such file"));
        assert!(is_fault("2026-11-26 12:00:00 [WARN] (mdbook::book): odd"));
        assert!(!is_fault("2026-11-26 12:00:00 [INFO] (mdbook::book): Book building has started"));
    }

    #[test]
    fn the_schema_and_each_sdk_chapter_make_pages() {
        let workspace = Workspace::find().unwrap();
        let schema = serde_json::from_str(&read(&workspace.path(SCHEMA)).unwrap()).unwrap();
        let page = configuration_reference::page(&schema).unwrap();
        for part in ["## The file", "## Graphics", "`plugin_directories`"] {
            assert!(page.contains(part), "{part}");
        }
        let mut chapters = 0;
        for entry in fs::read_dir(workspace.path(SDK_CHAPTERS)).unwrap() {
            let page = sdk_chapters::page(&read(&entry.unwrap().path()).unwrap());
            assert!(page.starts_with("# ") && !page.contains("](crate::"), "{page}");
            chapters += 1;
        }
        assert!(chapters > 10, "{chapters} chapters");
    }
}
