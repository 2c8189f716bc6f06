//! Build script for two plugins in one program: each brings the entry that a host would look for in
//! its library. No host loads this program, so either will do.
#[allow(clippy::print_stdout, reason = "how a build script talks to cargo")]
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-arg=-Wl,--allow-multiple-definition");
}
