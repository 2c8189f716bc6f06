//! Dissolved gas analysis as a command, `busbar dga FILE.csv [--out F.csv]`, as the chart of a
//! fleet of transformers, and as the overlay of their monitors.
//!
//! The methods are those of the crate `dga`; here is what reads samples and writes results.

mod axes;
mod columns;
mod explain;
mod fleet;
mod gas_input;
mod history;
mod judged;
mod lines;
mod loading;
mod monitor;
mod monitors;
mod odds;
mod report;
mod row;
mod settings;
mod source;
mod status_bounds;
mod table;
mod verdict;

use std::time::Instant;

use busbar_plugin_sdk::{
    Binding, Canvas, Chart, ChartDescription, ChartRecords, Command, CommandExit, CommandInfo,
    Description, Error, Explanation, Host, LogLevel, Overlay, OverlayFrame, Plugin, Streams,
    TagValue,
};
use dga::uncertainty::Uncertainty;

pub use settings::Settings;

/// Analysis of dissolved gases.
pub struct GasAnalysis {
    settings: Settings,
    uncertainty: Option<Uncertainty>,
    fleet: fleet::Fleet,
    monitors: monitors::Monitors,
}

impl Plugin for GasAnalysis {
    const ID: &'static str = "gas_analysis";
    const NAME: &'static str = "Gas analysis";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Analyses gases dissolved in transformer oil by IEC 60599, IEEE C57.104, DL/T 722 and \
         Duval.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        let uncertainty = settings.uncertainty.map(Uncertainty::new).transpose();
        let uncertainty = uncertainty.map_err(|error| Error::settings(error.to_string()))?;
        let fleet = fleet::Fleet::from_settings(&settings, host)?;
        let monitors = monitors::Monitors::from_settings(&settings)?;
        Ok(Self { settings, uncertainty, fleet, monitors })
    }
}

impl Command for GasAnalysis {
    const COMMANDS: &'static [CommandInfo] = &[CommandInfo {
        name: "dga",
        help: "analyse gases dissolved in transformer oil: CSV with H2, CH4, C2H6, C2H4, C2H2 in \
               ppm, a row a sample",
    }];

    fn run(
        &self,
        _name: &str,
        arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error> {
        if let Some(argument) = arguments.first() {
            let text = format!("unknown argument '{argument}'; settings are given by --set K=V");
            streams.diagnose(LogLevel::Error, None, &text);
            return Ok(CommandExit::WrongUse);
        }
        table::analyse(streams, &self.settings, self.uncertainty)
            .map_err(|error| Error::failed(error.to_string()))
    }
}

impl Chart for GasAnalysis {
    fn describe_chart(&mut self) -> Result<ChartDescription, Error> {
        Ok(self.fleet.describe())
    }

    fn chart_records(&mut self) -> Result<ChartRecords<'_>, Error> {
        self.monitors.note_silence(Instant::now());
        self.fleet.refresh(&self.monitors);
        // The host keeps what it has, and says why that may be old. Monitors go on.
        let is_lone = self.monitors.equipment().next().is_none();
        if let Some(fault) = self.fleet.fault().filter(|_| is_lone) {
            return Err(Error::failed(fault.to_owned()));
        }
        Ok(self.fleet.records())
    }

    fn explain(&mut self, equipment: &str, unix_nanos: i64) -> Result<Explanation, Error> {
        let recent = self.fleet.recent(&self.monitors, equipment, unix_nanos);
        let (last, before) = recent.split_last().ok_or_else(|| {
            Error::failed(format!("there is no sample of '{equipment}' at that time"))
        })?;
        Ok(explain::explain(last, before, &self.settings))
    }
}

impl Overlay for GasAnalysis {
    fn describe(&self) -> Description {
        let equipment = self.monitors.equipment().map(str::to_owned).collect();
        Description {
            legend: self.monitors.legend(),
            equipment,
            findings: self.monitors.findings().to_vec(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.monitors.configure(&bindings);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        self.monitors.draw(&values, frame.unix_nanos(), canvas)
    }
}

busbar_plugin_sdk::export_plugin!(GasAnalysis: command, chart, overlay);

#[cfg(test)]
mod fleet_tests;
#[cfg(test)]
mod monitor_silence_tests;
#[cfg(test)]
mod monitors_tests;
#[cfg(test)]
mod tests;
