//! Alarm conditions (OPC 10000-9) as tags, from the fields of their events.

use async_opcua::types::{
    AttributeId, CallMethodRequest, CallRequest, DataValue, EventFilter, ExtensionObject,
    MonitoredItemCreateRequest, MonitoringMode, MonitoringParameters, NodeId, ReadRequest,
    ReadValueId, SimpleAttributeOperand, TimestampsToReturn, Variant,
};
use busbar_plugin_sdk::{Value, ValueKind};
use serde::Deserialize;

use crate::client::{Client, answer};
use crate::fault::Fault;

/// Events that a server may keep between two publishing intervals.
const MAX_EVENTS: u32 = 10_000;
/// Handle of the item whose events these are; those of values are numbered from 0.
pub(crate) const EVENTS_HANDLE: u32 = u32::MAX;
/// Ids of the standard's nodes (OPC 10000-6, Annex A).
const SERVER: u32 = 2253;
const BASE_EVENT_TYPE: u32 = 2041;
const CONDITION_TYPE: u32 = 2782;
const REFRESH_START: u32 = 2787;
const REFRESH_END: u32 = 2788;
const REFRESH_REQUIRED: u32 = 2789;
const EVENT_QUEUE_OVERFLOW: u32 = 3035;
const ACKNOWLEDGEABLE_CONDITION_TYPE: u32 = 2881;
const ALARM_CONDITION_TYPE: u32 = 2915;
const CONDITION_REFRESH: u32 = 3875;
const UNSHELVED: u32 = 2930;
/// Event fields that are selected before those of tags.
const HEAD: [(u32, &[&str]); 5] = [
    (BASE_EVENT_TYPE, &["EventType"]),
    (BASE_EVENT_TYPE, &["Time"]),
    (CONDITION_TYPE, &["Quality"]),
    (CONDITION_TYPE, &["BranchId"]),
    (CONDITION_TYPE, &[]),
];

/// State or field of an alarm condition that can be a tag.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub(crate) enum Field {
    EnabledState,
    ActiveState,
    AckedState,
    ConfirmedState,
    SuppressedState,
    OutOfServiceState,
    /// Shelving of the condition, for a time or for once.
    ShelvingState,
    Retain,
    Severity,
}

const FIELDS: [(Field, u32, &[&str]); 9] = [
    (Field::EnabledState, CONDITION_TYPE, &["EnabledState", "Id"]),
    (Field::ActiveState, ALARM_CONDITION_TYPE, &["ActiveState", "Id"]),
    (Field::AckedState, ACKNOWLEDGEABLE_CONDITION_TYPE, &["AckedState", "Id"]),
    (Field::ConfirmedState, ACKNOWLEDGEABLE_CONDITION_TYPE, &["ConfirmedState", "Id"]),
    (Field::SuppressedState, ALARM_CONDITION_TYPE, &["SuppressedState", "Id"]),
    (Field::OutOfServiceState, ALARM_CONDITION_TYPE, &["OutOfServiceState", "Id"]),
    (Field::ShelvingState, ALARM_CONDITION_TYPE, &["ShelvingState", "CurrentState", "Id"]),
    (Field::Retain, CONDITION_TYPE, &["Retain"]),
    (Field::Severity, BASE_EVENT_TYPE, &["Severity"]),
];

/// Event fields that the alarm mirror reads beside [`FIELDS`].
const TEXTS: [(u32, &[&str]); 4] = [
    (BASE_EVENT_TYPE, &["SourceName"]),
    (BASE_EVENT_TYPE, &["SourceNode"]),
    (BASE_EVENT_TYPE, &["Message"]),
    (CONDITION_TYPE, &["ConditionName"]),
];

/// Fields of an event behind its head.
#[cfg(test)]
pub(crate) const EVENT_FIELDS: usize = FIELDS.len() + TEXTS.len();

/// Returns the index of a field in [`FIELDS`].
#[cfg(test)]
pub(crate) fn place_of(field: Field) -> usize {
    FIELDS.iter().position(|(other, ..)| *other == field).unwrap_or(usize::MAX)
}

/// Content of a condition's event; the fields are in the order of [`FIELDS`] and [`TEXTS`].
pub(crate) struct Told<'a> {
    pub(crate) time: &'a Variant,
    pub(crate) quality: &'a Variant,
    pub(crate) fields: &'a [Variant],
}

impl Told<'_> {
    /// Returns a field's value; none where the condition has no such state.
    pub(crate) fn value(&self, field: Field, kind: ValueKind) -> Option<Value> {
        field.value(kind, self.fields)
    }

    /// Returns whether a state holds; none where the condition has no such state.
    pub(crate) fn is(&self, field: Field) -> Option<bool> {
        match self.value(field, ValueKind::Bool)? {
            Value::Bool(value) => Some(value),
            _ => None,
        }
    }

    pub(crate) fn source_name(&self) -> &Variant {
        self.text(0)
    }

    pub(crate) fn source_node(&self) -> &Variant {
        self.text(1)
    }

    pub(crate) fn message(&self) -> &Variant {
        self.text(2)
    }

    pub(crate) fn condition_name(&self) -> &Variant {
        self.text(3)
    }

    fn text(&self, place: usize) -> &Variant {
        self.fields.get(FIELDS.len() + place).unwrap_or(&Variant::Empty)
    }
}

/// An event that concerns conditions.
pub(crate) enum Event<'a> {
    /// State of a condition; the fields are in the order of [`FIELDS`].
    State { condition: &'a NodeId, told: Told<'a> },
    /// Start of a refresh, which reports all conditions of interest.
    RefreshStart,
    /// End of a refresh: all conditions of interest have been reported.
    RefreshEnd,
    /// Events may be missing: the conditions are to be asked for again.
    RefreshRequired,
    /// No condition's event, or that of a branch.
    Other,
    /// Event with other fields than were selected, so of an unknown condition.
    Unreadable,
}

impl Field {
    /// Reports whether the field can be a tag of this kind.
    pub(crate) fn suits(self, kind: ValueKind) -> bool {
        match self {
            Self::Severity => matches!(kind, ValueKind::I64 | ValueKind::F64),
            _ => kind == ValueKind::Bool,
        }
    }

    /// Returns the value in an event's fields; none where the condition has no such state.
    pub(crate) fn value(self, kind: ValueKind, fields: &[Variant]) -> Option<Value> {
        let place = FIELDS.iter().position(|(field, ..)| *field == self)?;
        Some(match (self, fields.get(place)?) {
            (Self::Severity, Variant::UInt16(severity)) if kind == ValueKind::I64 => {
                Value::I64((*severity).into())
            }
            (Self::Severity, Variant::UInt16(severity)) if kind == ValueKind::F64 => {
                Value::F64((*severity).into())
            }
            (Self::ShelvingState, Variant::NodeId(state)) => {
                Value::Bool(**state != NodeId::new(0, UNSHELVED))
            }
            (Self::Severity | Self::ShelvingState, _) => return None,
            (_, Variant::Boolean(value)) => Value::Bool(*value),
            _ => return None,
        })
    }

    /// Returns the state of a condition that the server no longer reports (OPC 10000-9, 5.5.7):
    /// neither active nor to be acknowledged. All other fields are unknown.
    pub(crate) fn of_no_interest(self) -> Option<Value> {
        match self {
            Self::ActiveState | Self::Retain => Some(Value::Bool(false)),
            Self::AckedState => Some(Value::Bool(true)),
            _ => None,
        }
    }
}

/// Classifies an event by its fields.
pub(crate) fn read_event(fields: &[Variant]) -> Event<'_> {
    let Some(([kind, time, quality, branch, condition], fields)) = fields.split_first_chunk()
    else {
        return Event::Unreadable;
    };
    let is_kind = |id| matches!(kind, Variant::NodeId(kind) if **kind == NodeId::new(0, id));
    if is_kind(REFRESH_START) {
        Event::RefreshStart
    } else if is_kind(REFRESH_END) {
        Event::RefreshEnd
    } else if is_kind(REFRESH_REQUIRED) || is_kind(EVENT_QUEUE_OVERFLOW) {
        Event::RefreshRequired
    } else {
        match condition {
            Variant::Empty => Event::Other,
            Variant::NodeId(id) if id.is_null() || is_branch(branch) => Event::Other,
            Variant::NodeId(condition) => {
                Event::State { condition, told: Told { time, quality, fields } }
            }
            _ => Event::Unreadable,
        }
    }
}

/// Reports whether an event is of a branch: a former state that awaits action, not the condition's
/// current one (OPC 10000-9, 5.5.2.1).
fn is_branch(branch: &Variant) -> bool {
    matches!(branch, Variant::NodeId(branch) if !branch.is_null())
}

/// Returns the monitored item that reports all events of a server.
pub(crate) fn events_item() -> MonitoredItemCreateRequest {
    let operand = |kind: u32, path: &[&str]| SimpleAttributeOperand {
        type_definition_id: NodeId::new(0, kind),
        browse_path: Some(path.iter().map(|name| (*name).into()).collect()),
        // A condition's own id has no path (OPC 10000-9, 5.5.2.1).
        attribute_id: if path.is_empty() { AttributeId::NodeId } else { AttributeId::Value } as u32,
        ..SimpleAttributeOperand::default()
    };
    let head = HEAD.iter().map(|(kind, path)| operand(*kind, path));
    let fields = FIELDS.iter().map(|(_, kind, path)| operand(*kind, path));
    let texts = TEXTS.iter().map(|(kind, path)| operand(*kind, path));
    MonitoredItemCreateRequest {
        item_to_monitor: ReadValueId {
            node_id: NodeId::new(0, SERVER),
            attribute_id: AttributeId::EventNotifier as u32,
            ..ReadValueId::default()
        },
        monitoring_mode: MonitoringMode::Reporting,
        requested_parameters: MonitoringParameters {
            client_handle: EVENTS_HANDLE,
            sampling_interval: 0.0,
            filter: ExtensionObject::from_message(EventFilter {
                select_clauses: Some(head.chain(fields).chain(texts).collect()),
                ..EventFilter::default()
            }),
            queue_size: MAX_EVENTS,
            discard_oldest: true,
        },
    }
}

/// Has the server tell all conditions of interest anew. It changes nothing there.
pub(crate) async fn refresh(client: &Client, subscription: u32) -> Result<(), Fault> {
    let call = CallMethodRequest {
        object_id: NodeId::new(0, CONDITION_TYPE),
        method_id: NodeId::new(0, CONDITION_REFRESH),
        input_arguments: Some(vec![Variant::UInt32(subscription)]),
    };
    let request = CallRequest {
        request_header: client.header(client.limit()),
        methods_to_call: Some(vec![call]),
    };
    let answer = answer!(client, "asking for all conditions", Call, request)?;
    let status = answer.results.unwrap_or_default().first().map(|result| result.status_code);
    match status {
        Some(status) if !status.is_bad() => Ok(()),
        Some(status) => Err(Fault::Refused { what: "asking for all conditions", status }),
        None => Err(Fault::Server("no result of ConditionRefresh")),
    }
}

/// Reads for each of these conditions whether the server has its node.
pub(crate) async fn known(client: &Client, conditions: &[NodeId]) -> Result<Vec<bool>, Fault> {
    let node = |id: &NodeId| ReadValueId {
        node_id: id.clone(),
        attribute_id: AttributeId::NodeClass as u32,
        ..ReadValueId::default()
    };
    let request = ReadRequest {
        request_header: client.header(client.limit()),
        max_age: 0.0,
        timestamps_to_return: TimestampsToReturn::Neither,
        nodes_to_read: Some(conditions.iter().map(node).collect()),
    };
    let answer = answer!(client, "looking for conditions", Read, request)?;
    let results = answer.results.unwrap_or_default();
    let is_known = |value: &DataValue| {
        let has_class = matches!(value.value, Some(Variant::Int32(_)));
        has_class && value.status.is_none_or(|status| status.is_good())
    };
    Ok(results.iter().map(is_known).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(id: u32) -> Variant {
        Variant::from(NodeId::new(0, id))
    }

    #[test]
    fn events_are_told_apart() {
        let none = || Variant::Empty;
        let event = |kind, condition| [node(kind), none(), none(), none(), condition];
        let state = event(CONDITION_TYPE, node(7));
        assert!(matches!(read_event(&state), Event::State { told: Told { fields: [], .. }, .. }));
        let mut branch = state.clone();
        branch[3] = node(1);
        assert!(matches!(read_event(&branch), Event::Other));
        branch[3] = Variant::from(NodeId::null());
        assert!(matches!(read_event(&branch), Event::State { .. }));
        let other = event(BASE_EVENT_TYPE, none());
        assert!(matches!(read_event(&other), Event::Other));
        assert!(matches!(read_event(&other[1..]), Event::Unreadable));
        let text = event(CONDITION_TYPE, Variant::from("Hot"));
        assert!(matches!(read_event(&text), Event::Unreadable));
        let start = event(REFRESH_START, none());
        assert!(matches!(read_event(&start), Event::RefreshStart));
        let end = event(REFRESH_END, none());
        assert!(matches!(read_event(&end), Event::RefreshEnd));
        let overflow = event(EVENT_QUEUE_OVERFLOW, none());
        assert!(matches!(read_event(&overflow), Event::RefreshRequired));
    }

    #[test]
    fn states_are_read_and_those_that_a_condition_lacks_are_none() {
        let mut fields = vec![Variant::Empty; FIELDS.len()];
        fields[1] = true.into();
        fields[6] = node(UNSHELVED);
        fields[8] = Variant::UInt16(700);
        let bool = |field: Field, fields: &[Variant]| field.value(ValueKind::Bool, fields);
        assert_eq!(bool(Field::ActiveState, &fields), Some(Value::Bool(true)));
        assert_eq!(bool(Field::AckedState, &fields), None);
        assert_eq!(bool(Field::ShelvingState, &fields), Some(Value::Bool(false)));
        fields[6] = node(2929);
        assert_eq!(bool(Field::ShelvingState, &fields), Some(Value::Bool(true)));
        assert_eq!(Field::Severity.value(ValueKind::I64, &fields), Some(Value::I64(700)));
        assert_eq!(Field::Severity.value(ValueKind::I64, &fields[..3]), None);
        assert_eq!(Field::Severity.value(ValueKind::Text, &fields), None);
        assert!(Field::Severity.suits(ValueKind::F64) && !Field::Severity.suits(ValueKind::Bool));
        assert!(!Field::Severity.suits(ValueKind::Text) && !Field::Retain.suits(ValueKind::Text));
    }
}
