//! Arguments of charts that break the header's rules.

use busbar_plugin_abi as abi;

use super::arguments::{MisalignedCopy, short};
use super::chart::table;
use super::plugin_instance::required;
use super::text_buffer::TextBuffer;
use crate::finding::Outcome;
use crate::probe::Probe;
use crate::text;

const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;

pub(crate) fn refused(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::CHART_ID)?;
    let instance = subject.make(probe)?;
    let table = table(&instance)?;
    let describe = required(table.describe, "describe")?;
    let (read, explain) = (required(table.read, "read")?, required(table.explain, "explain")?);
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let mut room = TextBuffer::with_capacity(1 << 16);
    let mut odd = MisalignedCopy::from_value(&room.output);
    let mut small = short(&room.output, 8);
    let output = &raw mut room.output;
    for (what, plugin, output) in [
        ("a plugin that is null", std::ptr::null(), output),
        ("a plugin that is misaligned", odd_plugin, output),
        ("an output that is null", plugin, std::ptr::null_mut()),
        ("an output that is misaligned", plugin, odd.as_mut_ptr()),
        ("an output that is too small", plugin, &raw mut small),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.describe_chart(describe, plugin, output, &mut error);
        probe.expect_refused(&format!("describe_chart with {what}"), code, &error, &[ARGUMENT]);
        let id = abi::BusbarStr::from_static("=Q1");
        let code = probe.explain(explain, plugin, (id, 0), output, &mut error);
        // It may look for the equipment first.
        let allowed = [ARGUMENT, abi::BUSBAR_FAILED];
        probe.expect_refused(&format!("explain with {what}"), code, &error, &allowed);
    }
    let mut error = abi::BusbarError::empty();
    let bad = text::of_bytes(&[0xff; 4]);
    let code = probe.explain(explain, plugin, (bad, 0), output, &mut error);
    probe.expect_refused("explain with an id that is not UTF-8", code, &error, &[ARGUMENT]);
    let mut page = abi::BusbarChartPage {
        struct_size: size_of::<abi::BusbarChartPage>() as u32,
        axis_count: 0,
        first: 0,
        capacity: 0,
        count: 0,
        total: 0,
        revision: 0,
        records: std::ptr::null_mut(),
        values: std::ptr::null_mut(),
    };
    let mut odd = MisalignedCopy::from_value(&page);
    let mut small = short(&page, 8);
    for (what, plugin, page) in [
        ("a plugin that is null", std::ptr::null(), &raw mut page),
        ("a plugin that is misaligned", odd_plugin, &raw mut page),
        ("a page that is null", plugin, std::ptr::null_mut()),
        ("a page that is misaligned", plugin, odd.as_mut_ptr()),
        ("a page that is too small", plugin, &raw mut small),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.read_chart(read, plugin, page, &mut error);
        probe.expect_refused(&format!("read_chart with {what}"), code, &error, &[ARGUMENT]);
    }
    instance.destroy()
}
