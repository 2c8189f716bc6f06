//! Plugins with a chart, wherever they run.

use std::sync::Arc;

use busbar_chart::{Description, Explanation};
use busbar_plugin_abi as abi;
use busbar_plugin_host::{Chart, ChartPage, PluginError};

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;

/// The chart of a plugin. Calls take as long as the plugin takes: not for frames.
#[derive(Clone)]
pub enum RunningChart {
    /// Instance in this process.
    InProcess(Chart),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl RunningChart {
    /// The chart that a plugin has.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                Chart::from_instance(instance.clone()).map(Self::InProcess)
            }
            Plugin::Isolated(process) => {
                process.require_capability(abi::CHART_ID)?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// Describes the chart of the plugin.
    ///
    /// # Errors
    /// What the plugin says, the rule that its answer breaks, or how its process ended.
    pub fn describe(&self) -> Result<Description, PluginError> {
        match self {
            Self::InProcess(chart) => chart.describe(),
            Self::Isolated(process) => match process.shared.call(Request::DescribeChart, &[])? {
                Answer::ChartDescribed(description) => {
                    description.check().map_err(|fault| process.broken(fault))?;
                    Ok(description)
                }
                _ => Err(process.shared.unexpected_answer()),
            },
        }
    }

    /// Reads at most `count` records from `first` on, of a chart with so many axes. With `count`
    /// 0 the page has the total and the revision alone.
    ///
    /// # Errors
    /// Returns the errors of [`RunningChart::describe`].
    pub fn read(&self, axes: u32, first: u64, count: u32) -> Result<ChartPage, PluginError> {
        match self {
            Self::InProcess(chart) => chart.read(axes, first, count),
            Self::Isolated(process) => {
                let request = Request::ReadChart { axes, first, count };
                match process.shared.call(request, &[])? {
                    Answer::ChartRead(page) => {
                        page.check(axes, count).map_err(|what| process.broken(what))?;
                        Ok(page)
                    }
                    _ => Err(process.shared.unexpected_answer()),
                }
            }
        }
    }

    /// Explains the last record of a piece of equipment at or before an instant (nanoseconds
    /// since 1970-01-01 UTC). States are not checked against a legend yet.
    ///
    /// # Errors
    /// Returns the errors of [`RunningChart::describe`], or that there is none.
    pub fn explain(&self, equipment: &str, unix_nanos: i64) -> Result<Explanation, PluginError> {
        match self {
            Self::InProcess(chart) => chart.explain(equipment, unix_nanos),
            Self::Isolated(process) => {
                let request = Request::Explain { equipment: equipment.to_owned(), unix_nanos };
                match process.shared.call(request, &[])? {
                    Answer::Explained(explanation) => {
                        let checked = explanation.check(usize::MAX);
                        checked.map_err(|fault| process.broken(fault))?;
                        Ok(explanation)
                    }
                    _ => Err(process.shared.unexpected_answer()),
                }
            }
        }
    }
}
