//! Model of a server: objects of which the truth is known, report control blocks that
//! report them, and answers to what a client asks.

use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{FaultGenerator, TruthMoment};
use busbar_plugin_sdk::{Text, Value as TagValue, ValueKind};
use iec61850_rs::ber::Cursor;
use iec61850_rs::common::{ReasonCode, Source};
use iec61850_rs::proto::data::{DataView, Value};
use iec61850_rs::proto::mms::typespec::{Component, TypeSpec};
use iec61850_rs::proto::mms::{
    AccessResult, ConfirmedRequest, ConfirmedResponse, Mms, ObjectName, VariableAccess,
    VariableSpecification, WriteResult,
};
use iec61850_rs::{Quality as Bits, TimeQuality, UtcTime, Validity};

use super::report_block::{Instants, ModelBlock, Outgoing, Part};
use crate::service::LIMITS;

/// Objects: those of each block, of which the last has no quality, and those that are polled.
pub(super) const OBJECTS: usize = 12;
pub(super) const BLOCKS: usize = 3;
pub(super) const OBJECTS_A_BLOCK: usize = 3;
/// The object without quality and time.
const BARE: usize = 8;
/// Objects that are texts, of which one is reported and one polled.
const TEXTS: [usize; 2] = [4, 10];
pub(super) const DOMAIN: &str = "IED1LD0";
const ACCESS_DENIED: i64 = 3;
const NON_EXISTENT: i64 = 10;
pub(super) const TEMPORARILY_UNAVAILABLE: i64 = 2;

/// Data object of the simulated device.
#[derive(Clone, Copy)]
pub(super) struct Object {
    pub(super) value: i64,
    quality: Bits,
    time: UtcTime,
    /// Count of its changes.
    pub(super) revision: u64,
}

/// Behaviour in which servers differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct ServerQuirks {
    /// Options of reports can be set; else they stay as they are.
    pub(super) takes_options: bool,
    pub(super) has_reasons: bool,
    pub(super) names_data_sets: bool,
    pub(super) has_numbers: bool,
    /// All blocks have one `RptID`.
    pub(super) shares_id: bool,
    /// Last number before `SqNum` begins anew.
    pub(super) last_number: u32,
    pub(super) integrity: Duration,
    pub(super) buffer_time: Duration,
}

/// An answer, with what it says.
pub(super) struct Reply {
    pub(super) pdu: Vec<u8>,
    /// Objects that it has, with the revisions of their values.
    pub(super) told: Vec<(usize, u64)>,
    /// The object that cannot be read.
    pub(super) failed: Option<usize>,
    /// Marks the answer to a read of values.
    pub(super) is_read: bool,
}

/// Simulated device with its model.
pub(super) struct Device {
    pub(super) objects: [Object; OBJECTS],
    pub(super) blocks: Vec<ModelBlock>,
    pub(super) quirks: ServerQuirks,
    /// Reports that wait to be sent.
    pub(super) reports: Vec<Outgoing>,
    next_value: i64,
    last_stamp: Duration,
    pub(super) at: Instants,
}

pub(super) fn object_item(object: usize) -> String {
    format!("GGIO1$ST$Obj{object}")
}

fn object_of(item: &str) -> Option<(usize, Part)> {
    let rest = item.strip_prefix("GGIO1$ST$Obj")?;
    let (number, part) = rest.split_once('$').map_or((rest, None), |(n, part)| (n, Some(part)));
    let part = match part {
        None => Part::Whole,
        Some("stVal") => Part::Value,
        Some("q") => Part::Quality,
        _ => Part::Time,
    };
    Some((number.parse().ok().filter(|number| *number < OBJECTS)?, part))
}

impl Device {
    pub(super) fn new(quirks: ServerQuirks, at: Instants) -> Self {
        let time = UtcTime::from_unix(1_700_000_000, 0, TimeQuality::SYNCHRONIZED);
        let object = Object { value: 0, quality: Bits::GOOD, time, revision: 0 };
        let blocks = (0..BLOCKS).map(|index| ModelBlock::new(index, &quirks)).collect();
        let mut objects = [object; OBJECTS];
        (0..OBJECTS).for_each(|index| objects[index].value = index as i64);
        let (reports, last_stamp) = (Vec::new(), Duration::ZERO);
        Self { objects, blocks, quirks, reports, next_value: 100, last_stamp, at }
    }

    /// The value that is true, where one is.
    pub(super) fn truth(&self, object: usize) -> Option<TagValue> {
        let Object { value, quality, .. } = self.objects[object];
        let is_good = object == BARE || quality == Bits::GOOD;
        is_good.then(|| match TEXTS.contains(&object) {
            true => TagValue::Text(Text::cut(&text_of(value))),
            false => TagValue::I64(value),
        })
    }

    /// Returns the type of the tag of an object.
    pub(super) fn kind(object: usize) -> ValueKind {
        if TEXTS.contains(&object) { ValueKind::Text } else { ValueKind::I64 }
    }

    /// Gives an object another value, or another quality.
    pub(super) fn change(&mut self, object: usize, random: &mut FaultGenerator, is_told: bool) {
        self.next_value += 1;
        let mut now = self.objects[object];
        now.revision += 1;
        let is_quality = object != BARE && random.one_in(4);
        if is_quality {
            now.quality = match random.below(8) {
                0 => Bits { validity: Validity::Invalid, ..Bits::GOOD },
                1 => Bits { validity: Validity::Questionable, ..Bits::GOOD },
                2 => Bits { test: true, ..Bits::GOOD },
                3 => Bits { source: Source::Substituted, ..Bits::GOOD },
                4 => Bits { old_data: true, validity: Validity::Questionable, ..Bits::GOOD },
                _ => Bits::GOOD,
            };
        } else {
            now.value = self.next_value;
        }
        let is_buffered = object < OBJECTS_A_BLOCK;
        now.time = self.stamp(now.time, is_buffered, random);
        self.objects[object] = now;
        if is_told {
            let parts: &[Part] = if is_quality { &[Part::Quality] } else { &[Part::Value] };
            self.report_change(object, parts);
        }
    }

    /// Makes all qualities and clocks good, for what has to be good in the end.
    pub(super) fn calm(&mut self) {
        let since = self.at.wall.duration_since(UNIX_EPOCH).unwrap_or_default();
        let seconds = since.as_secs() as u32;
        for object in 0..OBJECTS {
            let one = &mut self.objects[object];
            if one.quality != Bits::GOOD || one.time.quality.clock_failure {
                one.quality = Bits::GOOD;
                one.time = UtcTime::from_unix(seconds, 0, TimeQuality::SYNCHRONIZED);
                one.revision += 1;
                self.report_change(object, &[Part::Quality]);
            }
        }
    }

    /// A time of the server's clock: right, of a clock that says of itself that it is not, or
    /// left as it was.
    fn stamp(&mut self, last: UtcTime, is_buffered: bool, random: &mut FaultGenerator) -> UtcTime {
        let right = TimeQuality::SYNCHRONIZED;
        let quality = match random.below(20) {
            0 => TimeQuality { clock_failure: true, ..right },
            1 => TimeQuality { clock_not_synchronized: true, ..right },
            // Out of a buffer it would order what came later before.
            2 if !is_buffered => return last,
            3 => return UtcTime::from_unix(0, 0, right),
            _ => right,
        };
        // No two changes are at one instant.
        let since = self.at.wall.duration_since(UNIX_EPOCH).unwrap_or_default();
        self.last_stamp = since.max(self.last_stamp + Duration::from_micros(1));
        let Self { last_stamp, .. } = self;
        UtcTime::from_unix(last_stamp.as_secs() as u32, last_stamp.subsec_nanos(), quality)
    }

    fn report_change(&mut self, object: usize, parts: &[Part]) {
        let Self { objects, blocks, reports, at, .. } = self;
        for block in blocks {
            block.note_change(objects, object, parts, *at, reports);
        }
    }

    /// Tells the entries that were just made when that was.
    pub(super) fn date(&mut self, moment: TruthMoment) {
        self.blocks.iter_mut().for_each(|block| block.date(moment));
        for report in &mut self.reports {
            report.moment.get_or_insert(moment);
        }
        self.at.before = moment;
    }

    /// Reports what is due.
    pub(super) fn tick(&mut self) {
        let Self { objects, blocks, reports, at, .. } = self;
        for block in blocks {
            block.tick(objects, *at, reports);
        }
    }

    /// Closes the connection to the client.
    pub(super) fn close(&mut self) {
        self.blocks.iter_mut().for_each(ModelBlock::disable);
        self.reports.clear();
    }

    /// Restarts the device: other values, and nothing is kept.
    pub(super) fn restart(&mut self, random: &mut FaultGenerator) {
        self.close();
        let quirks = self.quirks;
        self.blocks = (0..BLOCKS).map(|index| ModelBlock::new(index, &quirks)).collect();
        for object in 0..OBJECTS {
            self.change(object, random, false);
        }
    }

    /// Value of a data object or of a part of it.
    pub(super) fn value(objects: &[Object; OBJECTS], object: usize, part: Part) -> Value {
        let Object { value, quality, time, .. } = objects[object];
        let own = match TEXTS.contains(&object) {
            true => Value::VisibleString(text_of(value)),
            false => Value::Integer(value),
        };
        let members = [own, Value::quality(quality), Value::UtcTime(time)];
        match part {
            Part::Whole if object == BARE => Value::Structure(members[..1].to_vec()),
            Part::Whole => Value::Structure(members.to_vec()),
            Part::Value => members[0].clone(),
            Part::Quality => members[1].clone(),
            Part::Time => members[2].clone(),
        }
    }

    fn read(&self, name: &ObjectName<'_>) -> Result<(Value, Option<usize>), i64> {
        let ObjectName::DomainSpecific { item, .. } = name else { return Err(NON_EXISTENT) };
        if let Some((object, part)) = object_of(item) {
            return Ok((Self::value(&self.objects, object, part), Some(object)));
        }
        let block = self.blocks.iter().find_map(|block| Some((block, block.attribute(item)?)));
        let (block, attribute) = block.ok_or(NON_EXISTENT)?;
        block.read(attribute).map(|value| (value, None)).ok_or(NON_EXISTENT)
    }

    fn write(&mut self, name: &ObjectName<'_>, value: &Value) -> Result<(), i64> {
        let ObjectName::DomainSpecific { item, .. } = name else { return Err(NON_EXISTENT) };
        let Self { objects, blocks, quirks, reports, at, .. } = self;
        for block in blocks {
            let Some(attribute) = block.attribute(item).map(str::to_owned) else { continue };
            if attribute == "OptFlds" && !quirks.takes_options {
                return Err(ACCESS_DENIED);
            }
            let is_taken = block.write(&attribute, value, objects, *at, reports);
            return if is_taken { Ok(()) } else { Err(ACCESS_DENIED) };
        }
        Err(NON_EXISTENT)
    }

    /// Answers a request; where it fails, single values or all of it are refused.
    pub(super) fn answer(&mut self, id: i64, request: &[u8], fails: Option<usize>) -> Reply {
        let Ok(Mms::ConfirmedRequest { service, .. }) = Mms::parse(request, &LIMITS) else {
            panic!("no request");
        };
        let (mut told, mut failed, mut is_read) = (Vec::new(), None, false);
        let respond = |service| {
            Mms::ConfirmedResponse { invoke_id: id, service }.to_vec().expect("it can be encoded")
        };
        let pdu = match &service {
            ConfirmedRequest::Read { access, .. } => {
                let results: Vec<_> = names(access).map(|name| self.read(name)).collect();
                is_read = results.iter().any(|result| matches!(result, Ok((_, Some(_)))));
                let failing = fails.filter(|_| is_read).map(|index| index % results.len());
                let mut encoded = Vec::new();
                for (index, result) in results.into_iter().enumerate() {
                    encoded.push(match result {
                        Ok((_, Some(object))) if failing == Some(index) => {
                            failed = Some(object);
                            Err(TEMPORARILY_UNAVAILABLE)
                        }
                        Ok((value, object)) => {
                            told.extend(
                                object.map(|object| (object, self.objects[object].revision)),
                            );
                            Ok(Value::encode_all(&[value]).expect("it can be encoded"))
                        }
                        Err(code) => Err(code),
                    });
                }
                let results = encoded.iter().map(|result| access_result(result.as_ref()));
                respond(ConfirmedResponse::Read { access: None, results: results.collect() })
            }
            ConfirmedRequest::Write { access, values } => {
                let values: Vec<_> = values
                    .iter()
                    .map(|value| DataView::from_tlv(*value).and_then(|v| v.to_owned(&LIMITS)))
                    .collect::<Result<_, _>>()
                    .expect("values can be decoded");
                let written =
                    names(access).zip(&values).map(|(name, value)| match self.write(name, value) {
                        Ok(()) => WriteResult::Success,
                        Err(code) => WriteResult::Failure(code),
                    });
                respond(ConfirmedResponse::Write(written.collect()))
            }
            ConfirmedRequest::GetNamedVariableListAttributes(ObjectName::DomainSpecific {
                item,
                ..
            }) => {
                let block = self.blocks.iter().find(|block| block.set == *item);
                let members = block.expect("the data set of a block").member_items();
                let variable = |item| {
                    VariableSpecification::Name(ObjectName::DomainSpecific { domain: DOMAIN, item })
                };
                let variables = members.iter().map(|item| variable(item)).collect();
                respond(ConfirmedResponse::GetNamedVariableListAttributes {
                    deletable: false,
                    variables,
                })
            }
            ConfirmedRequest::GetVariableAccessAttributes(ObjectName::DomainSpecific {
                item,
                ..
            }) => {
                let (object, _) = object_of(item).expect("an object");
                respond(ConfirmedResponse::GetVariableAccessAttributes {
                    deletable: false,
                    type_spec: type_of(object),
                })
            }
            _ => respond(ConfirmedResponse::Identify { vendor: "v", model: "m", revision: "r" }),
        };
        Reply { pdu, told, failed, is_read }
    }
}

/// Names of the variables of a request.
fn names<'a>(access: &'a VariableAccess<'a>) -> impl Iterator<Item = &'a ObjectName<'a>> {
    let VariableAccess::ListOfVariable(list) = access else { panic!("a list of variables") };
    list.iter().map(|variable| match variable {
        VariableSpecification::Name(name) => name,
        other => panic!("{other:?}"),
    })
}

pub(super) fn access_result<'a>(encoded: Result<&'a Vec<u8>, &'a i64>) -> AccessResult<'a> {
    match encoded {
        Ok(bytes) => {
            let element = Cursor::new(bytes).next_required().expect("one element");
            AccessResult::Success(element)
        }
        Err(code) => AccessResult::Failure(*code),
    }
}

/// Returns the text that an object has instead of its number.
fn text_of(value: i64) -> String {
    format!("mode {value}")
}

fn type_of(object: usize) -> TypeSpec {
    let component = |name: &str, type_spec| Component { name: Some(name.into()), type_spec };
    let own = match TEXTS.contains(&object) {
        true => TypeSpec::VisibleString(-255),
        false => TypeSpec::Integer(64),
    };
    let mut components = vec![component("stVal", own)];
    if object != BARE {
        components.push(component("q", TypeSpec::BitString(-13)));
        components.push(component("t", TypeSpec::UtcTime));
    }
    TypeSpec::Structure { packed: false, components }
}

/// Reason of a change, by the part that changed.
pub(super) fn change_of(parts: &[Part]) -> ReasonCode {
    let is_quality = parts.contains(&Part::Quality);
    ReasonCode::NONE.with_data_change(!is_quality).with_quality_change(is_quality)
}
