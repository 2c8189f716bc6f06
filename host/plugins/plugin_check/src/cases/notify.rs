//! Notifications: what is handed over is taken once, and reports keep their rules.

use busbar_alarms::NotificationReport;
use busbar_plugin_abi as abi;
use serde_json::{Value, json};

use super::arguments::{MisalignedCopy, short};
use super::plugin_instance::{Instance, required};
use super::text_buffer::{TextBuffer, ask, check_required_size};
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::Probe;

const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;
const RULES: &str = "keep the rules of the header, and of `plugins/sdk/sdk/src/notify.rs`";
/// Run of the host that the batches are of.
const RUN: u64 = 1_700_000_000_000_000_000;

/// Batch as the host writes it.
struct Batch {
    text: String,
    handed: u64,
}

impl Batch {
    fn new(handed: u64, changes: &[Value], standing: &Value) -> Self {
        let batch = json!({
            "run": RUN, "handed": handed, "changes": changes, "standing": standing, "lost": 0,
        });
        Self { text: batch.to_string(), handed }
    }

    fn of_changes(numbers: std::ops::RangeInclusive<u64>) -> Self {
        let handed = *numbers.end();
        let changes: Vec<Value> = numbers.map(|number| change(number, "raised")).collect();
        Self::new(handed, &changes, &Value::Null)
    }
}

/// Returns a change of a recorded alarm, which wakes nobody.
fn change(number: u64, change: &str) -> Value {
    json!({
        "number": number, "alarm": format!("conformance {number}"), "change": change, "state": "B",
        "priority": "low", "occurred": RUN, "time": RUN, "place": ["=T1"], "group": null,
        "message": "Conformance check", "consequence": "", "response": "", "operator": null,
        "value": null, "origin": ["recorded"], "is_certain": true, "source": null,
    })
}

/// Hands over a batch; none where the plugin reports an error.
fn hand_over(
    probe: &Probe,
    instance: &Instance<'_>,
    batch: &Batch,
) -> Result<Option<NotificationReport>, Stop> {
    let table: &abi::BusbarNotify = instance.capability(abi::NOTIFY_ID)?;
    let notify = required(table.notify, "notify")?;
    let (plugin, limit) = (instance.as_ptr(), abi::BUSBAR_MAX_NOTIFY_REPORT);
    let told: Option<NotificationReport> = ask(probe, "notify", limit, |output, error| {
        probe.notify(notify, plugin, abi::BusbarStr::from_borrowed(&batch.text), output, error)
    })?;
    if let Some(Err(fault)) = told.as_ref().map(|report| report.check(batch.handed)) {
        return Err(Finding::new(format!("`notify`: {fault}"), RULES).into());
    }
    Ok(told)
}

pub(crate) fn takes(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::NOTIFY_ID)?;
    let instance = subject.make(probe)?;
    if hand_over(probe, &instance, &Batch::new(0, &[], &Value::Null))?.is_none() {
        return instance.destroy();
    }
    let standing = json!({ "number": 4, "alarms": [change(0, "standing")], "is_complete": true });
    let list = Batch::new(4, &[], &standing);
    let mut taken = 0;
    // The second comes again, as after an answer that was lost.
    for batch in [Batch::of_changes(1..=2), Batch::of_changes(1..=3), list] {
        let Some(report) = hand_over(probe, &instance, &batch)? else { break };
        let fault = format!("what it has taken went from {taken} back to {}", report.taken);
        probe.expect(report.taken >= taken, fault, RULES);
        taken = report.taken;
    }
    let table: &abi::BusbarNotify = instance.capability(abi::NOTIFY_ID)?;
    let (notify, plugin) = (required(table.notify, "notify")?, instance.as_ptr());
    let text = Batch::new(4, &[], &Value::Null).text;
    check_required_size(probe, "notify", |output, error| {
        probe.notify(notify, plugin, abi::BusbarStr::from_borrowed(&text), output, error)
    });
    instance.destroy()
}

pub(crate) fn refused(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::NOTIFY_ID)?;
    let instance = subject.make(probe)?;
    let table: &abi::BusbarNotify = instance.capability(abi::NOTIFY_ID)?;
    let notify = required(table.notify, "notify")?;
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let mut room = TextBuffer::with_capacity(1 << 16);
    let mut odd = MisalignedCopy::from_value(&room.output);
    let mut small = short(&room.output, 8);
    let output = &raw mut room.output;
    let text = Batch::of_changes(1..=1).text;
    let good = abi::BusbarStr::from_borrowed(&text);
    let many = Batch::of_changes(1..=abi::BUSBAR_MAX_NOTIFY_CHANGES as u64 + 1).text;
    let null = abi::BusbarStr { ptr: std::ptr::null(), len: 7 };
    let odd_bytes = abi::BusbarStr { ptr: [0xff, 0xfe].as_ptr(), len: 2 };
    for (what, plugin, batch, output) in [
        ("a plugin that is null", std::ptr::null(), good, output),
        ("a plugin that is misaligned", odd_plugin, good, output),
        ("a batch that is null", plugin, null, output),
        ("a batch that is not UTF-8", plugin, odd_bytes, output),
        ("a batch that is no JSON", plugin, abi::BusbarStr::from_static("{"), output),
        ("a batch that is too long", plugin, abi::BusbarStr::from_borrowed(&many), output),
        ("an output that is null", plugin, good, std::ptr::null_mut()),
        ("an output that is misaligned", plugin, good, odd.as_mut_ptr()),
        ("an output that is too small", plugin, good, &raw mut small),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.notify(notify, plugin, batch, output, &mut error);
        let codes = [ARGUMENT, abi::BUSBAR_FAILED];
        // What can never be sent may be said before the output is looked at.
        let codes = if plugin == instance.as_ptr() { &codes[..] } else { &codes[..1] };
        probe.expect_refused(&format!("notify with {what}"), code, &error, codes);
    }
    instance.destroy()
}

/// Calls every function once.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    hand_over(probe, instance, &Batch::of_changes(1..=1)).map(drop)
}
