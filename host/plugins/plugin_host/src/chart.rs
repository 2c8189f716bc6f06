//! Chart plugins: capability `busbar.chart/1-draft`.

use std::sync::Arc;

use busbar_chart::{Description, Explanation, Record};
use busbar_plugin_abi as abi;
use serde::{Deserialize, Serialize};

use crate::json_output::ask_json;
use crate::{Instance, PluginError};

/// Records of one page: at most 128 bytes of values each.
pub const MAX_PAGE_RECORDS: u32 = 1 << 16;
/// Bytes of a description, or of an explanation.
const LIMIT: usize = abi::BUSBAR_MAX_CHART_TEXT;

/// A plugin that has a chart.
#[derive(Clone)]
pub struct Chart {
    instance: Arc<Instance>,
    table: &'static abi::BusbarChart,
}

/// Some of the records of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChartPage {
    /// Grows with every change of description or records.
    pub revision: u64,
    /// Total number of records.
    pub total: u64,
    /// The records wanted, as far as there are so many.
    pub records: Vec<Record>,
    /// A value an axis for each of them; NaN where there is none.
    pub values: Vec<f32>,
}

impl ChartPage {
    /// Validates the page against the number of axes and the records asked for.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, axes: u32, count: u32) -> Result<(), &'static str> {
        if self.total > abi::BUSBAR_MAX_CHART_RECORDS as u64 {
            return Err("its chart claims more records than one may have");
        }
        if self.records.len() > count as usize {
            return Err("its chart gives more records than were asked for");
        }
        if self.values.len() != self.records.len() * axes as usize {
            return Err("its chart gives more or fewer values than axes");
        }
        Ok(())
    }
}

impl Chart {
    /// The chart of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table: &abi::BusbarChart = instance.capability(abi::CHART_ID)?;
        if table.describe.is_none() || table.read.is_none() || table.explain.is_none() {
            return Err(instance.violation("`describe`, `read` or `explain` is null"));
        }
        Ok(Self { instance, table })
    }

    /// Describes the chart of the plugin.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn describe(&self) -> Result<Description, PluginError> {
        let describe = self.table.describe.ok_or_else(|| self.null_function_error())?;
        let description: Description = ask_json(&self.instance, LIMIT, |output, error| {
            // SAFETY: output and error live for the call.
            unsafe { describe(self.instance.as_ptr(), output, error) }
        })?;
        description.check().map_err(|fault| self.instance.violation(fault.to_string()))?;
        Ok(description)
    }

    /// Reads at most `count` records from `first` on, of a chart with so many axes. With `count`
    /// 0 the page has the total and the revision alone.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn read(&self, axes: u32, first: u64, count: u32) -> Result<ChartPage, PluginError> {
        let read = self.table.read.ok_or_else(|| self.null_function_error())?;
        let count = count.min(MAX_PAGE_RECORDS);
        let axes = axes.min(abi::BUSBAR_MAX_CHART_AXES as u32);
        let mut records = vec![abi::BusbarChartRecord::default(); count as usize];
        let mut values = vec![f32::NAN; (count * axes) as usize];
        let mut page = abi::BusbarChartPage {
            struct_size: size_of::<abi::BusbarChartPage>() as u32,
            axis_count: axes,
            first,
            capacity: count,
            count: 0,
            total: 0,
            revision: 0,
            records: records.as_mut_ptr(),
            values: values.as_mut_ptr(),
        };
        let mut error = abi::BusbarError::empty();
        let serial = self.instance.serialize_calls();
        // SAFETY: page, its buffers and the error live for the call.
        let status = unsafe { read(self.instance.as_ptr(), &mut page, &mut error) };
        drop(serial);
        self.instance.outcome(status, &error)?;
        if page.count > count {
            return Err(self.instance.violation("its chart claims more records than fit"));
        }
        records.truncate(page.count as usize);
        values.truncate((page.count * axes) as usize);
        let record = |raw: &abi::BusbarChartRecord| Record {
            unix_nanos: raw.time_unix_nanos,
            equipment: raw.equipment,
            state: raw.state,
        };
        let records = records.iter().map(record).collect();
        let page = ChartPage { revision: page.revision, total: page.total, records, values };
        page.check(axes, count).map_err(|what| self.instance.violation(what))?;
        Ok(page)
    }

    /// Explains the last record of a piece of equipment at or before an instant (nanoseconds
    /// since 1970-01-01 UTC). States are not checked against a legend yet.
    ///
    /// # Errors
    /// What the plugin says, such as that there is none, or the rule that its answer breaks.
    pub fn explain(
        &self,
        equipment: impl AsRef<str>,
        unix_nanos: i64,
    ) -> Result<Explanation, PluginError> {
        let explain = self.table.explain.ok_or_else(|| self.null_function_error())?;
        let id = abi::BusbarStr::from_borrowed(equipment.as_ref());
        let explanation: Explanation = ask_json(&self.instance, LIMIT, |output, error| {
            // SAFETY: id, output and error live for the call.
            unsafe { explain(self.instance.as_ptr(), id, unix_nanos, output, error) }
        })?;
        let broken = |fault: busbar_chart::ChartError| self.instance.violation(fault.to_string());
        explanation.check(usize::MAX).map_err(broken)?;
        Ok(explanation)
    }

    fn null_function_error(&self) -> PluginError {
        self.instance.violation("a function of its chart is null")
    }
}
