//! Subcommand `busbar simulate`: the devices of a configuration, without any device.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use busbar_commands::{SimulatedDevice, SimulatedDevices};
use busbar_plugin_host::Simulation;
use busbar_types::FaultKind;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::arguments::SimulateOptions;
use crate::output;

/// Period at which the status of devices is polled.
const POLL_PERIOD: Duration = Duration::from_millis(100);

pub(crate) fn run(options: &SimulateOptions) -> anyhow::Result<ExitCode> {
    if options.fault_seconds >= options.fault_period {
        bail!(
            "faults of {:?} in every {:?} leave no time without one\n  remedy: make \
             --fault-seconds less than --fault-period",
            options.fault_seconds,
            options.fault_period
        );
    }
    let ending = ending_by_signal()?;
    let started = Instant::now();
    let simulated = SimulatedDevices::start(
        &options.config,
        options.plugin.as_deref(),
        &simulation(options),
        options.scenario.as_deref(),
    )?;
    simulated.remarks().iter().for_each(|remark| output::line(&format!("remark: {remark}")));
    let mut reported: Vec<_> = simulated.devices().iter().map(ReportedStatus::new).collect();
    output::result("ready");
    let is_over = || options.seconds.is_some_and(|seconds| started.elapsed() >= seconds);
    while !ending.load(Ordering::Relaxed) && !is_over() {
        reported.iter_mut().for_each(ReportedStatus::report_changes);
        std::thread::sleep(POLL_PERIOD);
    }
    reported.iter_mut().for_each(ReportedStatus::sum_up);
    Ok(ExitCode::SUCCESS)
}

/// Returns a flag that becomes true with the first SIGINT or SIGTERM; a second one ends the
/// program.
pub(crate) fn ending_by_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let ending = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_default(signal, ending.clone())
            .and_then(|_| flag::register(signal, ending.clone()))
            .context("signals cannot be waited for")?;
    }
    Ok(ending)
}

fn simulation(options: &SimulateOptions) -> Simulation {
    let named = |kind: &FaultKind| options.fault.iter().any(|faults| faults.0.contains(kind));
    Simulation {
        seed: options.seed,
        update: options.update,
        faults: FaultKind::ALL.into_iter().filter(named).collect(),
        fault_period: options.fault_period,
        fault_length: options.fault_seconds,
    }
}

/// Status of a device as it was last reported.
struct ReportedStatus<'a> {
    device: &'a SimulatedDevice,
    fault: Option<FaultKind>,
    clients: u32,
    trouble: Option<String>,
}

impl<'a> ReportedStatus<'a> {
    fn new(device: &'a SimulatedDevice) -> Self {
        let mut reported = Self { device, fault: None, clients: 0, trouble: None };
        match device.status() {
            Ok(status) => {
                reported.print(&format!("{} with {} tags", status.endpoint, device.tag_count));
            }
            Err(error) => reported.note(error.to_string()),
        }
        reported
    }

    fn print(&self, what: &str) {
        output::result(&format!("{}: {what}", self.device.name()));
    }

    /// Reports changes of the status.
    fn report_changes(&mut self) {
        let status = match self.device.status() {
            Ok(status) => status,
            Err(error) => return self.note(error.to_string()),
        };
        if self.trouble.take().is_some() {
            self.print("is back");
        }
        if status.fault != self.fault {
            match (self.fault, status.fault) {
                (_, Some(fault)) => self.print(&format!("fault: {}", fault.name())),
                (Some(fault), None) => self.print(&format!("{} is over", fault.name())),
                (None, None) => {}
            }
            self.fault = status.fault;
        }
        if status.clients != self.clients {
            self.clients = status.clients;
            self.print(&format!("clients: {}", status.clients));
        }
    }

    fn note(&mut self, trouble: String) {
        if self.trouble.as_ref() != Some(&trouble) {
            output::line(&format!("{}: {trouble}", self.device.name()));
            self.trouble = Some(trouble);
        }
    }

    fn sum_up(&mut self) {
        match self.device.status() {
            Ok(status) => {
                let (connections, messages) = (status.connections, status.messages);
                self.print(&format!("{connections} connections, {messages} messages"));
            }
            Err(error) => self.note(error.to_string()),
        }
    }
}
