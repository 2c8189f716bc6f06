//! `busbar scl`: the data of an IED in an SCL file (IEC 61850-6) as a point list for
//! `busbar import`, and its report control blocks in words.

mod extent;
mod text_encoding;

use std::collections::BTreeSet;
use std::io::{self, Read, Write};

use busbar_plugin_sdk::{CommandExit, Error, LogLevel, Streams};
use iec61850_rs::Fc;
use iec61850_rs::model::{
    BType, DataAttribute, DataObject, Fcda, IedModel, LogicalDevice, LogicalNode,
};
use iec61850_rs::scl::Scl;

use self::text_encoding::{DecodedFile, NO_CHARACTER};
use crate::locate::VALUES;

/// Longest SCL file, bytes.
const MAX_FILE_BYTES: u64 = 64 << 20;
/// Rows of a list, as many as a plugin serves.
pub(crate) const MAX_ROWS: usize = 100_000;
/// Levels of data objects in each other, and of structures in them.
const MAX_LEVELS: usize = 8;
const USAGE: &str = "busbar scl FILE [--out POINTS.csv] -- [IED] [all]: 'all' lists all status \
                     and measured values, and not those alone that reports have";
const HEADER: &str = "tag,type,unit,address.reference,address.fc\n";

/// A value that can be a tag.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Row {
    /// Reference of the row, such as `IED1LD0/MMXU1.PhV.phsA`.
    pub(crate) reference: String,
    pub(crate) constraint: &'static str,
    pub(crate) kind: &'static str,
    pub(crate) unit: String,
}

/// Reads a file and writes the list.
///
/// # Errors
/// I/O errors of the streams.
pub(crate) fn run(arguments: &[&str], streams: &Streams<'_>) -> Result<CommandExit, Error> {
    let wants_all = arguments.contains(&"all");
    let names: Vec<_> = arguments.iter().filter(|argument| **argument != "all").collect();
    if names.len() > 1 {
        streams.diagnose(LogLevel::Error, None, USAGE);
        return Ok(CommandExit::WrongUse);
    }
    let mut bytes = Vec::new();
    let read = streams.input().take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes);
    let read = read.map_err(|error| error.to_string()).and_then(|count| {
        let is_short = count as u64 <= MAX_FILE_BYTES;
        is_short.then_some(()).ok_or_else(|| format!("longer than {MAX_FILE_BYTES} bytes"))
    });
    let decoded = read.and_then(|()| text_encoding::decode(&bytes));
    if let Ok(DecodedFile { remark: Some(remark), .. }) = &decoded {
        streams.diagnose(LogLevel::Warning, None, remark);
    }
    let model = decoded.and_then(|file| model_of(&file.text, names.first().copied().copied()));
    let (model, others) = match model {
        Ok(found) => found,
        Err(what) => {
            streams.diagnose(LogLevel::Error, None, &what);
            return Ok(CommandExit::InputAtFault);
        }
    };
    if !others.is_empty() {
        let text = format!("{} is read; others are {}", model.name, others.join(", "));
        streams.diagnose(LogLevel::Info, None, &text);
    }
    for diagnostic in &model.diagnostics {
        let text = format!("{}: {}", diagnostic.at, diagnostic.message);
        streams.diagnose(LogLevel::Warning, None, &text);
    }
    let mut rows = rows_of(&model, wants_all);
    let count = rows.len();
    // A reference with a character that nobody could read is none of the device's.
    rows.retain(|row| !row.reference.contains(NO_CHARACTER));
    if rows.len() < count {
        let text = format!("{} values have unreadable names and are left out", count - rows.len());
        streams.diagnose(LogLevel::Error, None, &text);
    }
    if rows.is_empty() {
        let text = format!("{} has no data of a kind that tags have", model.name);
        streams.diagnose(LogLevel::Error, None, &text);
        return Ok(CommandExit::InputAtFault);
    }
    if rows.len() > MAX_ROWS {
        let text = format!("{} values; the first {MAX_ROWS} are listed", rows.len());
        streams.diagnose(LogLevel::Warning, None, &text);
    }
    tell_blocks(&model, streams);
    let written = write_rows(&rows, &mut io::BufWriter::new(streams.output()));
    written.map_err(|error| Error::failed(error.to_string()))?;
    Ok(CommandExit::Done)
}

/// The model of an IED, and the names of the others.
fn model_of(text: &str, name: Option<&str>) -> Result<(IedModel, Vec<String>), String> {
    let in_words = |error: iec61850_rs::Error| match error {
        iec61850_rs::Error::Scl(what) => format!("it is no SCL file: {what}"),
        other => other.to_string(),
    };
    extent::check(text, name)?;
    let file = Scl::parse(text).map_err(in_words)?;
    let mut names = file.ied_names();
    if let Some(name) = name.filter(|name| !names.iter().any(|other| other == name)) {
        return Err(format!("it has no IED '{name}', but {}", names.join(", ")));
    }
    let model = file.model(name).map_err(in_words)?;
    names.retain(|other| name.is_none() && *other != model.name);
    Ok((model, names))
}

/// The rows of what the data sets of report control blocks have; of all, where none has
/// any or all is wanted.
fn rows_of(model: &IedModel, wants_all: bool) -> Vec<Row> {
    let members: Vec<(&str, &Fcda)> = nodes(model)
        .flat_map(|(device, node)| {
            let sets = node.report_controls.iter().filter_map(|block| block.dat_set.as_deref());
            let sets: BTreeSet<_> = sets.collect();
            sets.into_iter().filter_map(|set| model.data_set(node, set)).flat_map(move |set| {
                set.members.iter().map(move |member| (device.name.as_str(), member))
            })
        })
        .collect();
    let mut rows = BTreeSet::new();
    for (device, node) in nodes(model) {
        let of_node: Vec<_> = members
            .iter()
            .filter(|(name, member)| {
                let of_device = member.ld_inst == device.inst
                    || member.ld_inst.is_empty() && *name == device.name;
                of_device && member.ln_name() == node.name
            })
            .map(|(_, member)| *member)
            .collect();
        let start = format!("{}/{}", device.name, node.name);
        for object in &node.data_objects {
            let is_wanted = |path: &str, fc: Fc| {
                let is_member =
                    |member: &&Fcda| member.fc == fc && is_within(path, &member.do_name);
                wants_all || members.is_empty() || of_node.iter().any(is_member)
            };
            add_object(object, &start, &object.name, MAX_LEVELS, &is_wanted, &mut rows);
        }
    }
    rows.into_iter().collect()
}

fn nodes(model: &IedModel) -> impl Iterator<Item = (&LogicalDevice, &LogicalNode)> {
    let devices = model.logical_devices.iter();
    devices.flat_map(|device| device.logical_nodes.iter().map(move |node| (device, node)))
}

/// Reports whether a path is within another, as `PhV.phsA` is in `PhV`.
fn is_within(path: &str, whole: &str) -> bool {
    let rest = path.strip_prefix(whole);
    whole.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

fn add_object(
    object: &DataObject,
    start: &str,
    path: &str,
    levels: usize,
    is_wanted: &dyn Fn(&str, Fc) -> bool,
    rows: &mut BTreeSet<Row>,
) {
    // Elements of arrays have no names.
    if levels == 0 || object.count.is_some() {
        return;
    }
    for constraint in [Fc::ST, Fc::MX] {
        if !is_wanted(path, constraint) {
            continue;
        }
        if let Some(kind) = value_kind(&object.attributes, Some(constraint), MAX_LEVELS) {
            let reference = format!("{start}.{path}");
            let unit = if kind == "f64" { unit_of(object) } else { String::new() };
            rows.insert(Row { reference, constraint: constraint.as_str(), kind, unit });
        }
    }
    for below in &object.sub_objects {
        add_object(below, start, &format!("{path}.{}", below.name), levels - 1, is_wanted, rows);
    }
}

/// The kind of tag for what stands for the value, chosen as it is on the wire.
fn value_kind(
    attributes: &[DataAttribute],
    constraint: Option<Fc>,
    levels: usize,
) -> Option<&'static str> {
    let is_right = |attribute: &&DataAttribute| constraint.is_none_or(|fc| attribute.fc == fc);
    let named = |name: &&str| attributes.iter().filter(is_right).find(|found| found.name == **name);
    let value = VALUES.iter().find_map(named)?;
    match value.btype {
        _ if value.count.is_some() || levels == 0 => None,
        BType::Boolean => Some("bool"),
        BType::Dbpos => Some("double_point"),
        BType::Float32 | BType::Float64 => Some("f64"),
        BType::Struct => value_kind(&value.children, None, levels - 1),
        BType::Enum
        | BType::Int8
        | BType::Int16
        | BType::Int24
        | BType::Int32
        | BType::Int64
        | BType::Int8U
        | BType::Int16U
        | BType::Int24U
        | BType::Int32U => Some("i64"),
        BType::VisString32
        | BType::VisString64
        | BType::VisString65
        | BType::VisString129
        | BType::VisString255
        | BType::Unicode255 => Some("text"),
        _ => None,
    }
}

/// `kV` of `units.multiplier` and `units.SIUnit`, where the file has their values.
fn unit_of(object: &DataObject) -> String {
    let units = object.attributes.iter().find(|attribute| attribute.name == "units");
    let part = |name: &str| {
        let found = units?.children.iter().find(|child| child.name == name)?;
        found.value.as_deref().map(str::trim)
    };
    let is_symbol = |text: &&str| text.parse::<f64>().is_err();
    let unit = part("SIUnit").filter(is_symbol).filter(|unit| !unit.is_empty());
    let multiplier = part("multiplier").filter(is_symbol).unwrap_or_default();
    unit.map(|unit| format!("{multiplier}{unit}")).unwrap_or_default()
}

/// The blocks that `"reports"` of the settings may name.
fn tell_blocks(model: &IedModel, streams: &Streams<'_>) {
    for (device, node) in nodes(model) {
        for block in &node.report_controls {
            let constraint = if block.buffered { "BR" } else { "RP" };
            let start = format!("{}/{}.{constraint}.", device.name, node.name);
            // Instances are not counted out: a file may claim any number of them.
            let name = if block.indexed { format!("{}01", block.name) } else { block.name.clone() };
            let set = block.dat_set.as_deref().unwrap_or("none");
            let others = match block.max_instances {
                0 | 1 => String::new(),
                count => format!(", the first of {count}"),
            };
            let text = format!("report control block {start}{name}{others}: data set {set}");
            streams.diagnose(LogLevel::Info, None, &text);
        }
    }
}

/// Writes a point list, of [`MAX_ROWS`] at most.
pub(crate) fn write_rows(rows: &[Row], output: &mut impl Write) -> io::Result<()> {
    output.write_all(HEADER.as_bytes())?;
    for Row { reference, constraint, kind, unit } in rows.iter().take(MAX_ROWS) {
        let (reference, unit) = (cell(reference), cell(unit));
        writeln!(output, "{reference},{kind},{unit},{reference},{constraint}")?;
    }
    output.flush()
}

/// A cell of CSV (RFC 4180).
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
#[path = "scl_tests.rs"]
mod tests;
