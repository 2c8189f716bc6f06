//! Suitability of one variable as a tag, by its attributes, properties and value.

use std::collections::BTreeMap;

use async_opcua::types::{EUInformation, Range, StatusCode, Variant};

use super::data_type::{DataType, Names, Nature, names_of, of_value};
use super::states::{listed, positions};
use crate::fault::in_words;

/// Elements of an array that are listed.
const MAX_ELEMENTS: usize = 256;
/// The bit of AccessLevel that says that values can be read (OPC 10000-3, 8.57).
const CURRENT_READ: u8 = 1;
/// Rank of a scalar, and of an array of one dimension (OPC 10000-3, 5.6.2).
const SCALAR: i32 = -1;
const ONE_DIMENSION: i32 = 1;

/// Attributes that are read of each variable.
#[derive(Debug)]
pub(super) struct Attributes {
    pub(super) data_type: Result<Variant, StatusCode>,
    pub(super) rank: Result<Variant, StatusCode>,
    pub(super) dimensions: Result<Variant, StatusCode>,
    pub(super) access: Result<Variant, StatusCode>,
    pub(super) user_access: Result<Variant, StatusCode>,
    pub(super) description: Result<Variant, StatusCode>,
}

/// Kind, states and names of what a variable's values are.
#[derive(Debug, PartialEq)]
pub(super) struct Meaning {
    pub(super) kind: &'static str,
    pub(super) states: BTreeMap<String, String>,
    /// Names of the states, where the kind does not tell them.
    pub(super) names: String,
}

/// Number of an array's elements; none for a scalar.
pub(super) type Shape = Option<usize>;

impl Attributes {
    /// Returns the reason for which the user may not read values.
    pub(super) fn refusal(&self) -> Option<String> {
        let mut levels = [&self.user_access, &self.access].into_iter();
        let level = levels.find_map(|level| match level {
            Ok(Variant::Byte(level)) => Some(*level),
            _ => None,
        });
        let is_closed = level.is_some_and(|level| level & CURRENT_READ == 0);
        is_closed.then(|| "its AccessLevel does not allow this user to read it".to_owned())
    }

    /// Returns the shape, where the attributes tell it; otherwise the value does.
    ///
    /// # Errors
    /// The reason for which the variable can be no tag.
    pub(super) fn shape(&self) -> Result<Option<Shape>, String> {
        let rank = match &self.rank {
            Ok(Variant::Int32(rank)) => *rank,
            Ok(_) => return Ok(None),
            Err(status) => return Err(format!("its ValueRank: {}", in_words(*status))),
        };
        match (rank, &self.dimensions) {
            (SCALAR, _) => Ok(Some(None)),
            (ONE_DIMENSION, Ok(Variant::Array(array))) => Ok(match array.values.as_slice() {
                [Variant::UInt32(count)] if *count > 0 => Some(Some(*count as usize)),
                _ => None,
            }),
            (2.., _) => Err("a matrix: only elements of one-dimensional arrays can be tags".into()),
            _ => Ok(None),
        }
    }

    /// Returns the text of the description, where it is not blank.
    pub(super) fn description(&self) -> Option<String> {
        match &self.description {
            Ok(Variant::LocalizedText(text)) => {
                Some(text.text.to_string()).filter(|text| !text.trim().is_empty())
            }
            _ => None,
        }
    }
}

/// Nature and shape of a variable, of its value where its attributes do not tell.
///
/// # Errors
/// The reason for which the variable can be no tag.
pub(super) fn settle(
    nature: Nature,
    shape: Option<Shape>,
    value: Option<&Result<Variant, StatusCode>>,
) -> Result<(Nature, Shape), String> {
    let (nature, shape) = match (nature, shape, value) {
        (Nature::Unfit(why), ..) => return Err(why.to_owned()),
        (nature, Some(shape), _) if nature != Nature::Any => (nature, shape),
        (_, _, None) => return Err("its value was not read".into()),
        (_, _, Some(Err(status))) => return Err(format!("its value: {}", in_words(*status))),
        (nature, shape, Some(Ok(value))) => {
            let (of_value, found) = of_value(value)?;
            let nature = if nature == Nature::Any { of_value } else { nature };
            (nature, shape.unwrap_or(found))
        }
    };
    match (nature, shape) {
        (Nature::Unfit(why), _) => Err(why.to_owned()),
        (_, Some(0)) => Err("an array that has no elements now".into()),
        (_, Some(count)) if count > MAX_ELEMENTS => Err(format!(
            "an array of {count}; at most {MAX_ELEMENTS} elements are listed: add tags with \
             `index` by hand"
        )),
        settled => Ok(settled),
    }
}

/// Returns the kind of tag for values of this nature, and its states.
pub(super) fn meaning(nature: Nature, data_type: &DataType, properties: &Properties) -> Meaning {
    let plain = |kind| Meaning { kind, states: BTreeMap::new(), names: String::new() };
    let with = |states| Meaning { kind: "double_point", states, names: String::new() };
    match nature {
        Nature::Number => plain("f64"),
        Nature::Text => plain("text"),
        Nature::Boolean => {
            let names = properties.two_states();
            positions(&names)
                .map_or_else(|| Meaning { names: listed(&names), ..plain("bool") }, with)
        }
        Nature::Integer | Nature::Any | Nature::Unfit(_) => {
            let own = properties.names();
            let names = if own.is_empty() { &data_type.names } else { &own };
            positions(names).map_or_else(|| Meaning { names: listed(names), ..plain("i64") }, with)
        }
    }
}

/// The values of a variable's properties, by name.
#[derive(Debug, Default)]
pub(super) struct Properties(pub(super) BTreeMap<String, Variant>);

impl Properties {
    /// Browse names of the properties that are read (OPC 10000-8, 5.3; OPC 10000-3, 5.8.3).
    pub(super) const NAMES: [&'static str; 6] =
        ["EngineeringUnits", "EURange", "EnumStrings", "EnumValues", "TrueState", "FalseState"];

    /// Returns the symbol of the unit.
    pub(super) fn unit(&self) -> Option<String> {
        let Variant::ExtensionObject(object) = self.0.get("EngineeringUnits")? else { return None };
        Some(object.inner_as::<EUInformation>()?.display_name.text.to_string())
    }

    /// Returns the normal range of the value: low and high.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        let Variant::ExtensionObject(object) = self.0.get("EURange")? else { return None };
        let Range { low, high } = object.inner_as::<Range>()?;
        (low.is_finite() && high.is_finite() && low < high).then_some([*low, *high])
    }

    fn names(&self) -> Names {
        let values = self.0.get("EnumValues").or_else(|| self.0.get("EnumStrings"));
        values.map(names_of).unwrap_or_default()
    }

    fn two_states(&self) -> Vec<(bool, String)> {
        let named = [(false, "FalseState"), (true, "TrueState")];
        let name = |(state, property)| match self.0.get(property)? {
            Variant::LocalizedText(text) if !text.text.is_empty() => {
                Some((state, text.text.to_string()))
            }
            _ => None,
        };
        named.into_iter().filter_map(name).collect()
    }
}
