//! Telemetry: addresses, and starting and stopping in every order.

use std::time::Duration;

use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use crate::fake_sink::FakeSink;
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::{Probe, Subject};
use crate::request::SampleTag;

/// Freshness limit of the tags here, milliseconds.
const FRESHNESS_MILLIS: u64 = 2000;
/// Duration over which a plugin is observed for forbidden calls.
pub(crate) const OBSERVATION_TIME: Duration = Duration::from_millis(200);
/// Handles are not consecutive in the host either.
const FIRST_TAG: u32 = 3;

/// Tags as the ABI has them, and the texts behind them.
pub(crate) struct TagSpecs {
    pub(crate) raw: Vec<abi::BusbarTagSpec>,
    _texts: Vec<(String, String)>,
}

impl TagSpecs {
    pub(crate) fn from_samples(samples: &[SampleTag]) -> Self {
        Self::new(samples.iter().map(|tag| (tag.kind.code(), tag.address.to_string())))
    }

    pub(crate) fn new(tags: impl IntoIterator<Item = (u8, String)>) -> Self {
        let (kinds, texts): (Vec<_>, Vec<_>) = tags
            .into_iter()
            .enumerate()
            .map(|(index, (kind, address))| (kind, (format!("Check.{index}"), address)))
            .unzip();
        let raw = kinds.iter().zip(&texts).zip(FIRST_TAG..).map(|((&kind, (id, address)), tag)| {
            abi::BusbarTagSpec {
                tag,
                kind,
                reserved: [0; 3],
                freshness_millis: FRESHNESS_MILLIS,
                id: abi::BusbarStr::from_borrowed(id),
                address_json: abi::BusbarStr::from_borrowed(address),
                unit: abi::BusbarStr::from_static(""),
            }
        });
        Self { raw: raw.collect(), _texts: texts }
    }

    pub(crate) fn sink(&self) -> &'static FakeSink {
        FakeSink::new(self.raw.iter().map(|spec| (spec.tag, spec.kind)))
    }

    pub(crate) fn as_parts(&self) -> (*const abi::BusbarTagSpec, usize) {
        (self.raw.as_ptr(), self.raw.len())
    }
}

/// Plugin that was started; samples after `stop` are late.
pub(crate) struct Started<'a> {
    pub(crate) instance: &'a Instance<'a>,
    pub(crate) table: &'static abi::BusbarTelemetry,
    pub(crate) sink: &'static FakeSink,
}

/// Starts with tags that must be served.
pub(crate) fn start<'a>(
    probe: &Probe,
    instance: &'a Instance<'a>,
    tags: &TagSpecs,
) -> Result<Started<'a>, Stop> {
    start_into(probe, instance, tags, tags.sink())
}

fn start_into<'a>(
    probe: &Probe,
    instance: &'a Instance<'a>,
    tags: &TagSpecs,
    sink: &'static FakeSink,
) -> Result<Started<'a>, Stop> {
    let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
    let start = required(table.start, "start")?;
    let mut error = abi::BusbarError::empty();
    sink.set_open(true);
    let plugin = instance.as_ptr();
    let status = probe.start(start, plugin, tags.as_parts(), sink.as_ptr(), &mut error);
    probe.expect_ok("start", status, &error)?;
    Ok(Started { instance, table, sink })
}

impl Started<'_> {
    pub(crate) fn stop(&self, probe: &Probe) -> Outcome {
        probe.stop(required(self.table.stop, "stop")?, self.instance.as_ptr());
        self.sink.set_open(false);
        Ok(())
    }

    /// Adds the errors in its samples as findings.
    pub(crate) fn report_faults(&self, probe: &Probe) {
        let seen = self.sink.seen();
        seen.findings().into_iter().for_each(|finding| probe.find(finding));
        probe.expect(
            seen.late == 0,
            format!("it called the sink {} times while it was idle", seen.late),
            "end and join every thread that publishes before `stop` returns",
        );
    }
}

/// Starts with the sample's tags and stops.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let tags = TagSpecs::from_samples(&probe.request.sample.tags);
    // One for all: a sink lives for ever, and memory is what some cases watch.
    let sink = probe.brief_sink.get_or_init(|| tags.sink());
    let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
    if let Some(check) = table.check {
        let mut error = abi::BusbarError::empty();
        let (raw, count) = tags.as_parts();
        let status = probe.check(check, instance.as_ptr(), raw, count, &mut error);
        probe.expect_ok("check", status, &error)?;
    }
    start_into(probe, instance, &tags, sink)?.stop(probe)
}

pub(crate) fn zero_tags(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let instance = subject.make(probe)?;
    let started = start(probe, &instance, &TagSpecs::from_samples(&[]))?;
    std::thread::sleep(OBSERVATION_TIME);
    started.stop(probe)?;
    started.report_faults(probe);
    instance.destroy()
}

pub(crate) fn order(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let tags = TagSpecs::from_samples(&probe.request.sample.tags);
    let instance = subject.make(probe)?;
    let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
    let stop = required(table.stop, "stop")?;
    probe.stop(stop, instance.as_ptr());
    let started = start(probe, &instance, &tags)?;
    let (mut error, second) = (abi::BusbarError::empty(), tags.sink());
    let again = required(table.start, "start")?;
    let status =
        probe.start(again, instance.as_ptr(), tags.as_parts(), second.as_ptr(), &mut error);
    let allowed = [abi::BUSBAR_INVALID_ARGUMENT];
    probe.expect_refused("start after start", status, &error, &allowed);
    let fault = "it publishes to the sink of a `start` that it refused";
    let silent = second.seen().samples == 0;
    probe.expect(silent, fault, "keep the first sink until `stop`");
    started.stop(probe)?;
    probe.stop(stop, instance.as_ptr());
    instance.destroy()?;
    destroyed_while_active(probe, &subject, &tags)?;
    started_judged(probe, &subject, &tags)
}

/// A host in haste: no `stop` before `destroy`.
fn destroyed_while_active(probe: &Probe, subject: &Subject, tags: &TagSpecs) -> Outcome {
    let instance = subject.make(probe)?;
    let started = start(probe, &instance, tags)?;
    let sink = started.sink;
    instance.destroy()?;
    sink.set_open(false);
    std::thread::sleep(OBSERVATION_TIME);
    let late = sink.seen().late;
    probe.expect(
        late == 0,
        format!("it called the sink {late} times after `destroy`"),
        "let `destroy` do what `stop` does when it is still active",
    );
    Ok(())
}

/// Validates all telemetry calls that did not fail.
fn started_judged(probe: &Probe, subject: &Subject, tags: &TagSpecs) -> Outcome {
    let instance = subject.make(probe)?;
    let started = start(probe, &instance, tags)?;
    started.stop(probe)?;
    started.report_faults(probe);
    instance.destroy()
}

pub(crate) fn addresses(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let instance = subject.make(probe)?;
    let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
    let (start, stop) = (required(table.start, "start")?, required(table.stop, "stop")?);
    let odd = [
        "null".to_owned(),
        "{}".to_owned(),
        "[]".to_owned(),
        "-1".to_owned(),
        "1e308".to_owned(),
        "\"\"".to_owned(),
        "{\"no_such_field_of_any_plugin\":1}".to_owned(),
        format!("\"{}\"", "x".repeat(100_000)),
        format!("{}1{}", "[".repeat(100), "]".repeat(100)),
    ];
    for address in odd {
        let shown = if address.len() > 40 { &address[..40] } else { &address };
        let what = format!("an address {shown}");
        let tags = TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, address.clone())]);
        let allowed = [abi::BUSBAR_OK, abi::BUSBAR_INVALID_SETTINGS, abi::BUSBAR_INVALID_ARGUMENT];
        let checked = table.check.map(|check| {
            let mut error = abi::BusbarError::empty();
            let (raw, count) = tags.as_parts();
            let status = probe.check(check, instance.as_ptr(), raw, count, &mut error);
            probe.expect_refused(&format!("check of {what}"), status, &error, &allowed);
            status
        });
        let (mut error, sink) = (abi::BusbarError::empty(), tags.sink());
        sink.set_open(true);
        let status =
            probe.start(start, instance.as_ptr(), tags.as_parts(), sink.as_ptr(), &mut error);
        probe.expect_refused(&format!("start with {what}"), status, &error, &allowed);
        if status == abi::BUSBAR_OK {
            probe.stop(stop, instance.as_ptr());
        }
        sink.set_open(false);
        // A default `check` that accepts everything promises nothing.
        if checked.is_some_and(|checked| checked != abi::BUSBAR_OK && status == abi::BUSBAR_OK) {
            probe.find(Finding::new(
                format!("`check` refuses {what}, and `start` accepts it"),
                "let both read addresses by the same function",
            ));
        }
    }
    instance.destroy()
}
