//! Names the library by the version of its interface, which programs linked with it ask for.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let major = env!("CARGO_PKG_VERSION_MAJOR");
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libbusbar.so.{major}");
}
