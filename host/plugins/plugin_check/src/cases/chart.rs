//! Cases of charts: description, pages of records, explanations.

use busbar_chart::{Description, Explanation, MAX_AXES, MAX_RECORDS, Record, Records};
use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use super::text_buffer::{ask, check_required_size};
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::Probe;

/// Records of the pages that are read.
const PAGES: [u32; 3] = [1, 7, 1 << 16];
/// Records that are read one by one at most.
const MAX_READ: usize = 100_000;
/// Equipment that is explained.
const MAX_EXPLAINED: usize = 16;
/// Guard value behind the last value of a page.
const CANARY: f32 = 12_345.5;
const RULES: &str = "keep the rules of the header, and of `plugins/sdk/sdk/src/chart.rs`";

pub(super) fn table(instance: &Instance<'_>) -> Result<&'static abi::BusbarChart, Stop> {
    instance.capability(abi::CHART_ID)
}

/// Reads the description of the chart; none where the plugin reports an error.
fn describe(probe: &Probe, instance: &Instance<'_>) -> Result<Option<Description>, Stop> {
    let describe = required(table(instance)?.describe, "describe")?;
    let plugin = instance.as_ptr();
    let told: Option<Description> =
        ask(probe, "describe_chart", abi::BUSBAR_MAX_CHART_TEXT, |output, error| {
            probe.describe_chart(describe, plugin, output, error)
        })?;
    if let Some(Err(fault)) = told.as_ref().map(Description::check) {
        return Err(Finding::new(format!("the chart's description: {fault}"), RULES).into());
    }
    Ok(told)
}

/// Some records with their values.
struct Page {
    raw: abi::BusbarChartPage,
    records: Vec<abi::BusbarChartRecord>,
    values: Vec<f32>,
}

fn read_page(
    probe: &Probe,
    instance: &Instance<'_>,
    axes: u32,
    first: u64,
    capacity: u32,
) -> Result<Page, Stop> {
    let read = required(table(instance)?.read, "read")?;
    let mut records = vec![abi::BusbarChartRecord::default(); capacity as usize];
    let room = (capacity * axes) as usize;
    let mut values = vec![CANARY; room + 8];
    let mut raw = abi::BusbarChartPage {
        struct_size: size_of::<abi::BusbarChartPage>() as u32,
        axis_count: axes,
        first,
        capacity,
        count: 0,
        total: 0,
        revision: 0,
        records: records.as_mut_ptr(),
        values: values.as_mut_ptr(),
    };
    let mut error = abi::BusbarError::empty();
    let status = probe.read_chart(read, instance.as_ptr(), &mut raw, &mut error);
    probe.expect_ok("read_chart", status, &error)?;
    if values[room..].iter().any(|value| *value != CANARY) {
        return Err(Finding::new("`read_chart` wrote beyond the end of values", RULES).into());
    }
    if raw.count > capacity || raw.total > MAX_RECORDS as u64 {
        let (count, total) = (raw.count, raw.total);
        let fault =
            format!("`read_chart` claims {count} records in room for {capacity}, of {total}");
        return Err(Finding::new(fault, RULES).into());
    }
    records.truncate(raw.count as usize);
    values.truncate((raw.count * axes) as usize);
    Ok(Page { raw, records, values })
}

/// Reads all records in pages of some size, validated, with their revision.
fn read_all(
    probe: &Probe,
    instance: &Instance<'_>,
    description: &Description,
    capacity: u32,
) -> Result<(u64, Records), Stop> {
    let axes = description.axes.len() as u32;
    let mut all = Records::new(description);
    loop {
        let page = read_page(probe, instance, axes, all.len() as u64, capacity)?;
        let record = |raw: &abi::BusbarChartRecord| Record {
            unix_nanos: raw.time_unix_nanos,
            equipment: raw.equipment,
            state: raw.state,
        };
        let records: Vec<Record> = page.records.iter().map(record).collect();
        let appended = all.append(&records, &page.values, description.legend.len());
        if let Err(fault) = appended {
            return Err(Finding::new(format!("`read_chart`: {fault}"), RULES).into());
        }
        let is_all = all.len() as u64 >= page.raw.total;
        let is_cut = all.len() >= MAX_READ && capacity < PAGES[2];
        if is_all || is_cut || probe.time_left().is_zero() {
            return Ok((page.raw.revision, all));
        }
        if records.is_empty() {
            let (len, total) = (all.len(), page.raw.total);
            let fault = format!("`read_chart` gives none after {len} records of {total}");
            return Err(Finding::new(fault, RULES).into());
        }
    }
}

pub(crate) fn describes(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::CHART_ID)?;
    let instance = subject.make(probe)?;
    let first = describe(probe, &instance)?;
    if first.is_some() {
        let describe = required(table(&instance)?.describe, "describe")?;
        let plugin = instance.as_ptr();
        check_required_size(probe, "describe_chart", |output, error| {
            probe.describe_chart(describe, plugin, output, error)
        });
    }
    instance.destroy()
}

pub(crate) fn reads(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::CHART_ID)?;
    let instance = subject.make(probe)?;
    let Some(description) = describe(probe, &instance)? else { return instance.destroy() };
    let axes = description.axes.len() as u32;
    let (revision, all) = read_all(probe, &instance, &description, PAGES[2])?;
    let asked = read_page(probe, &instance, 0, 0, 0)?;
    if asked.raw.revision == revision {
        let fault = "`read_chart` tells another total where it is asked for no record";
        probe.expect(asked.raw.total == all.len() as u64, fault, RULES);
    }
    for capacity in PAGES {
        let (again, records) = read_all(probe, &instance, &description, capacity)?;
        let pairs = all.all().iter().zip(records.all());
        let is_same = records.len() <= all.len() && pairs.into_iter().all(|(a, b)| a == b);
        let fault = format!("records differ between pages of {capacity} and of {}", PAGES[2]);
        probe.expect(is_same || again != revision, fault, RULES);
    }
    let beyond = read_page(probe, &instance, axes, u64::MAX, 3)?;
    probe.expect(beyond.raw.count == 0, "`read_chart` gives records beyond the last", RULES);
    instance.destroy()
}

/// Reads the explanation of a piece of equipment at an instant; none where the plugin reports an
/// error.
fn explain(
    probe: &Probe,
    instance: &Instance<'_>,
    (equipment, time): (&str, i64),
) -> Result<Option<Explanation>, Stop> {
    let explain = required(table(instance)?.explain, "explain")?;
    let (plugin, id) = (instance.as_ptr(), abi::BusbarStr::from_borrowed(equipment));
    ask(probe, "explain", abi::BUSBAR_MAX_CHART_TEXT, |output, error| {
        probe.explain(explain, plugin, (id, time), output, error)
    })
}

pub(crate) fn explains(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::CHART_ID)?;
    let instance = subject.make(probe)?;
    let Some(description) = describe(probe, &instance)? else { return instance.destroy() };
    for equipment in description.equipment.iter().take(MAX_EXPLAINED) {
        for time in [i64::MAX, 0, i64::MIN] {
            let told = explain(probe, &instance, (equipment, time))?;
            let checked = told.map(|told| told.check(description.legend.len()));
            if let Some(Err(fault)) = checked {
                probe.find(Finding::new(format!("`explain` of '{equipment}': {fault}"), RULES));
            }
        }
    }
    for unknown in ["", "there is no such equipment"] {
        let told = explain(probe, &instance, (unknown, i64::MAX))?;
        let fault = format!("`explain` says something of '{unknown}', which is not described");
        probe.expect(told.is_none(), fault, "fail with BUSBAR_FAILED, and say why");
    }
    instance.destroy()
}

/// Calls every function once.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let Some(description) = describe(probe, instance)? else { return Ok(()) };
    let axes = description.axes.len().min(MAX_AXES) as u32;
    read_page(probe, instance, axes, 0, 16)?;
    match description.equipment.first() {
        Some(equipment) => explain(probe, instance, (equipment, i64::MAX)).map(drop),
        None => Ok(()),
    }
}
