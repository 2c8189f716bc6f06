//! One row of a point list: text cells to a valid point.

use busbar_types::ValueKind;
use serde_json::{Map, Value};

use crate::address::{MAX_ADDRESS_DEPTH, cell_value, depth};
use crate::column::{Column, is_number_field};
use crate::fault::ListFault;
use crate::number_style::{NumberFault, NumberStyle};
use crate::point::Point;
use crate::type_decision::decide;
use crate::type_evidence::Evidence;

/// The longest tag id, name, node or role, in bytes.
const MAX_NAME_BYTES: usize = 200;
/// The longest unit, in bytes.
const MAX_UNIT_CHARS: usize = 32;
/// Age past which a value is stale, milliseconds: least and most.
const FRESHNESS_MILLIS: std::ops::RangeInclusive<u64> = 50..=86_400_000;

/// The cells of a row: column, its name in the list, trimmed text. Empty ones are left out.
pub(crate) type Cells<'a> = [(&'a Column, &'a str, &'a str)];

/// Reads a row; every fault of it goes into `faults`.
pub(crate) fn read(
    line: u64,
    cells: &Cells<'_>,
    style: NumberStyle,
    faults: &mut Vec<ListFault>,
) -> Option<Point> {
    let before = faults.len();
    let mut address_faults = Vec::new();
    let address = Row { line, cells, style, faults: &mut address_faults }.address();
    let mut row = Row { line, cells, style, faults };
    let value_type = row.value_type(&address);
    let point = Point {
        line,
        tag: row.text(&Column::Tag, MAX_NAME_BYTES),
        description: row.text(&Column::Description, MAX_NAME_BYTES),
        value_type: value_type.unwrap_or_default(),
        unit: row.text(&Column::Unit, MAX_UNIT_CHARS),
        range: row.band([&Column::Low, &Column::High], value_type),
        limits: row.band([&Column::LimitLow, &Column::LimitHigh], value_type),
        freshness_millis: row.freshness(),
        scale: row.scale(value_type),
        node: row.text(&Column::Node, usize::MAX),
        role: row.text(&Column::Role, MAX_NAME_BYTES),
        plugin: row.text(&Column::Plugin, MAX_NAME_BYTES),
        address,
    };
    row.faults.append(&mut address_faults);
    if point.tag.is_empty() {
        row.fault("", "the row has no tag", "fill in its id, or remove the row");
    }
    (faults.len() == before).then_some(point)
}

struct Row<'r> {
    line: u64,
    cells: &'r Cells<'r>,
    style: NumberStyle,
    faults: &'r mut Vec<ListFault>,
}

impl<'r> Row<'r> {
    fn fault(&mut self, column: &str, cause: impl Into<String>, remedy: impl Into<String>) {
        self.faults.push(ListFault::new(self.line, column, cause, remedy));
    }

    /// Name of the column and text of the cell.
    fn cell(&self, column: &Column) -> Option<(&'r str, &'r str)> {
        let cells: &'r Cells<'r> = self.cells;
        cells.iter().find(|(c, ..)| *c == column).map(|(_, name, text)| (*name, *text))
    }

    fn text(&mut self, column: &Column, most: usize) -> String {
        let Some((name, text)) = self.cell(column) else { return String::new() };
        if text.len() > most {
            self.fault(name, format!("it has {} bytes, {most} at most", text.len()), "shorten it");
        }
        if text.chars().any(char::is_control) {
            self.fault(name, "it has a control character", "write it in one line");
        }
        text.to_owned()
    }

    fn number(&mut self, column: &Column) -> Option<f64> {
        let (name, text) = self.cell(column)?;
        let parsed = self.parse_number(text);
        if let Err(fault) = &parsed {
            self.number_fault(name, text, fault);
        }
        parsed.ok()
    }

    fn number_fault(&mut self, name: &str, text: &str, fault: &NumberFault) {
        match fault {
            NumberFault::NoNumber => {
                let remedy = "write a number, such as 12.5, or leave it empty";
                self.fault(name, format!("'{text}' is no number"), remedy);
            }
            NumberFault::Ambiguous([a, b]) => {
                let cause = format!("'{text}' may be {a} or {b}: no other number shows which");
                self.fault(name, cause, format!("write {a:?}0, or {b} without a mark"));
            }
        }
    }

    /// Reads a number, which may have the row's unit behind it.
    fn parse_number(&self, text: &str) -> Result<f64, NumberFault> {
        let unit = self.cell(&Column::Unit).map_or("", |(_, unit)| unit);
        let is_part_of_number = |c: char| c.is_ascii_digit() || ".,+-eE".contains(c);
        let is_unit = !unit.is_empty() && !unit.starts_with(is_part_of_number);
        let bare = text.strip_suffix(unit).filter(|_| is_unit).unwrap_or(text);
        self.style.parse(bare.trim())
    }

    fn quiet_number(&self, column: &Column) -> Option<f64> {
        let (_, text) = self.cell(column)?;
        self.parse_number(text).ok()
    }

    /// Evidence of the row's kind, beside its type.
    fn evidence(&self, address: &Value) -> Evidence {
        let mut evidence = Evidence::default();
        let number = |column| self.quiet_number(column);
        evidence.add_address(address);
        evidence.add_unit(self.cell(&Column::Unit).map_or("", |(_, text)| text));
        if scale_of([number(&Column::Factor), number(&Column::Offset)]).is_some() {
            evidence.add_scale();
        }
        evidence.add_band("range", [number(&Column::Low), number(&Column::High)]);
        evidence.add_band("limits", [number(&Column::LimitLow), number(&Column::LimitHigh)]);
        evidence
    }

    /// Decides the type of the row's values; none, with a fault, where it is unclear.
    fn value_type(&mut self, address: &Value) -> Option<ValueKind> {
        let cell = self.cell(&Column::Type);
        match decide(cell.map(|(_, text)| text), &self.evidence(address)) {
            Ok(value_type) => Some(value_type),
            Err(fault) => {
                let name = cell.map_or("", |(name, _)| name);
                self.fault(name, fault.cause, fault.remedy);
                None
            }
        }
    }

    fn band(
        &mut self,
        [low, high]: [&Column; 2],
        value_type: Option<ValueKind>,
    ) -> [Option<f64>; 2] {
        let band = [self.number(low), self.number(high)];
        let name = self.cell(low).or_else(|| self.cell(high)).map_or("", |(name, _)| name);
        match band {
            // What lists fill in for states: 0 to 1, 0 to 3.
            _ if value_type.is_some_and(|kind| !kind.is_quantity()) => [None, None],
            [Some(a), Some(b)] if a >= b => {
                let cause = format!("low, {a}, is not less than high, {b}");
                self.fault(name, cause, "make low less than high, or leave one empty");
                band
            }
            _ => band,
        }
    }

    fn freshness(&mut self) -> Option<u64> {
        let in_seconds = self.cell(&Column::FreshnessSeconds).map(|cell| (cell, 1_000.0));
        let in_millis = || self.cell(&Column::FreshnessMillis).map(|cell| (cell, 1.0));
        let ((name, text), millis_per_unit) = in_seconds.or_else(in_millis)?;
        let millis = text.parse::<f64>().ok().map(|time| (time * millis_per_unit).round());
        // Negative and endless times end at the ends of the type, which are out of range.
        let millis = millis.map(|millis| millis as u64).filter(|m| FRESHNESS_MILLIS.contains(m));
        if millis.is_none() {
            let [least, most] = [FRESHNESS_MILLIS.start(), FRESHNESS_MILLIS.end()]
                .map(|end| *end as f64 / millis_per_unit);
            let unit = if millis_per_unit > 1.0 { "seconds" } else { "milliseconds" };
            let remedy = format!("write {unit} from {least} to {most}");
            self.fault(name, format!("'{text}' is no such time"), remedy);
        }
        millis
    }

    fn scale(&mut self, value_type: Option<ValueKind>) -> Option<[f64; 2]> {
        let (factor, offset) = (self.number(&Column::Factor), self.number(&Column::Offset));
        let scale = scale_of([factor, offset])?;
        let column = if factor.is_some() { Column::Factor } else { Column::Offset };
        let name = self.cell(&column).map_or("", |(name, _)| name);
        match value_type {
            Some(other) if other != ValueKind::F64 => {
                let cause = format!("a tag of type '{}' has no scale", other.name());
                self.fault(name, cause, "make its type f64, or leave it empty");
            }
            _ if factor == Some(0.0) => {
                self.fault(name, "the factor is 0", "write another, or leave it empty for 1");
            }
            _ => {}
        }
        Some(scale)
    }

    fn address(&mut self) -> Value {
        let address = self.any_address();
        if depth(&address) > MAX_ADDRESS_DEPTH {
            let cause = format!("its address is nested more than {MAX_ADDRESS_DEPTH} deep");
            self.fault("", cause, "nest less deeply");
        }
        address
    }

    /// The value of a field of the address; numbers as the list writes them.
    fn field_value(&mut self, field: &str, name: &str, text: &str) -> Value {
        let value = cell_value(text);
        if !is_number_field(field) || !text.contains(['.', ',']) {
            return value;
        }
        match self.style.parse(text) {
            Ok(number) => number.into(),
            Err(fault @ NumberFault::Ambiguous(_)) => {
                self.number_fault(name, text, &fault);
                value
            }
            // The plugin knows what else there may be.
            Err(NumberFault::NoNumber) => value,
        }
    }

    fn any_address(&mut self) -> Value {
        let whole = self.cell(&Column::Address);
        let fields: Vec<_> = self
            .cells
            .iter()
            .filter_map(|(column, name, text)| match column {
                Column::AddressField(field) => Some((field.clone(), *name, *text)),
                _ => None,
            })
            .collect();
        let whole_value = whole.map(|(_, text)| cell_value(text));
        if fields.is_empty() {
            return whole_value.unwrap_or_else(|| {
                self.fault(
                    "",
                    "the tag has no address",
                    "fill in 'address', or the columns 'address.…'",
                );
                Value::Null
            });
        }
        let mut address = match whole_value {
            None => Map::new(),
            Some(Value::Object(address)) => address,
            Some(_) => {
                let name = whole.map_or("", |(name, _)| name);
                let remedy = "write a JSON object into it, or leave it or the others empty";
                self.fault(name, "it is no object, and there are 'address.…' as well", remedy);
                Map::new()
            }
        };
        for (field, name, text) in fields {
            let value = self.field_value(&field, name, text);
            if address.insert(field.clone(), value).is_some() {
                let cause = format!("the address has '{field}' already");
                self.fault(name, cause, "say it once");
            }
        }
        Value::Object(address)
    }
}

/// Factor and offset; nothing where they change no value.
fn scale_of([factor, offset]: [Option<f64>; 2]) -> Option<[f64; 2]> {
    let scale = [factor.unwrap_or(1.0), offset.unwrap_or(0.0)];
    (scale != [1.0, 0.0]).then_some(scale)
}
