//! The MMS services in use (IEC 61850-8-1, 7 to 9; ISO 9506): requests to bytes, and
//! bytes to answers. Nothing else is ever sent, and `Write` goes to attributes of report
//! control blocks alone.

use std::fmt;

use iec61850_rs::ber::{Cursor, Tlv};
use iec61850_rs::common::data_access_reason;
use iec61850_rs::proto::data::{DataView, Value, tag};
use iec61850_rs::proto::mms::typespec::TypeSpec;
use iec61850_rs::proto::mms::{
    AccessResult, ConfirmedRequest, ConfirmedResponse, Mms, ObjectName, ObjectScope, ServiceError,
    VariableAccess, VariableSpecification, WriteResult, object_class,
};
use iec61850_rs::{Error, Limits};

/// Limits of what is accepted from a server: members of a structure or of a data set, levels of a
/// structure, bytes of a text.
pub(crate) const LIMITS: Limits =
    Limits { max_dataset_members: 8192, max_depth: 16, ..Limits::DEFAULT };

/// A variable, a data set or a control block in a logical device.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Name {
    /// Logical device of the name.
    pub(crate) domain: String,
    /// Item of the name, such as `MMXU1$MX$TotW`.
    pub(crate) item: String,
}

impl Name {
    /// Parses a name of the form `LD/LN$...`, as servers write it.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (domain, item) = text.split_once('/')?;
        let is_whole = !domain.is_empty() && !item.is_empty();
        is_whole.then(|| Self { domain: domain.into(), item: item.into() })
    }

    /// A part of it.
    pub(crate) fn part(&self, name: &str) -> Self {
        Self { domain: self.domain.clone(), item: format!("{}${name}", self.item) }
    }

    fn as_mms(&self) -> ObjectName<'_> {
        ObjectName::DomainSpecific { domain: &self.domain, item: &self.item }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.domain, self.item)
    }
}

/// Request to a server.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Request {
    /// Type of a variable (`GetVariableAccessAttributes`).
    Type(Name),
    /// Values of these variables.
    Read(Vec<Name>),
    /// Members of a data set (`GetNamedVariableListAttributes`).
    Members(Name),
    /// Attributes of a report control block.
    Write(Vec<(Name, Value)>),
    /// The logical devices, or what a logical device has, after a name that came before
    /// (`GetNameList`).
    Names { device: Option<String>, after: Option<String> },
    /// Nothing but an answer.
    Identify,
}

/// Answer of a server.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Answer {
    Type(TypeSpec),
    /// Values read, as many as were requested.
    Values(Vec<Result<Value, AccessError>>),
    /// Nothing stands for a part of an array.
    Members(Vec<Option<Name>>),
    /// Results of writes, as many as were requested.
    Written(Vec<Result<(), AccessError>>),
    Names {
        names: Vec<String>,
        more_follow: bool,
    },
    Identified,
    /// In words, why there is no answer.
    Refused(String),
}

/// Error code `DataAccessError` (ISO 9506-2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AccessError(pub(crate) i64);

impl AccessError {
    pub(crate) const HARDWARE_FAULT: Self = Self(1);
    pub(crate) const TEMPORARILY_UNAVAILABLE: Self = Self(2);
    pub(crate) const NON_EXISTENT: Self = Self(10);
}

impl fmt::Display for AccessError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match data_access_reason(self.0) {
            Some(reason) => f.write_str(reason),
            None => write!(f, "data access error {}", self.0),
        }
    }
}

impl Request {
    /// Returns the name of the request for messages.
    pub(crate) fn what(&self) -> &'static str {
        match self {
            Self::Type(_) => "the question what a variable is made of",
            Self::Read(_) => "a read request",
            Self::Members(_) => "the question what a data set is made of",
            Self::Write(_) => "the setting of a report control block",
            Self::Names { .. } => "the question for names",
            Self::Identify => "a test of the connection",
        }
    }

    /// Hands the request on as MMS has it.
    ///
    /// # Errors
    /// Those of `send`, and a value that cannot be encoded.
    pub(crate) fn with_service<T>(
        &self,
        send: impl FnOnce(ConfirmedRequest<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        match self {
            Self::Type(name) => send(ConfirmedRequest::GetVariableAccessAttributes(name.as_mms())),
            Self::Read(names) => {
                let access = list_of(names.iter());
                send(ConfirmedRequest::Read { specification_with_result: false, access })
            }
            Self::Members(name) => {
                send(ConfirmedRequest::GetNamedVariableListAttributes(name.as_mms()))
            }
            Self::Write(writes) => {
                let encoded: Vec<Vec<u8>> = writes
                    .iter()
                    .map(|(_, value)| Value::encode_all(std::slice::from_ref(value)))
                    .collect::<Result<_, _>>()?;
                let values = encoded
                    .iter()
                    .map(|bytes| Cursor::new(bytes).next_required())
                    .collect::<Result<_, _>>()?;
                let access = list_of(writes.iter().map(|(name, _)| name));
                send(ConfirmedRequest::Write { access, values })
            }
            Self::Names { device, after } => {
                let (object_class, scope) = match device {
                    Some(device) => {
                        (object_class::NAMED_VARIABLE, ObjectScope::DomainSpecific(device))
                    }
                    None => (object_class::DOMAIN, ObjectScope::VmdSpecific),
                };
                let continue_after = after.as_deref();
                send(ConfirmedRequest::GetNameList { object_class, scope, continue_after })
            }
            Self::Identify => send(ConfirmedRequest::Identify),
        }
    }

    /// Reads the answer to it.
    ///
    /// # Errors
    /// What it says does not belong to the request, or cannot be read.
    pub(crate) fn answer(&self, pdu: &[u8]) -> Result<Answer, Error> {
        let service = match Mms::parse(pdu, &LIMITS)? {
            Mms::ConfirmedResponse { service, .. } => service,
            Mms::ConfirmedError { error, .. } => {
                return Ok(Answer::Refused(in_words(ServiceError::parse(&error)?)));
            }
            _ => return Err(Error::InvalidValue("it is no answer")),
        };
        let counted = |count: usize, wanted: usize| {
            let fault = Error::InvalidValue("it has not as many results as were asked for");
            if count == wanted { Ok(()) } else { Err(fault) }
        };
        match (self, service) {
            (Self::Type(_), ConfirmedResponse::GetVariableAccessAttributes { type_spec, .. }) => {
                Ok(Answer::Type(type_spec))
            }
            (Self::Read(names), ConfirmedResponse::Read { results, .. }) => {
                counted(results.len(), names.len())?;
                Ok(Answer::Values(results.iter().map(value_of).collect::<Result<_, _>>()?))
            }
            (
                Self::Members(_),
                ConfirmedResponse::GetNamedVariableListAttributes { variables, .. },
            ) => Ok(Answer::Members(variables.iter().map(member).collect())),
            (Self::Write(writes), ConfirmedResponse::Write(results)) => {
                counted(results.len(), writes.len())?;
                let written = |result: &WriteResult| match result {
                    WriteResult::Success => Ok(()),
                    WriteResult::Failure(code) => Err(AccessError(*code)),
                };
                Ok(Answer::Written(results.iter().map(written).collect()))
            }
            (
                Self::Names { .. },
                ConfirmedResponse::GetNameList { identifiers, more_follows: more_follow },
            ) => {
                let names = identifiers.into_iter().map(str::to_owned).collect();
                Ok(Answer::Names { names, more_follow })
            }
            (Self::Identify, _) => Ok(Answer::Identified),
            _ => Err(Error::InvalidValue("it answers another service")),
        }
    }
}

fn list_of<'a>(names: impl Iterator<Item = &'a Name>) -> VariableAccess<'a> {
    let specification = |name: &'a Name| VariableSpecification::Name(name.as_mms());
    VariableAccess::ListOfVariable(names.map(specification).collect())
}

/// # Errors
/// The value is deeper or larger than [`LIMITS`], or malformed.
pub(crate) fn value_of(result: &AccessResult<'_>) -> Result<Result<Value, AccessError>, Error> {
    match result {
        AccessResult::Failure(code) => Ok(Err(AccessError(*code))),
        AccessResult::Success(data) => to_owned(*data, 0).map(Ok),
    }
}

/// Copies data. A text whose bytes are no characters of its type, as Latin-1 in a VisibleString, is
/// [`Value::Other`]: it must not take the values beside it along.
fn to_owned(data: Tlv<'_>, depth: usize) -> Result<Value, Error> {
    let view = match DataView::from_tlv(data) {
        Err(_) if is_short_text(&data) => {
            let Tlv { tag, value, .. } = data;
            let bytes = value.to_vec();
            return Ok(Value::Other { tag: tag.number, constructed: false, bytes });
        }
        view => view?,
    };
    match view {
        DataView::Array(members) => Ok(Value::Array(members_of(members, depth)?)),
        DataView::Structure(members) => Ok(Value::Structure(members_of(members, depth)?)),
        leaf => leaf.to_owned(&LIMITS),
    }
}

fn members_of(members: Cursor<'_>, depth: usize) -> Result<Vec<Value>, Error> {
    if depth >= LIMITS.max_depth {
        return Err(Error::LimitExceeded { limit: "max_depth", value: depth + 1 });
    }
    let mut all = Vec::new();
    for member in members {
        if all.len() >= LIMITS.max_dataset_members {
            let value = all.len() + 1;
            return Err(Error::LimitExceeded { limit: "max_dataset_members", value });
        }
        all.push(to_owned(member?, depth + 1)?);
    }
    Ok(all)
}

fn is_short_text(data: &Tlv<'_>) -> bool {
    let is_text = matches!(data.tag.number, tag::VISIBLE_STRING | tag::MMS_STRING);
    is_text && !data.tag.constructed && data.value.len() <= LIMITS.max_primitive_len
}

fn member(variable: &VariableSpecification<'_>) -> Option<Name> {
    match variable {
        VariableSpecification::Name(ObjectName::DomainSpecific { domain, item }) => {
            Some(Name { domain: (*domain).into(), item: (*item).into() })
        }
        _ => None,
    }
}

/// `ServiceError` (ISO 9506-2): the classes that servers give for what is asked here.
fn in_words(error: ServiceError) -> String {
    let ServiceError { class, code, .. } = error;
    match (class, code) {
        (3, _) => "it lacks resources; perhaps the answer is longer than its messages".into(),
        (7, 1) => "object-access-unsupported".into(),
        (7, 2) | (2, 1) => "object-non-existent".into(),
        (7, 3) => "object-access-denied".into(),
        (7, 4) => "object-invalidated".into(),
        _ => format!("service error, class {class}, code {code}"),
    }
}

#[cfg(test)]
#[path = "service_tests.rs"]
mod tests;
