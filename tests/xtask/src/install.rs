//! `install`: what a program that embeds a viewer is built and run with, below a prefix.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::stage::{build_packages, copy_whole, replace_libraries};
use crate::workspace::{Profile, Workspace};

/// Package of the viewer's program, and that of the library for embedding.
const PROGRAM: &str = "busbar";
const LIBRARY_PACKAGE: &str = "busbar_embed";
/// Name of the shared library.
const LIBRARY: &str = "busbar";
/// Path of the development link, by which programs are linked with the library.
const LINK_NAME: &str = "lib/libbusbar.so";
/// Name of the library at run time (SONAME).
const RUN_NAME: &str = concat!("libbusbar.so.", env!("CARGO_PKG_VERSION_MAJOR"));
/// Folder of plugins, as configurations name it.
const PLUGINS: &str = "lib/busbar/plugins";

/// Command-line options of `install`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder that gets bin, include and lib.
    #[arg(long)]
    prefix: PathBuf,
    /// Cargo profile to build with.
    #[arg(long, value_enum, default_value = "release")]
    profile: Profile,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let Arguments { prefix, profile } = arguments;
    let plugins = workspace.plugins.iter().map(String::as_str);
    build_packages(workspace, *profile, [PROGRAM, LIBRARY_PACKAGE].into_iter().chain(plugins))?;
    for (from, to) in files(workspace, *profile) {
        put(&from, &prefix.join(to))?;
    }
    put(&workspace.library(*profile, LIBRARY), &prefix.join("lib").join(RUN_NAME))?;
    link(&prefix.join(LINK_NAME))?;
    let plugins = workspace.plugins.iter().map(|name| workspace.library(*profile, name));
    replace_libraries(&prefix.join(PLUGINS), &plugins.collect::<Vec<_>>())?;
    println!("installed below {}; plugins are in {PLUGINS}", prefix.display());
    println!("PKG_CONFIG_PATH={}", prefix.join("lib/pkgconfig").display());
    Ok(())
}

/// Lists each file with its path below the prefix.
fn files(workspace: &Workspace, profile: Profile) -> [(PathBuf, &'static str); 6] {
    let library = workspace.library(profile, LIBRARY);
    [
        (workspace.program(profile, PROGRAM), "bin/busbar"),
        (workspace.path("host/remote/embed/include/busbar.h"), "include/busbar.h"),
        (workspace.path("host/remote/embed/busbar.pc"), "lib/pkgconfig/busbar.pc"),
        (workspace.path("config/busbar-kiosk.service"), "lib/systemd/system/busbar-kiosk.service"),
        (workspace.path("config/busbar-serve.service"), "lib/systemd/system/busbar-serve.service"),
        (library.with_extension("a"), "lib/libbusbar.a"),
    ]
}

/// Puts a link to [`RUN_NAME`] in place of whatever is there.
fn link(at: &Path) -> Result<()> {
    let removed = std::fs::remove_file(at);
    let is_free = removed.or_else(|error| match error.kind() {
        std::io::ErrorKind::NotFound => Ok(()),
        _ => Err(error),
    });
    let linked = is_free.and_then(|()| std::os::unix::fs::symlink(RUN_NAME, at));
    linked.with_context(|| format!("cannot write {}: may you?", at.display()))
}

fn put(from: &Path, to: &Path) -> Result<()> {
    let folder = to.parent().context("a path below the prefix")?;
    let made = std::fs::create_dir_all(folder).and_then(|()| copy_whole(from, to));
    made.with_context(|| {
        let (from, to) = (from.display(), to.display());
        format!("cannot copy {from} to {to}: was it built, and may you write there?")
    })
}
