//! The columns of a point list, by the names that lists give them.

/// What a column holds.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Column {
    Tag,
    Description,
    Type,
    Unit,
    Low,
    High,
    LimitLow,
    LimitHigh,
    Freshness,
    Factor,
    Offset,
    Node,
    Role,
    Plugin,
    /// The whole address, as JSON or text.
    Address,
    /// One field of the address.
    AddressField(String),
}

/// Names of columns, without case, `_`, `-` and spaces.
const NAMES: &[(Column, &[&str])] = &[
    (Column::Tag, &["tag", "id", "name", "point", "tagname", "pointname"]),
    (Column::Description, &["description", "desc", "text", "comment"]),
    (Column::Type, &["type", "datatype", "kind"]),
    (Column::Unit, &["unit", "units", "eu"]),
    (Column::Low, &["low", "min", "rangelow"]),
    (Column::High, &["high", "max", "rangehigh"]),
    (Column::LimitLow, &["limitlow", "lowlimit"]),
    (Column::LimitHigh, &["limithigh", "highlimit"]),
    (Column::Freshness, &["freshnessms", "freshnessmillis", "freshness"]),
    (Column::Factor, &["scale", "factor", "gain"]),
    (Column::Offset, &["offset"]),
    (Column::Node, &["node", "equipment"]),
    (Column::Role, &["role"]),
    (Column::Plugin, &["plugin", "instance", "source"]),
    (Column::Address, &["address"]),
];
const ADDRESS_PREFIX: &str = "address.";

impl Column {
    /// The column that a header names; none for one that is not known.
    pub(crate) fn named(header: &str) -> Option<Self> {
        let header = header.trim();
        if header.len() > ADDRESS_PREFIX.len()
            && header.is_char_boundary(ADDRESS_PREFIX.len())
            && header[..ADDRESS_PREFIX.len()].eq_ignore_ascii_case(ADDRESS_PREFIX)
        {
            return Some(Self::AddressField(header[ADDRESS_PREFIX.len()..].trim().to_owned()));
        }
        let plain: String = header.chars().filter(|c| !" _-".contains(*c)).collect();
        let plain = plain.to_lowercase();
        let known = NAMES.iter().find(|(_, names)| names.contains(&plain.as_str()));
        known.map(|(column, _)| column.clone())
    }
}
