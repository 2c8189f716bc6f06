//! Selection of plugin libraries: those that are loaded, and messages about those that are not.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use e2e::faulty_plugins::FaultyPluginScene;
use e2e::{busbar, finish};
use serde_json::json;

/// Digest of another file.
const NO_DIGEST: &str = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08";

fn trouble() -> FaultyPluginScene {
    FaultyPluginScene::with_plugin("trouble.steady")
}

#[track_caller]
fn assert_loads(trouble: &FaultyPluginScene) {
    finish(busbar().arg("check").arg(trouble.write())).expect_code(0);
}

/// Checks that each way to run plugins refuses them in the same words.
#[track_caller]
fn assert_refused(trouble: &mut FaultyPluginScene, words: &[&str]) {
    for isolation in ["process", "none"] {
        trouble.config["isolation"] = json!(isolation);
        let output = finish(busbar().arg("check").arg(trouble.write())).expect_code(1);
        for word in words.iter().chain(&["remedy: "]) {
            assert!(output.stderr.contains(word), "no '{word}' in: {}", output.stderr);
        }
    }
    trouble.config["isolation"] = json!("process");
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("it is ours");
}

#[test]
fn a_library_that_everybody_may_write_to() {
    let mut trouble = trouble();
    let library = trouble.library();
    set_mode(&library, 0o777);
    assert_refused(&mut trouble, &["refused", "libtrouble.so", "chmod o-w"]);
    set_mode(&library, 0o755);
    assert_loads(&trouble);
    set_mode(&trouble.path("plugins"), 0o777);
    assert_refused(&mut trouble, &["refused", "plugins", "chmod o-w"]);
}

#[test]
fn a_link_out_of_the_plugin_directory() {
    let mut trouble = trouble();
    let elsewhere = trouble.path("elsewhere.so");
    fs::rename(trouble.library(), &elsewhere).expect("it is ours");
    symlink(&elsewhere, trouble.library()).expect("it is ours");
    assert_refused(&mut trouble, &["refused", "a link out of its directory", "elsewhere.so"]);
}

#[test]
fn a_library_of_other_contents_than_those_pinned() {
    let mut trouble = trouble();
    trouble.config["plugins"]["trouble"]["sha256"] = json!(NO_DIGEST);
    let sum = finish(Command::new("sha256sum").arg(trouble.library())).expect_code(0);
    let digest = sum.stdout.split(' ').next().expect("a digest").to_owned();
    assert_refused(&mut trouble, &["refused", "\"sha256\"", &digest]);
    // Beside a plugin without a pin it is known, and refused by name.
    trouble.config["plugins"]["other"] = json!({ "plugin": "trouble.echo" });
    trouble.config["overlays"] = json!(["other"]);
    assert_refused(&mut trouble, &["(at /plugins/trouble/sha256)", &digest]);
    trouble.config["plugins"]["trouble"]["sha256"] = json!(digest);
    assert_loads(&trouble);
}

#[test]
fn a_library_that_the_site_has_not_signed() {
    let mut trouble = trouble();
    let key = trouble.path("site.pem");
    let mut openssl = Command::new("openssl");
    openssl.args(["genpkey", "-algorithm", "ed25519", "-out"]).arg(&key);
    finish(&mut openssl).expect_code(0);
    set_mode(&key, 0o600);
    trouble.config["signature"] = json!({ "public_key": format!("02{}", "0".repeat(62)) });
    assert_refused(&mut trouble, &["(at /signature/public_key)", "this is no public key"]);

    let sign = || {
        let mut command = busbar();
        command.arg("plugin").arg("sign").arg(trouble.library()).arg("--key").arg(&key);
        finish(&mut command).expect_code(0)
    };
    let output = sign();
    let public_key = output.stdout.rsplit('"').nth(1).expect("a key in quotes").to_owned();
    trouble.config["signature"] = json!({ "public_key": public_key });
    assert_loads(&trouble);
    let signature = trouble.path("plugins/libtrouble.so.sig");
    let text = fs::read_to_string(&signature).expect("it was written");
    fs::remove_file(&signature).expect("it is ours");
    assert_refused(&mut trouble, &["libtrouble.so.sig is missing", "busbar plugin sign"]);
    fs::write(&signature, text.replace(|c: char| c.is_ascii_digit(), "0")).expect("it is ours");
    assert_refused(&mut trouble, &["is not that of the configured public key"]);
}

#[test]
fn a_library_that_crashes_while_it_is_loaded_is_refused_and_the_others_serve() {
    let trouble = trouble();
    let (source, library) = (trouble.path("crash.c"), trouble.path("plugins/libcrash.so"));
    let text = "#include <stdlib.h>\n__attribute__((constructor)) static void f(void) { abort(); }";
    fs::write(&source, text).expect("the folder can be written");
    let mut gcc = Command::new("gcc");
    finish(gcc.args(["-shared", "-fPIC"]).arg(&source).arg("-o").arg(&library)).expect_code(0);
    assert_loads(&trouble);
    let output = finish(busbar().args(["plugin", "list"]).arg(trouble.write())).expect_code(0);
    assert!(output.stdout.contains("trouble.steady 1.0"), "{}", output.stdout);
    let words = "libcrash.so: its process ended while loading it: killed by SIGABRT";
    assert!(output.stdout.contains(words), "{}", output.stdout);
}
