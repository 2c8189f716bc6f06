//! Cases of commands: names, and behavior with any input.

use std::collections::BTreeSet;

use busbar_plugin_abi as abi;

use super::arguments::{MisalignedCopy, short};
use super::plugin_instance::{Instance, required};
use crate::fake_streams::FakeStreams;
use crate::finding::{Finding, Outcome, Stop};
use crate::library::sized;
use crate::probe::Probe;
use crate::text;

const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;
/// Bytes of a large input.
const LARGE: usize = 3 << 20;
/// Longest help line of a command, bytes.
const MAX_HELP: usize = 200;
/// Calls of streams that are never asked to stop.
const ALL: usize = usize::MAX;

fn table(instance: &Instance<'_>) -> Result<&'static abi::BusbarCommand, Stop> {
    instance.capability(abi::COMMAND_ID)
}

/// Names of the commands.
fn names(probe: &Probe, instance: &Instance<'_>) -> Result<Vec<String>, Stop> {
    let table = table(instance)?;
    let (count, describe) =
        (required(table.count, "count")?, required(table.describe, "describe")?);
    let count = probe.count_commands(count, instance.as_ptr());
    if count > abi::BUSBAR_MAX_COMMANDS {
        let fault = format!("it offers {count} commands");
        return Err(Finding::new(fault, "offer at most BUSBAR_MAX_COMMANDS").into());
    }
    let mut names = Vec::new();
    for index in 0..count {
        let info = probe.describe_command(describe, instance.as_ptr(), index);
        let info = sized(info, "BusbarCommandInfo")?;
        let read = |text, what: &str| {
            let fault = |fault| Finding::new(format!("the {what} of command {index} {fault}"), "");
            text::read(text).map_err(fault)
        };
        let (name, help) = (read(info.name, "name")?, read(info.help, "help")?);
        let is_line =
            !help.is_empty() && help.len() <= MAX_HELP && !help.chars().any(char::is_control);
        probe.expect(
            is_line,
            format!("the help of '{name}' is empty, long or not one line"),
            "write one line of at most 200 bytes",
        );
        names.push(name);
    }
    let beyond = probe.describe_command(describe, instance.as_ptr(), count);
    let fault = "`describe` gives a command beyond the last";
    probe.expect(beyond.is_null(), fault, "return null where `index` is too large");
    Ok(names)
}

pub(crate) fn list(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::COMMAND_ID)?;
    let instance = subject.make(probe)?;
    let names = names(probe, &instance)?;
    probe.expect(!names.is_empty(), "it offers no command", "offer one, or drop the capability");
    for name in &names {
        let fits = name.len() <= abi::BUSBAR_MAX_COMMAND_NAME
            && name.starts_with(|first: char| first.is_ascii_lowercase())
            && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
        let remedy = "a lower-case letter, then lower-case letters, digits and `-`, at most 32";
        probe.expect(fits, format!("'{name}' is no name of a command"), remedy);
    }
    let different: BTreeSet<_> = names.iter().collect();
    let fault = "two commands have one name";
    probe.expect(different.len() == names.len(), fault, "give each its own");
    let again = self::names(probe, &instance)?;
    probe.expect(again == names, "commands change between two questions", "keep them");
    instance.destroy()
}

/// A call of a command without arguments.
fn call(name: &str) -> abi::BusbarCommandCall {
    abi::BusbarCommandCall {
        struct_size: size_of::<abi::BusbarCommandCall>() as u32,
        argument_count: 0,
        name: abi::BusbarStr::from_borrowed(name),
        arguments: std::ptr::null(),
    }
}

fn result() -> abi::BusbarCommandResult {
    abi::BusbarCommandResult {
        struct_size: size_of::<abi::BusbarCommandResult>() as u32,
        exit_code: u32::MAX,
    }
}

/// Runs a command on some input, which must not be a failure.
fn run_on(
    probe: &Probe,
    instance: &Instance<'_>,
    name: &str,
    (input, piece, calls): (&[u8], usize, usize),
    what: &str,
) -> Outcome {
    let run = required(table(instance)?.run, "run")?;
    let mut streams = FakeStreams::new(input, piece, calls);
    let raw = streams.table();
    let (call, mut result, mut error) = (call(name), result(), abi::BusbarError::empty());
    let status = probe.run_command(run, instance.as_ptr(), &call, &raw, &mut result, &mut error);
    streams.report_faults(probe, what);
    if streams.was_stopped {
        let allowed = [abi::BUSBAR_CANCELLED];
        probe.expect_status(&format!("`run` with {what}"), status, &error, &allowed);
        return Ok(());
    }
    probe.expect_ok(&format!("run of '{name}' with {what}"), status, &error)?;
    let code = result.exit_code;
    let fault = format!("`run` with {what} ends with the unknown exit code {code}");
    probe.expect(code <= abi::BUSBAR_EXIT_CODE_USAGE, fault, "give a BUSBAR_EXIT_CODE_*");
    Ok(())
}

/// Runs the first command on nothing.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    match names(probe, instance)?.first() {
        Some(name) => run_on(probe, instance, name, (b"", 1, ALL), "an empty input"),
        None => Ok(()),
    }
}

pub(crate) fn inputs(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::COMMAND_ID)?;
    let instance = subject.make(probe)?;
    let odd: Vec<u8> = (0..4096_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let lines = b"a,b;c\n1,2,\"3\n".repeat(64);
    let (long, many) = (vec![b'7'; LARGE], b"1\n".repeat(LARGE / 2));
    for name in names(probe, &instance)? {
        for (input, piece, what) in [
            (&b""[..], 1, "an empty input"),
            (b"\n", 1, "one empty line"),
            (&lines, 1, "lines that come byte by byte"),
            (&odd, 777, "random bytes"),
            (&long, 1 << 20, "one endless line"),
            (&many, 4096, "very many lines"),
        ] {
            run_on(probe, &instance, &name, (input, piece, ALL), what)?;
        }
    }
    instance.destroy()
}

pub(crate) fn stops(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::COMMAND_ID)?;
    let instance = subject.make(probe)?;
    let lines = b"a,b;c\n1,2,\"3\n".repeat(64);
    for name in names(probe, &instance)? {
        for calls in [0, 1, 2, 5] {
            let what = format!("streams that ask to stop after {calls} calls");
            run_on(probe, &instance, &name, (&lines, 10, calls), &what)?;
        }
        run_on(probe, &instance, &name, (&lines, 10, ALL), "an input after a stop")?;
    }
    instance.destroy()
}

pub(crate) fn arguments(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::COMMAND_ID)?;
    let instance = subject.make(probe)?;
    let run = required(table(&instance)?.run, "run")?;
    let names = names(probe, &instance)?;
    let Some(name) = names.first() else { return instance.destroy() };
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let mut streams = FakeStreams::new(b"", 1, ALL);
    let good_streams = streams.table();
    let mut odd_streams = MisalignedCopy::from_value(&good_streams);
    let small_streams = short(&good_streams, 8);
    let deaf_streams = abi::BusbarCommandStreams { read: None, ..good_streams };
    let good = call(name);
    let mut odd_call = MisalignedCopy::from_value(&good);
    let small_call = short(&good, 8);
    let unknown = call("there-is-no-such-command");
    let bad_name = abi::BusbarCommandCall { name: text::of_bytes(&[0xff; 4]), ..good };
    let no_arguments = abi::BusbarCommandCall { argument_count: 2, ..good };
    let bad_text = text::of_bytes(&[0xff; 4]);
    let bad_argument = abi::BusbarCommandCall { argument_count: 1, arguments: &bad_text, ..good };
    let mut into = result();
    let mut odd_into = MisalignedCopy::from_value(&into);
    let mut small_into = short(&into, 4);
    let (all, to, null) = (&raw const good, &raw const good_streams, std::ptr::null());
    let result = &raw mut into;
    for (what, plugin, call, streams, result) in [
        ("a plugin that is null", std::ptr::null(), all, to, result),
        ("a plugin that is misaligned", odd_plugin, all, to, result),
        ("a call that is null", plugin, null, to, result),
        ("a call that is misaligned", plugin, odd_call.as_ptr(), to, result),
        ("a call that is too small", plugin, &raw const small_call, to, result),
        ("an unknown command", plugin, &raw const unknown, to, result),
        ("a name that is not UTF-8", plugin, &raw const bad_name, to, result),
        ("arguments that are null", plugin, &raw const no_arguments, to, result),
        ("an argument that is not UTF-8", plugin, &raw const bad_argument, to, result),
        ("streams that are null", plugin, all, std::ptr::null(), result),
        ("streams that are misaligned", plugin, all, odd_streams.as_ptr(), result),
        ("streams that are too small", plugin, all, &raw const small_streams, result),
        ("streams without `read`", plugin, all, &raw const deaf_streams, result),
        ("a result that is null", plugin, all, to, std::ptr::null_mut()),
        ("a result that is misaligned", plugin, all, to, odd_into.as_mut_ptr()),
        ("a result that is too small", plugin, all, to, &raw mut small_into),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.run_command(run, plugin, call, streams, result, &mut error);
        probe.expect_refused(&format!("run with {what}"), code, &error, &[ARGUMENT]);
    }
    instance.destroy()
}
