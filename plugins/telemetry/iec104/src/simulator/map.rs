//! The objects of a simulated station: tags laid out by their addresses.

use std::collections::HashMap;
use std::ops::Range;
use std::time::SystemTime;

use busbar_plugin_sdk::simulation::Signal;
use busbar_plugin_sdk::{Error, Value, ValueKind};

use crate::codec;
use crate::points::{ObjectType, Point, Points};

/// Tags that one message names.
const MAX_TAGS_IN_MESSAGE: usize = 5;
/// Groups of a station interrogation, and of a counter interrogation (IEC 60870-5-101,
/// 7.2.6.22 and 7.2.6.23).
const GROUPS: usize = 16;
const COUNTER_GROUPS: usize = 4;

/// Kind of information object that carries a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Form {
    Single,
    Double,
    Step,
    Bits,
    Scaled,
    Float,
    Counter,
}

/// Information object of the simulated station.
#[derive(Debug)]
pub(super) struct SimulatedObject {
    pub(super) common_address: u16,
    pub(super) address: u32,
    form: Form,
    /// One; of a bitstring several, each with its bit.
    parts: Vec<(Point, Signal)>,
}

/// All objects of all common addresses, those of one type together.
#[derive(Debug)]
pub(super) struct StationMap {
    objects: Vec<SimulatedObject>,
    by_address: HashMap<(u16, u32), usize>,
    common_addresses: Vec<u16>,
}

/// Selection of objects by a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ObjectSelection {
    /// All but counters, or one of sixteen groups, from 0.
    Values(Option<usize>),
    /// Counters, or one of four groups, from 0.
    Counters(Option<usize>),
}

impl StationMap {
    /// Lays out points, and remarks on those whose object is another's already.
    ///
    /// # Errors
    /// [`Error::settings`] with every point that cannot hold its signal's values.
    pub(super) fn new(
        points: &Points,
        mut signal_of: impl FnMut(u32) -> Option<Signal>,
    ) -> Result<(Self, Option<String>), Error> {
        let (mut faults, mut shared) = (Vec::new(), Vec::new());
        let mut objects: Vec<SimulatedObject> = Vec::new();
        // Points are in order of their addresses.
        for point in points.all() {
            let Some(signal) = signal_of(point.tag) else { continue };
            let form = match form_of(point, &signal) {
                Ok(form) => form,
                Err(fault) => {
                    faults.push(fault);
                    continue;
                }
            };
            let key = (point.common_address, point.object_address);
            match objects.last_mut().filter(|o| (o.common_address, o.address) == key) {
                Some(object) if object.takes(form, point) => {
                    object.parts.push((point.clone(), signal));
                }
                Some(_) => shared.push(point.id.as_str()),
                None => objects.push(SimulatedObject {
                    common_address: key.0,
                    address: key.1,
                    form,
                    parts: vec![(point.clone(), signal)],
                }),
            }
        }
        if !faults.is_empty() {
            return Err(Error::settings(faults.join("; ")));
        }
        objects.sort_by_key(|object| (object.common_address, object.form, object.address));
        let key = |object: &SimulatedObject| (object.common_address, object.address);
        let by_address = objects.iter().enumerate().map(|(i, object)| (key(object), i)).collect();
        let map = Self { objects, by_address, common_addresses: points.common_addresses() };
        Ok((map, remark(&shared)))
    }

    pub(super) fn objects(&self) -> &[SimulatedObject] {
        &self.objects
    }

    pub(super) fn common_addresses(&self) -> &[u16] {
        &self.common_addresses
    }

    /// The object at an address.
    pub(super) fn find(&self, common_address: u16, address: u32) -> Option<usize> {
        self.by_address.get(&(common_address, address)).copied()
    }

    /// Returns the range of objects that a request selects. Groups are parts of equal length.
    pub(super) fn range(&self, common_address: u16, wanted: ObjectSelection) -> Range<usize> {
        let begin = self.objects.partition_point(|o| o.common_address < common_address);
        let end = self.objects.partition_point(|o| o.common_address <= common_address);
        let is_value =
            |o: &SimulatedObject| (o.common_address, o.form) < (common_address, Form::Counter);
        let counters = self.objects.partition_point(is_value).clamp(begin, end);
        match wanted {
            ObjectSelection::Values(group) => part(begin..counters, GROUPS, group),
            ObjectSelection::Counters(group) => part(counters..end, COUNTER_GROUPS, group),
        }
    }
}

fn part(all: Range<usize>, groups: usize, group: Option<usize>) -> Range<usize> {
    let Some(group) = group else { return all };
    let at = |group: usize| all.start + all.len() * group / groups;
    at(group)..at(group + 1)
}

impl SimulatedObject {
    fn takes(&self, form: Form, point: &Point) -> bool {
        let is_free = |(part, _): &(Point, Signal)| part.bit.is_some() && part.bit != point.bit;
        (self.form, form) == (Form::Bits, Form::Bits)
            && point.bit.is_some()
            && self.parts.iter().all(is_free)
    }

    /// The value at an instant.
    pub(super) fn value_at(&self, time: SystemTime) -> codec::Value {
        if self.form == Form::Bits && self.parts.iter().all(|(point, _)| point.bit.is_some()) {
            let bits = self.parts.iter().map(|(point, signal)| match signal.at(time) {
                Value::Bool(true) => 1 << point.bit.unwrap_or_default(),
                _ => 0,
            });
            return codec::Value::Bits(bits.fold(0, |all, bit| all | bit));
        }
        let part = self.parts.first();
        part.map_or(codec::Value::Single(false), |(p, s)| value_of(self.form, p, s.at(time)))
    }

    /// Reports whether a counter interrogation selects the object.
    #[cfg(test)]
    pub(super) fn is_counter(&self) -> bool {
        self.form == Form::Counter
    }
}

/// The form that can carry all values of a signal to its tag.
fn form_of(point: &Point, signal: &Signal) -> Result<Form, String> {
    let (low, high) = signal.range();
    let raw = |value: f64| match point.kind {
        ValueKind::F64 => (value - point.offset) / point.scale,
        _ => value,
    };
    let (low, high) = (raw(low).min(raw(high)), raw(low).max(raw(high)));
    let holds = |least: f64, most: f64| low.round() >= least && high.round() <= most;
    let form = match (point.kind, point.object_type, point.bit) {
        (ValueKind::Text, ..) => {
            return Err(format!("tag '{}': no object carries a text", point.id));
        }
        (ValueKind::Bool, _, Some(_)) => Form::Bits,
        (ValueKind::Bool, ..) => Form::Single,
        (ValueKind::DoublePoint, ..) => Form::Double,
        (_, ObjectType::Step, _) => Form::Step,
        (_, ObjectType::Counter, _) => Form::Counter,
        (ValueKind::F64, ..) => Form::Float,
        (_, ObjectType::Bitstring, _) => Form::Bits,
        (_, ObjectType::Measured, _) => Form::Scaled,
        _ if holds(i16::MIN.into(), i16::MAX.into()) => Form::Scaled,
        _ => Form::Bits,
    };
    let fits = match form {
        Form::Single | Form::Double => true,
        Form::Bits => point.bit.is_some() || holds(0.0, u32::MAX.into()),
        Form::Step => holds(-64.0, 63.0),
        Form::Scaled => holds(i16::MIN.into(), i16::MAX.into()),
        Form::Counter => holds(i32::MIN.into(), i32::MAX.into()),
        Form::Float => low >= f32::MIN.into() && high <= f32::MAX.into(),
    };
    if fits {
        return Ok(form);
    }
    Err(format!(
        "tag '{}': its simulated values, {low} to {high} on the wire, do not fit an object of type \
         {form:?}: change type, scale or offset, or give the tag a \"simulate\" with another base \
         and amplitude",
        point.id
    ))
}

/// A value in its form; its range was checked when the object was made.
fn value_of(form: Form, point: &Point, value: Value) -> codec::Value {
    let raw = match value {
        Value::F64(value) => (value - point.offset) / point.scale,
        Value::I64(value) => value as f64,
        Value::Bool(is_on) => f64::from(u8::from(is_on)),
        Value::DoublePoint(position) => f64::from(position.bits()),
        // No form carries one.
        Value::Text(_) => f64::NAN,
    };
    // Casts keep what fits, and it does.
    let whole = raw.round();
    match form {
        Form::Single => codec::Value::Single(whole != 0.0),
        Form::Double => codec::Value::Double(whole as u8),
        Form::Step => codec::Value::Step { position: whole as i8, is_transient: false },
        Form::Bits => codec::Value::Bits(whole as u32),
        Form::Scaled => codec::Value::Scaled(whole as i16),
        Form::Float => codec::Value::Float(raw as f32),
        Form::Counter => codec::Value::Counter {
            count: whole as i32,
            sequence: 0,
            is_carried: false,
            is_adjusted: false,
        },
    }
}

fn remark(shared: &[&str]) -> Option<String> {
    let named = shared.get(..MAX_TAGS_IN_MESSAGE).unwrap_or(shared);
    (!shared.is_empty()).then(|| {
        format!(
            "{} tags have the object of another tag and show what they make of that: {}{}",
            shared.len(),
            named.join(", "),
            if shared.len() > named.len() { ", ..." } else { "" }
        )
    })
}

#[cfg(test)]
#[path = "map_tests.rs"]
pub(super) mod tests;
