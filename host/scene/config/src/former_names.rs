//! Former names of settings: read as the present ones, and told.
//!
//! A schema's property lists its former names under [`FORMER_NAMES`]. A name is a path from the
//! object that has the property, with `..` for the object around it: `"poll_millis"`, or
//! `"../view/quality"`. Where the last words of both names are units of time, the number is
//! converted.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Number, Value};

use crate::pointer::push_token;
use crate::{Diagnostic, Positions, Severity, join_pointer, pointer};

/// Keyword of a property in a schema: the list of its former names.
pub const FORMER_NAMES: &str = "x-busbar-formerly";
/// Remedy of former names.
pub const UPGRADE_HINT: &str = "`busbar config upgrade FILE` writes the present names";
/// Greatest number of passes over a document: settings that moved may have renamed ones in them.
const MAX_PASSES: usize = 4;
/// Greatest depth of absent objects below a present one whose former names are looked for.
const MAX_ABSENT_DEPTH: usize = 3;
/// Units of time by the last word of a name, in seconds.
const UNITS: [(&str, f64); 6] = [
    ("_ms", 0.001),
    ("_millis", 0.001),
    ("_seconds", 1.0),
    ("_minutes", 60.0),
    ("_hours", 3_600.0),
    ("_days", 86_400.0),
];
/// Significant digits of a converted number, fewer than rounding errors reach.
const DIGITS: i32 = 12;

/// A setting that a document has under a former name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenamedSetting {
    /// JSON pointer in the document as written.
    pub former: String,
    /// JSON pointer of the present name.
    pub present: String,
}

impl RenamedSetting {
    /// Returns former and present name as short as they differ: keys, or pointers where the
    /// setting moved.
    pub fn names(&self) -> (&str, &str) {
        let (former, present) = (split(&self.former), split(&self.present));
        if former.0 == present.0 { (former.1, present.1) } else { (&self.former, &self.present) }
    }
}

/// Result of renaming: settings renamed, and those given under two names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RenamedSettings {
    /// Settings that were renamed, each name once a place.
    pub renamed: Vec<RenamedSetting>,
    /// Settings that have their present name too; the former one is left as it is.
    pub conflicts: Vec<RenamedSetting>,
    /// Objects of which nothing is left: their settings have other places now.
    empty: BTreeSet<String>,
}

impl RenamedSettings {
    /// Returns settings of a part as settings of the document that has it at `pointer`.
    pub fn below(self, pointer: &str) -> Self {
        let place = |one: RenamedSetting| RenamedSetting {
            former: format!("{pointer}{}", one.former),
            present: format!("{pointer}{}", one.present),
        };
        Self {
            renamed: self.renamed.into_iter().map(place).collect(),
            conflicts: self.conflicts.into_iter().map(place).collect(),
            ..self
        }
    }

    /// Adds those of another part.
    pub fn extend(&mut self, other: Self) {
        self.renamed.extend(other.renamed);
        self.conflicts.extend(other.conflicts);
    }

    /// Returns an error for each setting that is given under both names.
    pub fn conflict_errors(&self, positions: &Positions) -> Vec<Diagnostic> {
        let error = |one: &RenamedSetting| {
            let (former, present) = one.names();
            let cause = format!("'{former}' is a former name of '{present}', which is given too");
            positions.at_key(Severity::Error, &one.former, cause, "remove it".to_owned())
        };
        self.conflicts.iter().map(error).collect()
    }

    /// Returns a warning for each pair of names, at the first place that has the former one.
    pub fn warnings(&self, positions: &Positions) -> Vec<Diagnostic> {
        let mut by_names: BTreeMap<(&str, &str), (&RenamedSetting, usize)> = BTreeMap::new();
        for one in &self.renamed {
            by_names.entry(one.names()).or_insert((one, 0)).1 += 1;
        }
        let warning =
            |((former, present), (first, count)): ((&str, &str), (&RenamedSetting, _))| {
                let more = match count {
                    1 => String::new(),
                    2 => ", here and at another place".to_owned(),
                    more => format!(", here and at {} other places", more - 1),
                };
                let cause = format!("'{former}' is called '{present}' now{more}");
                let remedy = UPGRADE_HINT.to_owned();
                positions.at_key(Severity::Warning, &first.former, cause, remedy)
            };
        by_names.into_iter().map(warning).collect()
    }
}

/// Former names of a schema's properties.
#[derive(Debug)]
pub struct FormerNames {
    shapes: Vec<Shape>,
}

/// Former names in one object schema, and where schemas with former names hang below it.
#[derive(Debug, Default)]
struct Shape {
    /// Present key and former path.
    names: Vec<(String, String)>,
    properties: BTreeMap<String, usize>,
    /// Schema of further members.
    others: Option<usize>,
    /// Schema of a list's elements.
    elements: Option<usize>,
}

impl FormerNames {
    /// Collects the former names of a JSON Schema; references lead to its `$defs`.
    pub fn new(schema: &Value) -> Self {
        let mut collector = Collector { schema, shapes: Vec::new(), known: BTreeMap::new() };
        collector.shape(schema);
        let mut shapes = collector.shapes;
        prune(&mut shapes);
        Self { shapes }
    }

    /// Reports whether the schema has no former name.
    pub fn is_empty(&self) -> bool {
        self.shapes.iter().all(|shape| shape.names.is_empty())
    }

    /// Gives settings of a document their present names.
    pub fn rename(&self, document: &mut Value) -> RenamedSettings {
        let mut all = RenamedSettings::default();
        if self.is_empty() {
            return all;
        }
        for _ in 0..MAX_PASSES {
            let mut found = RenamedSettings::default();
            self.find(0, Some(document), document, &mut String::new(), 0, &mut found);
            let written: FormerPlaces = all.renamed.iter().cloned().collect();
            let as_written =
                |one: RenamedSetting| RenamedSetting { former: written.find(&one.former), ..one };
            // Told once: not as an unknown key besides.
            found.conflicts.iter().for_each(|one| remove(document, &one.former));
            all.conflicts.extend(found.conflicts.into_iter().map(as_written));
            found.renamed.retain(|one| move_setting(document, one));
            found.empty.iter().for_each(|container| remove(document, container));
            if found.renamed.is_empty() {
                break;
            }
            all.renamed.extend(found.renamed.into_iter().map(as_written));
        }
        all.conflicts.sort_by(|a, b| a.former.cmp(&b.former));
        all.conflicts.dedup();
        all
    }

    fn find(
        &self,
        shape: usize,
        value: Option<&Value>,
        document: &Value,
        pointer: &mut String,
        absent: usize,
        found: &mut RenamedSettings,
    ) {
        let Some(shape) = self.shapes.get(shape) else { return };
        for (key, path) in &shape.names {
            let is_beside = !path.contains('/');
            if is_beside && value.is_none_or(|value| value.get(path).is_none()) {
                continue;
            }
            let Some(former) = resolve(pointer, path) else { continue };
            let container = split(&former).0;
            match document.pointer(&former) {
                Some(_) => {}
                None => {
                    if is_empty_object(document.pointer(container)) {
                        found.empty.insert(container.to_owned());
                    }
                    continue;
                }
            }
            let present = join_pointer(pointer, key);
            let is_given = value.is_some_and(|value| value.get(key).is_some());
            let list = if is_given { &mut found.conflicts } else { &mut found.renamed };
            list.push(RenamedSetting { former, present });
        }
        let length = pointer.len();
        match value {
            Some(Value::Array(elements)) => {
                let Some(inner) = shape.elements else { return };
                for (index, element) in elements.iter().enumerate() {
                    push_token(pointer, index);
                    self.find(inner, Some(element), document, pointer, 0, found);
                    pointer.truncate(length);
                }
                return;
            }
            Some(Value::Object(members)) => {
                for (key, member) in members {
                    let Some(inner) = shape.properties.get(key).copied().or(shape.others) else {
                        continue;
                    };
                    push_token(pointer, key);
                    self.find(inner, Some(member), document, pointer, 0, found);
                    pointer.truncate(length);
                }
            }
            Some(_) => return,
            None => {}
        }
        if absent >= MAX_ABSENT_DEPTH {
            return;
        }
        for (key, inner) in &shape.properties {
            if value.is_some_and(|value| value.get(key).is_some()) {
                continue;
            }
            push_token(pointer, key);
            self.find(*inner, None, document, pointer, absent + 1, found);
            pointer.truncate(length);
        }
    }
}

/// Places in the text as written, by JSON pointers into the renamed document.
#[derive(Clone, Debug, Default)]
pub(crate) struct FormerPlaces(BTreeMap<String, String>);

impl FromIterator<RenamedSetting> for FormerPlaces {
    fn from_iter<I: IntoIterator<Item = RenamedSetting>>(settings: I) -> Self {
        Self(settings.into_iter().map(|one| (one.present, one.former)).collect())
    }
}

impl FormerPlaces {
    pub(crate) fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }

    /// Returns the place in the text as written of a pointer into the renamed document.
    pub(crate) fn find(&self, pointer: &str) -> String {
        let mut moved = pointer;
        while !self.0.is_empty() && !moved.is_empty() {
            if let Some(former) = self.0.get(moved) {
                return format!("{former}{}", &pointer[moved.len()..]);
            }
            moved = split(moved).0;
        }
        pointer.to_owned()
    }
}

struct Collector<'s> {
    schema: &'s Value,
    shapes: Vec<Shape>,
    /// Shape of each definition.
    known: BTreeMap<String, usize>,
}

impl Collector<'_> {
    /// Adds the shape of a schema and of all below it; returns its index.
    fn shape(&mut self, schema: &Value) -> usize {
        let reference = schema["$ref"].as_str().and_then(|text| text.strip_prefix('#'));
        if let Some(reference) = reference {
            if let Some(known) = self.known.get(reference) {
                return *known;
            }
            let target = self.schema.pointer(reference).unwrap_or(&Value::Null);
            return self.add(target, Some(reference));
        }
        self.add(schema, None)
    }

    fn add(&mut self, schema: &Value, reference: Option<&str>) -> usize {
        let index = self.shapes.len();
        self.shapes.push(Shape::default());
        if let Some(reference) = reference {
            self.known.insert(reference.to_owned(), index);
        }
        let mut shape = Shape::default();
        for part in parts(schema) {
            for (key, property) in part["properties"].as_object().into_iter().flatten() {
                let former = property[FORMER_NAMES].as_array().into_iter().flatten();
                let former = former.filter_map(Value::as_str);
                shape.names.extend(former.map(|path| (key.clone(), path.to_owned())));
                let inner = self.shape(property);
                shape.properties.insert(key.clone(), inner);
            }
            if part["additionalProperties"].is_object() {
                shape.others = Some(self.shape(&part["additionalProperties"]));
            }
            if part["items"].is_object() {
                shape.elements = Some(self.shape(&part["items"]));
            }
        }
        self.shapes[index] = shape;
        index
    }
}

/// Iterates over a schema and the alternatives in it.
fn parts(schema: &Value) -> impl Iterator<Item = &Value> {
    let alternatives = ["allOf", "anyOf", "oneOf"].into_iter();
    let alternatives = alternatives.filter_map(|keyword| schema[keyword].as_array()).flatten();
    std::iter::once(schema).chain(alternatives)
}

/// Removes ways to shapes without former names, so that large documents are searched quickly.
fn prune(shapes: &mut [Shape]) {
    let mut leads: BTreeSet<usize> = BTreeSet::new();
    loop {
        let before = leads.len();
        for (index, shape) in shapes.iter().enumerate() {
            let mut below = shape.properties.values().chain(&shape.others).chain(&shape.elements);
            if !shape.names.is_empty() || below.any(|inner| leads.contains(inner)) {
                leads.insert(index);
            }
        }
        if leads.len() == before {
            break;
        }
    }
    for shape in shapes {
        // A property without former names hides the schema of further members all the same.
        let others_lead = shape.others.is_some_and(|inner| leads.contains(&inner));
        shape.properties.retain(|_, inner| others_lead || leads.contains(inner));
        shape.others = shape.others.filter(|inner| leads.contains(inner));
        shape.elements = shape.elements.filter(|inner| leads.contains(inner));
    }
}

/// Returns the pointer that a path leads to; none above the document.
fn resolve(from: &str, path: &str) -> Option<String> {
    let mut found = from.to_owned();
    for part in path.split('/') {
        if part == ".." {
            found.truncate(found.rfind('/')?);
        } else {
            found = join_pointer(&found, part);
        }
    }
    Some(found)
}

/// Splits a pointer into that of the parent and the last token, still escaped.
fn split(pointer: &str) -> (&str, &str) {
    pointer.rsplit_once('/').unwrap_or(("", pointer))
}

/// Moves a setting to its present name; false where something else stands in the way.
fn move_setting(document: &mut Value, setting: &RenamedSetting) -> bool {
    let former_key = split(&setting.former).1;
    let (present_parent, present_key) = split(&setting.present);
    let Some(value) = document.pointer(&setting.former) else { return false };
    let value = converted(value, former_key, present_key);
    if !can_hold(document, present_parent) {
        return false;
    }
    remove(document, &setting.former);
    let mut place = document;
    for token in pointer::tokens(present_parent) {
        place = match place {
            Value::Object(members) => {
                members.entry(token.into_owned()).or_insert_with(|| Value::Object(Map::new()))
            }
            Value::Array(elements) => {
                let element = token.parse::<usize>().ok().and_then(|at| elements.get_mut(at));
                let Some(element) = element else { return false };
                element
            }
            _ => return false,
        };
    }
    let name = pointer::last_token(&setting.present).into_owned();
    place.as_object_mut().is_some_and(|members| members.insert(name, value).is_none())
}

fn is_empty_object(value: Option<&Value>) -> bool {
    value.and_then(Value::as_object).is_some_and(Map::is_empty)
}

fn remove(document: &mut Value, pointer: &str) {
    let parent = document.pointer_mut(split(pointer).0).and_then(Value::as_object_mut);
    if let Some(members) = parent {
        members.remove(pointer::last_token(pointer).as_ref());
    }
}

/// Reports whether the values on the way to a pointer are objects, elements of arrays, or absent.
fn can_hold(document: &Value, parent: &str) -> bool {
    let mut place = document;
    for token in pointer::tokens(parent) {
        let next = match place {
            Value::Object(members) => members.get(token.as_ref()),
            Value::Array(elements) => token.parse::<usize>().ok().and_then(|at| elements.get(at)),
            _ => return false,
        };
        match next {
            Some(next) => place = next,
            None => return place.is_object(),
        }
    }
    place.is_object()
}

/// Returns a value in the unit of its present name.
pub(crate) fn converted(value: &Value, former: &str, present: &str) -> Value {
    let unit =
        |name: &str| UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit);
    let (Some(from), Some(to), Some(number)) = (unit(former), unit(present), value.as_f64()) else {
        return value.clone();
    };
    if from == to {
        return value.clone();
    }
    let number = rounded(number * (from / to));
    // Whole numbers stay whole, as people write them.
    if number.fract() == 0.0 && number.abs() < 9e15 {
        return Value::from(number as i64);
    }
    Number::from_f64(number).map_or_else(|| value.clone(), Value::Number)
}

/// Returns a number with [`DIGITS`] significant digits.
fn rounded(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return number;
    }
    let text = format!("{number:.*e}", (DIGITS - 1) as usize);
    text.parse().unwrap_or(number)
}

#[cfg(test)]
#[path = "former_names_tests.rs"]
mod tests;
