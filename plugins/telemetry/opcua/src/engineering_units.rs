//! Units of variables: the property EngineeringUnits (OPC 10000-8, 5.3.2.1 and 5.6.3), read
//! before the values of tags that have a unit to compare it with.

use std::cell::RefCell;

use async_opcua::types::{
    BrowsePath, DataValue, EUInformation, NodeId, QualifiedName, ReferenceTypeId, RelativePath,
    RelativePathElement, StatusCode, TranslateBrowsePathsToNodeIdsRequest, Variant,
};
use busbar_plugin_sdk::LogLevel;
use source_units::UnreadableUnit;

use crate::client::{Client, answer};
use crate::fault::Fault;
use crate::point_states::PointStates;
use crate::session::{self, Server};

/// Paths of one request, where the server allows that.
const MAX_BATCH: usize = 500;
/// Browse name of the property, in the standard's namespace.
const PROPERTY: &str = "EngineeringUnits";
/// Namespace of unit ids that are codes of UNECE Recommendation 20 (OPC 10000-8, 5.6.3.3).
const UNECE_NAMESPACE: &str = "http://www.opcfoundation.org/UA/units/un/cefact";

/// Codes of UNECE Recommendation 20, and the symbol of the unit.
const UNECE_CODES: &[(&str, &str)] = &[
    ("P1", "%"),
    ("NX", "‰"),
    ("CEL", "°C"),
    ("FAH", "°F"),
    ("KEL", "K"),
    ("AMP", "A"),
    ("4K", "mA"),
    ("B84", "µA"),
    ("B22", "kA"),
    ("VLT", "V"),
    ("2G", "V"),
    ("2H", "V"),
    ("2Z", "mV"),
    ("KVT", "kV"),
    ("B78", "MV"),
    ("WTT", "W"),
    ("KWT", "kW"),
    ("MAW", "MW"),
    ("A90", "GW"),
    ("D44", "var"),
    ("KVR", "kvar"),
    ("MAR", "Mvar"),
    ("D46", "VA"),
    ("KVA", "kVA"),
    ("MVA", "MVA"),
    ("WHR", "Wh"),
    ("KWH", "kWh"),
    ("MWH", "MWh"),
    ("GWH", "GWh"),
    ("K3", "kvarh"),
    ("MAH", "Mvarh"),
    ("HTZ", "Hz"),
    ("KHZ", "kHz"),
    ("MHZ", "MHz"),
    ("PAL", "Pa"),
    ("A97", "hPa"),
    ("KPA", "kPa"),
    ("MPA", "MPa"),
    ("MBR", "mbar"),
    ("BAR", "bar"),
    ("PS", "psi"),
    ("80", "psi(abs)"),
    ("64", "psi(g)"),
    ("E42", "kgf/cm²"),
    ("ATT", "at"),
    ("ATM", "atm"),
    ("59", "ppm"),
    ("61", "ppb"),
    ("C26", "ms"),
    ("SEC", "s"),
    ("MIN", "min"),
    ("HUR", "h"),
    ("MMT", "mm"),
    ("CMT", "cm"),
    ("MTR", "m"),
    ("KMT", "km"),
    ("MTS", "m/s"),
    ("L2", "l/min"),
    ("MQH", "m³/h"),
    ("LTR", "l"),
    ("KGM", "kg"),
    ("TNE", "t"),
    ("A93", "g/m³"),
    ("KMQ", "kg/m³"),
    ("RPM", "1/min"),
    ("DD", "°"),
    ("OHM", "Ω"),
    ("E45", "mΩ"),
    ("B49", "kΩ"),
    ("B75", "MΩ"),
    ("2N", "dB"),
    ("DBM", "dBm"),
    ("C71", "pC"),
    ("C40", "nC"),
];

/// Unit of a variable, as its server states it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct StatedUnit {
    /// Symbol that the server shows.
    pub(crate) name: String,
    /// Symbol of the unit id, where that is a known code of UNECE.
    pub(crate) by_id: Option<&'static str>,
}

impl StatedUnit {
    /// Reads the value of the property; none where it states no unit.
    fn from_value(value: &DataValue) -> Option<Result<Self, UnreadableUnit>> {
        if value.status.is_some_and(|status| status.is_bad()) {
            return None;
        }
        let text = |text: String| Some(Ok(Self { name: text, by_id: None }));
        match value.value.as_ref()? {
            Variant::Empty => None,
            Variant::ExtensionObject(object) if object.is_null() => None,
            Variant::ExtensionObject(object) => {
                let Some(unit) = object.inner_as::<EUInformation>() else {
                    return Some(Err(UnreadableUnit));
                };
                let is_unece = unit.namespace_uri.as_ref() == UNECE_NAMESPACE;
                let by_id = symbol_of_id(unit.unit_id).filter(|_| is_unece);
                let mut name = unit.display_name.text.as_ref().trim().to_owned();
                // A code that is not in the table states a unit as well: one that is not known.
                if name.is_empty() && by_id.is_none() && is_unece && unit.unit_id > 0 {
                    name = format!("id {}", unit.unit_id);
                }
                (!name.is_empty() || by_id.is_some()).then_some(Ok(Self { name, by_id }))
            }
            // Servers that were not made by the standard have a text.
            Variant::LocalizedText(name) => text(name.text.to_string()),
            Variant::String(name) => text(name.to_string()),
            _ => Some(Err(UnreadableUnit)),
        }
    }

    /// Returns all names of the unit, to compare with that of a tag.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.name.as_str()).chain(self.by_id)
    }

    /// Describes the unit for a message.
    pub(crate) fn in_words(&self) -> String {
        match self.by_id {
            Some(by_id) if self.name.is_empty() => by_id.to_owned(),
            Some(by_id) if by_id != self.name => format!("{} (by its id {by_id})", self.name),
            _ => self.name.clone(),
        }
    }
}

/// Finds the symbol of a unit id: the characters of its code, the first in the highest byte.
fn symbol_of_id(id: i32) -> Option<&'static str> {
    let bytes = id.to_be_bytes();
    let first = bytes.iter().position(|byte| *byte != 0)?;
    let code = std::str::from_utf8(&bytes[first..]).ok()?;
    UNECE_CODES.iter().find(|(known, _)| *known == code).map(|(_, symbol)| *symbol)
}

/// Reads the units of those of these items whose tags have one to compare with. A server that does
/// not tell them leaves values as they are, which is told.
///
/// # Errors
/// The connection ended.
pub(crate) async fn read(
    client: &Client,
    server: &Server,
    point_states: &RefCell<PointStates>,
    items: &[usize],
    nodes_per_read: usize,
) -> Result<(), Fault> {
    let wanted: Vec<(usize, NodeId)> = {
        let point_states = point_states.borrow();
        let points = point_states.points();
        let node = |item: &usize| {
            let found = &points.items[*item];
            let has_unit = found.points.iter().any(|point| points.all[*point].unit.is_known());
            let address = Some(&found.node).filter(|node| has_unit && server.moved(node).is_none());
            Some((*item, address?.resolve(&server.namespaces)?))
        };
        items.iter().filter_map(node).collect()
    };
    if wanted.is_empty() {
        return Ok(());
    }
    match read_all(client, &wanted, nodes_per_read).await {
        Ok(units) => {
            let mut point_states = point_states.borrow_mut();
            units.iter().for_each(|(item, unit)| point_states.note_unit(*item, unit.as_ref()));
            Ok(())
        }
        Err(fault @ Fault::Refused { .. }) => {
            let text = format!("units of the server are not known and not compared: {fault}");
            point_states.borrow_mut().name(LogLevel::Warning, &text);
            Ok(())
        }
        Err(fault) => Err(fault),
    }
}

/// Item, and the unit that its server states.
type ItemUnit = (usize, Result<StatedUnit, UnreadableUnit>);

async fn read_all(
    client: &Client,
    wanted: &[(usize, NodeId)],
    nodes_per_read: usize,
) -> Result<Vec<ItemUnit>, Fault> {
    let (mut found, mut batch, mut rest) = (Vec::new(), MAX_BATCH, wanted);
    while !rest.is_empty() {
        let some = &rest[..rest.len().min(batch)];
        match find_properties(client, some).await {
            Err(fault) if batch > 1 && fault.is_too_much() => batch /= 2,
            properties => {
                found.extend(properties?);
                rest = &rest[some.len()..];
            }
        }
    }
    let nodes: Vec<NodeId> = found.iter().map(|(_, node)| node.clone()).collect();
    let values = session::read_values(client, &nodes, nodes_per_read).await?;
    let units = found.iter().zip(&values);
    Ok(units
        .filter_map(|((item, _), value)| Some((*item, StatedUnit::from_value(value)?)))
        .collect())
}

/// Finds the property of each item; those without one are left out.
async fn find_properties(
    client: &Client,
    items: &[(usize, NodeId)],
) -> Result<Vec<(usize, NodeId)>, Fault> {
    let path = |(_, node): &(usize, NodeId)| BrowsePath {
        starting_node: node.clone(),
        relative_path: RelativePath {
            elements: Some(vec![RelativePathElement {
                reference_type_id: ReferenceTypeId::HasProperty.into(),
                is_inverse: false,
                include_subtypes: true,
                target_name: QualifiedName::new(0, PROPERTY),
            }]),
        },
    };
    let request = TranslateBrowsePathsToNodeIdsRequest {
        request_header: client.header(client.limit()),
        browse_paths: Some(items.iter().map(path).collect()),
    };
    let answer = answer!(client, "looking for units", TranslateBrowsePathsToNodeIds, request)?;
    let results = answer.results.unwrap_or_default();
    if results.len() != items.len() {
        return Err(Fault::Server("another number of results than of units that were looked for"));
    }
    let found = items.iter().zip(results).filter_map(|((item, _), result)| {
        let is_found = result.status_code == StatusCode::Good;
        let targets = result.targets.filter(|_| is_found).unwrap_or_default();
        // A target on another server has no value here.
        let mut here = targets.into_iter().map(|target| target.target_id);
        let node = here.find(|id| id.server_index == 0 && id.namespace_uri.is_empty())?;
        Some((*item, node.node_id))
    });
    Ok(found.collect())
}

#[cfg(test)]
#[path = "engineering_units_tests.rs"]
mod tests;
