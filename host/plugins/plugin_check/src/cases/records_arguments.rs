//! Arguments of records that break the header's rules.

use busbar_plugin_abi as abi;

use super::arguments::{MisalignedCopy, short};
use super::plugin_instance::required;
use super::records::{describe, table};
use super::text_buffer::TextBuffer;
use crate::finding::Outcome;
use crate::probe::Probe;

const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;

pub(crate) fn refused(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::RECORDS_ID)?;
    let instance = subject.make(probe)?;
    let table = table(&instance)?;
    let (tell, read) = (required(table.describe, "describe")?, required(table.read, "read")?);
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
        let code = probe.describe_records(tell, plugin, output, &mut error);
        probe.expect_refused(&format!("describe_records with {what}"), code, &error, &[ARGUMENT]);
    }
    let columns = describe(probe, &instance)?
        .and_then(|description| description.lists.first().map(|list| list.columns.len() as u32));
    let good = abi::BusbarRecordPage {
        struct_size: size_of::<abi::BusbarRecordPage>() as u32,
        list: 0,
        column_count: columns.unwrap_or(1),
        row_capacity: 1,
        first: u64::MAX,
        text_capacity: 0,
        row_count: 0,
        total: 0,
        revision: 0,
        rows: std::ptr::null_mut(),
        ends: std::ptr::null_mut(),
        text: std::ptr::null_mut(),
    };
    let (mut page, mut odd, mut small) = (good, MisalignedCopy::from_value(&good), short(&good, 8));
    let mut unknown = abi::BusbarRecordPage { list: u32::MAX, ..good };
    let mut wide = abi::BusbarRecordPage { column_count: columns.unwrap_or(1) + 1, ..good };
    for (what, plugin, page) in [
        ("a plugin that is null", std::ptr::null(), &raw mut page),
        ("a plugin that is misaligned", odd_plugin, &raw mut page),
        ("a page that is null", plugin, std::ptr::null_mut()),
        ("a page that is misaligned", plugin, odd.as_mut_ptr()),
        ("a page that is too small", plugin, &raw mut small),
        ("a list that is not there", plugin, &raw mut unknown),
        ("a column too many", plugin, &raw mut wide),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.read_records(read, plugin, page, &mut error);
        probe.expect_refused(&format!("read_records with {what}"), code, &error, &[ARGUMENT]);
    }
    instance.destroy()
}
