//! System packages: detection and installation of missing ones.

use std::collections::HashSet;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process;

/// Folders in which the Vulkan loader looks for drivers.
const DRIVER_FOLDERS: [&str; 2] = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
/// Environment variables that name driver files instead.
const DRIVER_VARIABLES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
/// Prefix of the driver file of Mesa's software rasteriser.
const SOFTWARE_DRIVER_PREFIX: &str = "lvp_icd";

const SOFTWARE_DRIVER: Package = package("mesa-vulkan-drivers", "a Vulkan driver");
const PYTHON_VENV: Package = package("python3-venv", "protocol peers that tests talk to");

const VULKAN: &[Package] = &[package("libvulkan1", "the Vulkan loader")];

/// Libraries that winit opens at run time.
const WINDOW: &[Package] = &[
    package("libx11-6", "windows on X11"),
    package("libx11-xcb1", "windows on X11"),
    package("libxcursor1", "windows on X11"),
    package("libxi6", "mouse and keyboard on X11"),
    package("libxkbcommon-x11-0", "keyboard layouts on X11"),
    package("libxkbcommon0", "keyboard layouts"),
    package("libwayland-client0", "windows on Wayland"),
];

const TESTS: &[Package] = &[
    package("vulkan-validationlayers", "checks every Vulkan call"),
    package("xvfb", "a display for window tests"),
    package("xauth", "a display for window tests"),
    package("xdotool", "mouse and keys in window tests"),
    package("x11-utils", "window properties in window tests"),
    package("x11-xserver-utils", "monitors that come and go in window tests"),
    package("imagemagick", "screenshots"),
    package("chromium", "a browser for tests of the web page"),
    package("systemd", "checks the units of services"),
    package("mosquitto", "an MQTT broker that tests talk to"),
    package("mbpoll", "a Modbus client that tests talk to"),
    package("gcc", "compiles the C header, and plugins in C"),
    package("make", "builds plugins in C"),
    package("socat", "serial lines without wires, for Modbus RTU"),
    package("libmodbus-dev", "a Modbus server that tests talk to"),
    package("postgresql", "a database that tests talk to"),
    package("g++", "compiles the C header as C++, the fuzzer, and what benches compare"),
    package("binutils", "lists what libbusbar exports"),
    package("pkg-config", "finds libraries for examples of embedding"),
    package("libx11-dev", "an example of embedding"),
    package("libgtk-3-dev", "an example of embedding"),
    package("qt6-base-dev", "an example of embedding"),
];

const BENCH: &[Package] = &[
    package("g++", "what benches compare"),
    package("libusb-1.0-0", "Open3D, which benches compare with"),
    package("libegl1", "Open3D, which benches compare with"),
    package("libgl1", "Open3D, which benches compare with"),
];

const RENDER_BENCH: &[Package] = &[
    package("f3d", "a viewer that frames are compared with"),
    package("xvfb", "a display for the viewers that are compared with"),
    package("libgl1-mesa-dri", "the rasteriser of viewers that are compared with"),
];

/// Debian package and its purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Package {
    name: &'static str,
    why: &'static str,
}

const fn package(name: &'static str, why: &'static str) -> Package {
    Package { name, why }
}

/// Purpose of the required packages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Rendering of a picture without a window.
    Picture,
    /// Opening of a window on a display.
    Window,
    /// Running of every test.
    Tests,
    /// Running of the benches.
    Bench,
    /// Comparison of frame times with other viewers.
    RenderBench,
}

/// Installs missing packages where that is possible; lists them elsewhere.
pub(crate) fn ensure(purpose: Purpose) -> Result<()> {
    let wanted = wanted(purpose);
    if !in_path("dpkg-query") || !in_path("apt-get") {
        println!("This is no Debian or Ubuntu: see that the like of these packages is there.");
        print_packages(&wanted);
        return Ok(());
    }
    let missing = missing(&wanted)?;
    if missing.is_empty() {
        return Ok(());
    }
    println!("Missing system packages, now to be installed:");
    print_packages(&missing);
    install(&missing)
}

fn wanted(purpose: Purpose) -> Vec<Package> {
    let mut wanted = Vec::new();
    if purpose == Purpose::Bench {
        // Nothing is drawn.
        wanted.extend(BENCH);
    } else {
        wanted.extend(driver(purpose));
    }
    if purpose == Purpose::RenderBench {
        wanted.extend(BENCH.iter().chain(RENDER_BENCH));
    }
    let asks_python = matches!(purpose, Purpose::Tests | Purpose::Bench | Purpose::RenderBench);
    if asks_python
        && !process::succeeds(Command::new("python3").args(["-c", "import ensurepip, venv"]))
    {
        wanted.push(PYTHON_VENV);
    }
    wanted
}

/// Returns the packages that drawing requires.
fn driver(purpose: Purpose) -> Vec<Package> {
    let mut wanted = VULKAN.to_vec();
    // Reference pictures are the software rasteriser's, whatever else is there.
    if purpose == Purpose::Tests || !has_other_driver(&driver_files()) {
        wanted.push(SOFTWARE_DRIVER);
    }
    if purpose != Purpose::Picture {
        wanted.extend(WINDOW);
    }
    if purpose == Purpose::Tests {
        wanted.extend(TESTS);
    }
    wanted
}

/// Lists the driver files that the Vulkan loader will find.
fn driver_files() -> Vec<PathBuf> {
    for variable in DRIVER_VARIABLES {
        if let Some(value) = std::env::var_os(variable) {
            let files = std::env::split_paths(&value);
            return files.filter(|file| file.exists()).collect();
        }
    }
    let folders = DRIVER_FOLDERS.iter().filter_map(|folder| fs::read_dir(folder).ok());
    folders.flatten().flatten().map(|entry| entry.path()).collect()
}

fn has_other_driver(files: &[PathBuf]) -> bool {
    files.iter().any(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        name.ends_with(".json") && !name.starts_with(SOFTWARE_DRIVER_PREFIX)
    })
}

fn missing(wanted: &[Package]) -> Result<Vec<Package>> {
    let mut command = Command::new("dpkg-query");
    command.args(["--show", "--showformat", "${Package} ${db:Status-Status}\n"]);
    command.args(wanted.iter().map(|package| package.name));
    // Its exit status only says that some package is unknown.
    let output = process::quiet_output(&mut command)?;
    Ok(not_installed(wanted, &String::from_utf8_lossy(&output.stdout)))
}

/// Returns the packages that a listing of `name status` lines does not call installed.
fn not_installed(wanted: &[Package], listing: &str) -> Vec<Package> {
    let lines = listing.lines().filter_map(|line| line.split_once(' '));
    let installed: HashSet<&str> =
        lines.filter(|(_, status)| *status == "installed").map(|(name, _)| name).collect();
    let wanted = wanted.iter().copied();
    wanted.filter(|p| !installed.contains(p.name)).collect()
}

fn install(missing: &[Package]) -> Result<()> {
    let names: Vec<_> = missing.iter().map(|package| package.name).collect();
    let by_hand = format!("install by hand, as root: apt-get install {}", names.join(" "));
    let sudo = !rustix::process::geteuid().is_root();
    if sudo && !in_path("sudo") {
        bail!("neither root nor sudo, so packages cannot be installed; {by_hand}");
    }
    apt_get(sudo, &["update"], &[]).with_context(|| by_hand.clone())?;
    apt_get(sudo, &["install", "-y", "--no-install-recommends"], &names).context(by_hand)
}

fn apt_get(sudo: bool, arguments: &[&str], names: &[&str]) -> Result<()> {
    let mut command = Command::new(if sudo { "sudo" } else { "env" });
    if sudo {
        command.arg("env");
    }
    command.args(["DEBIAN_FRONTEND=noninteractive", "apt-get"]);
    // Another installation may be under way.
    command.args(["-o", "DPkg::Lock::Timeout=120"]);
    process::run_on_terminal(command.args(arguments).args(names))
}

fn print_packages(packages: &[Package]) {
    for Package { name, why } in packages {
        println!("  {name:<24} {why}");
    }
}

fn in_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_installed_packages_count() {
        let listing =
            "libvulkan1 installed\nmesa-vulkan-drivers config-files\nxvfb not-installed\n";
        let wanted = [VULKAN[0], SOFTWARE_DRIVER, TESTS[1], PYTHON_VENV];
        let missing = not_installed(&wanted, listing);
        assert_eq!(missing, [SOFTWARE_DRIVER, TESTS[1], PYTHON_VENV]);
    }

    #[test]
    fn only_a_driver_beside_the_software_one_counts() {
        let files = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert!(!has_other_driver(&files(&[])));
        assert!(!has_other_driver(&files(&["/a/lvp_icd.x86_64.json"])));
        assert!(!has_other_driver(&files(&["/a/nvidia_icd.json.bak"])));
        assert!(has_other_driver(&files(&["/a/lvp_icd.json", "/b/nvidia_icd.json"])));
    }

    #[test]
    fn dpkg_is_read_where_there_is_one() {
        if !in_path("dpkg-query") {
            return;
        }
        let unknown = package("busbar-no-such-package", "");
        let base = package("dpkg", "");
        assert_eq!(missing(&[base, unknown]).unwrap(), [unknown]);
    }

    #[test]
    fn a_picture_needs_less_than_a_window_and_that_less_than_tests() {
        let [picture, window, tests] =
            [Purpose::Picture, Purpose::Window, Purpose::Tests].map(|p| wanted(p).len());
        assert!(picture < window && window < tests);
    }
}
