//! Subcommand `busbar doctor`: faults of this machine, their causes and remedies.

mod display;
mod finding;
mod machine;
mod scene;

use std::process::ExitCode;

use busbar_viewer::graphics_device;
use serde_json::json;

use crate::arguments::DoctorOptions;
use crate::exit_codes::EXIT_INPUT;
use crate::output;

use finding::{Finding, State};

pub(crate) fn run(options: &DoctorOptions) -> anyhow::Result<ExitCode> {
    let mut findings = vec![machine::version()];
    findings.extend(graphics());
    findings.push(display::check());
    findings.extend(machine::check());
    if let Some(config) = &options.config {
        findings.extend(scene::check(config));
        findings.extend(scene::listen(config, options.listen_seconds));
    }
    let count = |state| findings.iter().filter(|finding| finding.state == state).count();
    let (faults, warnings) = (count(State::Fault), count(State::Warning));
    if options.json {
        output::json(&json!({ "findings": findings, "faults": faults, "warnings": warnings }))?;
    } else {
        findings.iter().for_each(tell);
        output::result(&format!("{faults} faults, {warnings} warnings"));
    }
    Ok(if faults == 0 { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INPUT) })
}

fn tell(finding: &Finding) {
    let state = match finding.state {
        State::Ok => "ok     ",
        State::Warning => "WARNING",
        State::Fault => "FAULT  ",
    };
    output::result(&format!("{state} {}: {}", finding.check, finding.cause));
    if !finding.remedy.is_empty() {
        output::result(&format!("        remedy: {}", finding.remedy));
    }
}

/// Checks Vulkan: its loader, drivers and devices, and the validation layer.
fn graphics() -> [Finding; 2] {
    const DEVICE: &str = "graphics";
    const VALIDATION: &str = "validation layer";
    let device = match graphics_device(false) {
        Ok(name) if name.contains("llvmpipe") => Finding::warning(
            DEVICE,
            format!("{name} draws in software"),
            "install the driver of the graphics card; live views are drawn at quality `low` until \
             then, unless \"quality\" says otherwise",
        ),
        Ok(name) => Finding::ok(DEVICE, name),
        Err(error) => Finding::fault(
            DEVICE,
            error.to_string(),
            "install the Vulkan loader (libvulkan1) and a driver (mesa-vulkan-drivers, or the \
             vendor's); VK_ICD_FILENAMES and VK_DRIVER_FILES must name drivers that are there",
        ),
    };
    let validation = match (device.state, graphics_device(true)) {
        (State::Fault, _) => Finding::ok(VALIDATION, "not looked at without a device"),
        (_, Ok(_)) => Finding::ok(VALIDATION, "installed"),
        // Only tests and --validation need it.
        (_, Err(_)) => Finding::ok(VALIDATION, "not installed, which only developers miss"),
    };
    [device, validation]
}
