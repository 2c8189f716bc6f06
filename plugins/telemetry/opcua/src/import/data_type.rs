//! Data types of variables, and what kind of tag each can be (OPC 10000-3, 8; OPC 10000-6,
//! 5.1.2).

use std::collections::HashMap;

use async_opcua::types::{AttributeId, EnumValueType, NodeId, Variant, VariantScalarTypeId};

use super::attributes::{Reader, given};
use super::references::Browser;
use crate::fault::Fault;

/// Steps from a type to one that is built in.
const MAX_STEPS: usize = 16;
/// Types that are remembered; a server has hundreds.
const MAX_TYPES: usize = 10_000;
/// Names of an enumeration.
const MAX_NAMES: usize = 1000;
/// Number, Integer, UInteger and Enumeration: the standard's abstract types.
const NUMBER: u32 = 26;
const INTEGERS: [u32; 3] = [27, 28, 29];
const BASE: u32 = 24;

/// Suitability of a data type's values for tags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nature {
    Boolean,
    Integer,
    Number,
    Text,
    /// Any type: it depends on the value itself.
    Any,
    /// No suitable type, with the reason.
    Unfit(&'static str),
}

/// Names of enumeration values, by number.
pub(super) type Names = Vec<(i64, String)>;

/// Data type as tags see it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DataType {
    pub(super) nature: Nature,
    /// Names of the values, where the type is an enumeration.
    pub(super) names: Names,
}

/// Cache of a server's data types, each asked for once.
#[derive(Default)]
pub(super) struct DataTypes(HashMap<NodeId, DataType>);

impl DataTypes {
    /// Returns the data type at a node, from the cache or from the server.
    pub(super) async fn data_type_at(
        &mut self,
        node: &NodeId,
        browser: &mut Browser<'_>,
        reader: &mut Reader<'_>,
    ) -> Result<DataType, Fault> {
        if let Some(known) = self.0.get(node) {
            return Ok(known.clone());
        }
        let found = find(node, browser, reader).await?;
        if self.0.len() < MAX_TYPES {
            self.0.insert(node.clone(), found.clone());
        }
        Ok(found)
    }
}

async fn find(
    node: &NodeId,
    browser: &mut Browser<'_>,
    reader: &mut Reader<'_>,
) -> Result<DataType, Fault> {
    let mut names = Names::new();
    let mut at = node.clone();
    for _ in 0..MAX_STEPS {
        if let Some(nature) = built_in(&at) {
            return Ok(DataType { nature, names });
        }
        if names.is_empty() {
            let properties = browser.properties_of(&at).await?;
            let named = ["EnumValues", "EnumStrings"].iter().find_map(|name| properties.get(*name));
            if let Some(property) = named {
                let wanted = [(property.clone(), AttributeId::Value)];
                let value = reader.read(&wanted).await?.into_iter().next();
                names = value
                    .and_then(|value| given(value).ok())
                    .map(|v| names_of(&v))
                    .unwrap_or_default();
            }
        }
        match browser.supertype(&at).await? {
            Some(above) => at = above,
            None => break,
        }
    }
    let nature = Nature::Unfit("the server does not tell what its data type is derived from");
    Ok(DataType { nature, names })
}

/// Returns the nature of a standard type; none where it depends on the supertype.
fn built_in(node: &NodeId) -> Option<Nature> {
    if node.namespace != 0 {
        return None;
    }
    let id = node.as_u32()?;
    match id {
        BASE => Some(Nature::Any),
        NUMBER => Some(Nature::Number),
        id if INTEGERS.contains(&id) => Some(Nature::Integer),
        _ => VariantScalarTypeId::try_from(id).ok().map(nature_of),
    }
}

fn nature_of(scalar: VariantScalarTypeId) -> Nature {
    use VariantScalarTypeId as Scalar;
    match scalar {
        Scalar::Boolean => Nature::Boolean,
        Scalar::SByte
        | Scalar::Byte
        | Scalar::Int16
        | Scalar::UInt16
        | Scalar::Int32
        | Scalar::UInt32
        | Scalar::Int64
        | Scalar::UInt64
        | Scalar::StatusCode => Nature::Integer,
        Scalar::Float | Scalar::Double => Nature::Number,
        Scalar::String | Scalar::LocalizedText | Scalar::QualifiedName => Nature::Text,
        Scalar::DateTime => Nature::Unfit("a DateTime is no measured value"),
        Scalar::Guid => Nature::Unfit("a Guid is no measured value"),
        Scalar::ByteString => Nature::Unfit("a ByteString is no measured value"),
        Scalar::ExtensionObject => Nature::Unfit("a structure: its fields are no variables"),
        _ => Nature::Unfit("it is neither number nor truth value nor text"),
    }
}

/// Returns the nature of a value and, for an array, the number of its elements.
///
/// # Errors
/// The reason for which the nature is unknown.
pub(super) fn of_value(value: &Variant) -> Result<(Nature, Option<usize>), &'static str> {
    match value {
        Variant::Empty => Err("it has no value now, and its type alone does not say what it is"),
        Variant::Array(array) if array.dimensions.as_ref().is_some_and(|d| d.len() > 1) => {
            Err("a matrix: only elements of one-dimensional arrays can be tags")
        }
        Variant::Array(array) => Ok((nature_of(array.value_type), Some(array.values.len()))),
        other => match other.scalar_type_id() {
            Some(scalar) => Ok((nature_of(scalar), None)),
            None => Err("its type is not known"),
        },
    }
}

/// Names of `EnumStrings` (LocalizedText by index) or `EnumValues` (EnumValueType), OPC
/// 10000-3, 5.8.3; those without a name are left out.
pub(super) fn names_of(value: &Variant) -> Names {
    let Variant::Array(array) = value else { return Names::new() };
    let name = |(index, value): (i64, &Variant)| match value {
        Variant::LocalizedText(text) => Some((index, text.text.to_string())),
        Variant::ExtensionObject(object) => {
            let named = object.inner_as::<EnumValueType>()?;
            Some((named.value, named.display_name.text.to_string()))
        }
        _ => None,
    };
    let names = (0..).zip(array.values.iter().take(MAX_NAMES)).filter_map(name);
    names.filter(|(_, name)| !name.trim().is_empty()).collect()
}
