//! The header is generated from this crate, compiles as C99 and C++17 without a warning, has
//! the same layout there, and the library exports what it declares: the list that is kept.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::Command;

use busbar::abi::*;

fn crate_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Compares a kept file with what it is to be; `BUSBAR_BLESS=1` writes it anew.
fn check_kept(name: &str, wanted: &str) {
    let path = crate_dir().join(name);
    if std::env::var_os("BUSBAR_BLESS").is_some() {
        std::fs::write(&path, wanted).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == wanted, "run the test with BUSBAR_BLESS=1 and commit {name}:\n{wanted}");
}

#[test]
fn header_is_up_to_date() {
    let config = cbindgen::Config::from_file(crate_dir().join("cbindgen.toml")).unwrap();
    let builder = cbindgen::Builder::new().with_crate(crate_dir()).with_config(config);
    let mut generated = Vec::new();
    builder.generate().unwrap().write(&mut generated);
    check_kept(
        "include/busbar.h",
        &without_safety_sections(&String::from_utf8(generated).unwrap()),
    );
}

/// Removes the sections that tell Rust what the header's first comment tells all callers.
fn without_safety_sections(header: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    let mut is_safety = false;
    for line in header.lines() {
        is_safety = line == "// # Safety" || (is_safety && line.starts_with("//"));
        if line == "// # Safety" && kept.last() == Some(&"//") {
            kept.pop();
        }
        if !is_safety {
            kept.push(line);
        }
    }
    format!("{}\n", kept.join("\n"))
}

fn compile(arguments: &[&str], source: &Path) {
    let output = Command::new(arguments[0])
        .args(&arguments[1..])
        .args(["-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only"])
        .arg("-I")
        .arg(crate_dir().join("include"))
        .arg(source)
        .output()
        .unwrap_or_else(|error| panic!("{arguments:?}: {error}; install gcc and g++"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn header_alone_compiles_as_c_and_cpp() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, name) in [
        (["gcc", "-std=c99"], "alone.c"),
        (["gcc", "-std=c17"], "alone.c"),
        (["g++", "-std=c++17"], "alone.cc"),
    ] {
        let source = folder.path().join(name);
        std::fs::write(&source, "#include <busbar.h>\nextern int only_the_header;\n").unwrap();
        compile(&arguments, &source);
    }
}

#[test]
fn layout_is_the_same_in_c_and_cpp() {
    let mut c = String::from("#include <busbar.h>\n");
    c += "#ifdef __cplusplus\n#define SAME(a, b) static_assert((a) == (b), #a)\n";
    c += "#else\n#define SAME(a, b) _Static_assert((a) == (b), #a)\n#endif\n";
    macro_rules! same {
        ($($name:ident { $($field:ident),* })*) => {$(
            c += &format!("SAME(sizeof({0}), {1});\n", stringify!($name), size_of::<$name>());
            $(c += &format!("SAME(offsetof({0}, {1}), {2});\n",
                stringify!($name), stringify!($field), offset_of!($name, $field));)*
        )*};
    }
    same! {
        BusbarViewOptions { struct_size, flags, width, height, window_system, silent_millis,
            hung_millis, max_restart_millis, window, config, program, operator_name }
        BusbarViewEvent { struct_size, kind, dropped, liveness, alarm_state, alarm_action,
            shelve_seconds, quality, origins, verdict, is_assumed, reserved, unix_nanos, eye,
            target, id, overlay, text }
        BusbarViewFrame { struct_size, liveness, width, height, stride, damage_x, damage_y,
            damage_width, damage_height, age_millis, sequence, pixels }
        BusbarViewTag { id, kind, quality, source_unix_nanos, number, integer }
    }
    let folder = tempfile::tempdir().unwrap();
    for (arguments, name) in
        [(["gcc", "-std=c11"], "layout.c"), (["g++", "-std=c++17"], "layout.cc")]
    {
        let source = folder.path().join(name);
        std::fs::write(&source, &c).unwrap();
        compile(&arguments, &source);
    }
}

/// Returns the library as Cargo built it.
fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.ancestors().nth(2).unwrap().join("libbusbar.so")
}

#[test]
fn the_library_is_named_by_the_version_of_its_interface() {
    let mut readelf = Command::new("readelf");
    let output = readelf.env("LC_ALL", "C").arg("-d").arg(library()).output();
    let output = output.expect("readelf runs; install binutils");
    let listed = String::from_utf8(output.stdout).unwrap();
    let name = listed.lines().find(|line| line.contains("(SONAME)"));
    let wanted = format!("[libbusbar.so.{}]", env!("CARGO_PKG_VERSION_MAJOR"));
    assert!(name.is_some_and(|name| name.ends_with(&wanted)), "{listed}");
}

#[test]
fn the_library_exports_what_is_kept_and_no_more() {
    let library = library();
    let mut nm = Command::new("nm");
    let output = nm.args(["-D", "--defined-only", "--format=posix"]).arg(&library).output();
    let output = output.expect("nm runs; install binutils");
    let listed = String::from_utf8(output.stdout).unwrap();
    let names = listed.lines().filter_map(|line| line.split(' ').next());
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    assert!(!names.is_empty(), "{} is missing: run `cargo xtask test`", library.display());
    check_kept("symbols.txt", &format!("{}\n", names.join("\n")));
    let header = std::fs::read_to_string(crate_dir().join("include/busbar.h")).unwrap();
    for name in names {
        assert!(header.contains(&format!("{name}(")), "{name} is not in the header");
    }
}

#[test]
fn the_package_names_the_version() {
    let package = std::fs::read_to_string(crate_dir().join("busbar.pc")).unwrap();
    assert!(package.contains(&format!("Version: {}\n", env!("CARGO_PKG_VERSION"))));
}
