//! Records: which lists there are, and their rows in pages.

use busbar_plugin_abi as abi;
use busbar_records::{Description, List, ListInfo, MAX_ROWS, Record};

use super::plugin_instance::{Instance, required};
use super::text_buffer::{ask, check_required_size};
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::Probe;

/// Rows of the pages that are read.
const PAGES: [u32; 3] = [1, 7, 4096];
/// Rows that are read in small pages at most.
const MAX_READ: usize = 20_000;
/// Bytes of the texts of a page: a row always fits.
const TEXT_BYTES: usize = (1 + abi::BUSBAR_MAX_RECORD_COLUMNS) * abi::BUSBAR_MAX_RECORD_TEXT;
/// Number of guard bytes behind the buffers.
const BEYOND: usize = 64;
const CANARY: u8 = 0xa5;
const RULES: &str = "keep the rules of the header, and of `plugins/sdk/sdk/src/records.rs`";

pub(super) fn table(instance: &Instance<'_>) -> Result<&'static abi::BusbarRecords, Stop> {
    instance.capability(abi::RECORDS_ID)
}

/// Reads the description of the lists; none where the plugin reports an error.
pub(super) fn describe(
    probe: &Probe,
    instance: &Instance<'_>,
) -> Result<Option<Description>, Stop> {
    let describe = required(table(instance)?.describe, "describe")?;
    let (plugin, limit) = (instance.as_ptr(), abi::BUSBAR_MAX_RECORD_DESCRIPTION);
    let told: Option<Description> = ask(probe, "describe_records", limit, |output, error| {
        probe.describe_records(describe, plugin, output, error)
    })?;
    if let Some(Err(fault)) = told.as_ref().map(Description::check) {
        return Err(Finding::new(format!("the description of records: {fault}"), RULES).into());
    }
    Ok(told)
}

/// Page that is asked for.
#[derive(Clone, Copy)]
struct PageRequest {
    list: u32,
    columns: u32,
    first: u64,
    capacity: u32,
}

struct Page {
    revision: u64,
    total: u64,
    rows: Vec<Record>,
}

fn read_page(probe: &Probe, instance: &Instance<'_>, wanted: PageRequest) -> Result<Page, Stop> {
    let read = required(table(instance)?.read, "read")?;
    let PageRequest { list, columns, first, capacity } = wanted;
    let mut rows = vec![abi::BusbarRecordRow::default(); capacity as usize];
    let mut ends = vec![0_u32; capacity as usize * (1 + columns as usize)];
    let mut text = vec![CANARY; TEXT_BYTES + BEYOND];
    let mut raw = abi::BusbarRecordPage {
        struct_size: size_of::<abi::BusbarRecordPage>() as u32,
        list,
        column_count: columns,
        row_capacity: capacity,
        first,
        text_capacity: TEXT_BYTES as u32,
        row_count: 0,
        total: 0,
        revision: 0,
        rows: rows.as_mut_ptr(),
        ends: ends.as_mut_ptr(),
        text: text.as_mut_ptr(),
    };
    let mut error = abi::BusbarError::empty();
    let status = probe.read_records(read, instance.as_ptr(), &mut raw, &mut error);
    probe.expect_ok("read_records", status, &error)?;
    if text[TEXT_BYTES..].iter().any(|byte| *byte != CANARY) {
        return Err(Finding::new("`read_records` wrote beyond the end of texts", RULES).into());
    }
    if raw.row_count > capacity || raw.total > MAX_ROWS as u64 {
        let (count, total) = (raw.row_count, raw.total);
        let fault =
            format!("`read_records` claims {count} rows in room for {capacity}, of {total}");
        return Err(Finding::new(fault, RULES).into());
    }
    let rows = rows[..raw.row_count as usize].iter();
    let mut start = 0;
    let rows = rows.zip(ends.chunks_exact(1 + columns as usize)).map(|(row, ends)| {
        let mut texts = Vec::new();
        for end in ends {
            let text = text[..TEXT_BYTES].get(start..*end as usize);
            start = *end as usize;
            let text = text.ok_or("the ends of texts are out of order, or beyond the end")?;
            let text = std::str::from_utf8(text).map_err(|_| "a text is not UTF-8")?;
            texts.push(text.to_owned());
        }
        if row.severity > abi::BUSBAR_DEFECT_SEVERITY_CRITICAL
            || row.flags > abi::BUSBAR_RECORD_OPEN
        {
            return Err("a severity or flags are not those of the header");
        }
        Ok(Record { equipment: texts.remove(0), cells: texts, ..Record::default() })
    });
    let rows: Result<Vec<Record>, &str> = rows.collect();
    let rows = rows.map_err(|fault| Finding::new(format!("`read_records`: {fault}"), RULES))?;
    Ok(Page { revision: raw.revision, total: raw.total, rows })
}

/// Reads all rows of a list in pages of some size, validated, with their revision.
fn read_all(
    probe: &Probe,
    instance: &Instance<'_>,
    (index, info): (u32, &ListInfo),
    capacity: u32,
) -> Result<(u64, Vec<Record>), Stop> {
    let columns = info.columns.len() as u32;
    let (mut list, mut all) = (List::new(info.clone()), Vec::new());
    loop {
        let first = all.len() as u64;
        let wanted = PageRequest { list: index, columns, first, capacity };
        let page = read_page(probe, instance, wanted)?;
        if let Err(fault) = list.append(page.rows.clone()) {
            return Err(Finding::new(format!("`read_records`: {fault}"), RULES).into());
        }
        let is_empty = page.rows.is_empty();
        all.extend(page.rows);
        let is_cut = all.len() >= MAX_READ && capacity < PAGES[2];
        if all.len() as u64 >= page.total || is_cut || probe.time_left().is_zero() {
            return Ok((page.revision, all));
        }
        if is_empty {
            let (len, total) = (all.len(), page.total);
            let fault = format!("`read_records` gives none after {len} rows of {total}");
            return Err(Finding::new(fault, RULES).into());
        }
    }
}

pub(crate) fn describes(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::RECORDS_ID)?;
    let instance = subject.make(probe)?;
    if describe(probe, &instance)?.is_some() {
        let describe = required(table(&instance)?.describe, "describe")?;
        let plugin = instance.as_ptr();
        check_required_size(probe, "describe_records", |output, error| {
            probe.describe_records(describe, plugin, output, error)
        });
    }
    instance.destroy()
}

pub(crate) fn reads(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::RECORDS_ID)?;
    let instance = subject.make(probe)?;
    let Some(description) = describe(probe, &instance)? else { return instance.destroy() };
    let nothing = PageRequest { list: u32::MAX, columns: 0, first: 0, capacity: 0 };
    read_page(probe, &instance, nothing)?;
    for list in (0..).zip(&description.lists) {
        let (revision, all) = read_all(probe, &instance, list, PAGES[2])?;
        for capacity in PAGES {
            let (again, rows) = read_all(probe, &instance, list, capacity)?;
            let is_same = rows.len() <= all.len() && rows == all[..rows.len()];
            let fault = format!("rows differ between pages of {capacity} and of {}", PAGES[2]);
            probe.expect(is_same || again != revision, fault, RULES);
        }
        let columns = list.1.columns.len() as u32;
        let beyond = PageRequest { list: list.0, columns, first: u64::MAX, capacity: 3 };
        let beyond = read_page(probe, &instance, beyond)?;
        probe.expect(beyond.rows.is_empty(), "`read_records` gives rows beyond the last", RULES);
    }
    instance.destroy()
}

/// Calls every function once.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let Some(description) = describe(probe, instance)? else { return Ok(()) };
    for (index, list) in (0..).zip(&description.lists) {
        let columns = list.columns.len() as u32;
        read_page(probe, instance, PageRequest { list: index, columns, first: 0, capacity: 16 })?;
    }
    Ok(())
}
