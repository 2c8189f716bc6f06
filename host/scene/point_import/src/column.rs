//! The columns of a point list, by the names that lists give them.

/// Meaning of a column.
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
    FreshnessSeconds,
    /// Former unit of the age at which a value is stale.
    FreshnessMillis,
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

/// Names of columns, without case, marks and blanks.
const NAMES: &[(Column, &[&str])] = &[
    (Column::Tag, &["tag", "id", "name", "point", "tagname", "pointname"]),
    (Column::Description, &["description", "desc", "text", "comment"]),
    (Column::Type, &["type", "datatype", "kind"]),
    (Column::Unit, &["unit", "units", "eu"]),
    (Column::Low, &["low", "min", "rangelow"]),
    (Column::High, &["high", "max", "rangehigh"]),
    (Column::LimitLow, &["limitlow", "lowlimit"]),
    (Column::LimitHigh, &["limithigh", "highlimit"]),
    (Column::FreshnessSeconds, &["freshnessseconds", "freshnesss"]),
    (Column::FreshnessMillis, &["freshnessms", "freshnessmillis", "freshness"]),
    (Column::Factor, &["scale", "factor", "gain"]),
    (Column::Offset, &["offset"]),
    (Column::Node, &["node", "equipment"]),
    (Column::Role, &["role"]),
    (Column::Plugin, &["plugin", "instance", "source"]),
    (Column::Address, &["address"]),
];
/// Names that count where no column has one of [`NAMES`].
const OTHER_NAMES: &[(Column, &[&str])] = &[
    (Column::Tag, &["tagid", "pointid", "signal", "signalname"]),
    (Column::Type, &["valuetype", "typeid", "asdutype"]),
    (Column::Unit, &["egu", "uom", "engunit", "engunits", "engineeringunit", "engineeringunits"]),
    (Column::Low, &["rangemin", "englow", "minimum"]),
    (Column::High, &["rangemax", "enghigh", "maximum"]),
];
const ADDRESS_PREFIX: &str = "address.";

impl Column {
    /// The column that a header names, and whether by its usual name; none for one that is not
    /// known. An explanation in brackets makes a name less usual.
    pub(crate) fn named(header: &str) -> Option<(Self, bool)> {
        let header = header.trim();
        if header.len() > ADDRESS_PREFIX.len()
            && header.is_char_boundary(ADDRESS_PREFIX.len())
            && header[..ADDRESS_PREFIX.len()].eq_ignore_ascii_case(ADDRESS_PREFIX)
        {
            let field = header[ADDRESS_PREFIX.len()..].trim().to_owned();
            return Some((Self::AddressField(field), true));
        }
        let bare = header.split(['(', '[']).next().unwrap_or_default();
        let (whole, bare) = (plain(header), plain(bare));
        let find = |names: &[(Self, &[&str])], name: &str| {
            let known = names.iter().find(|(_, names)| names.contains(&name));
            known.map(|(column, _)| column.clone())
        };
        let usual = find(NAMES, &whole).map(|column| (column, true));
        usual.or_else(|| {
            let other = find(OTHER_NAMES, &whole).or_else(|| find(NAMES, &bare));
            other.or_else(|| find(OTHER_NAMES, &bare)).map(|column| (column, false))
        })
    }

    /// Reports whether two headers are the same name of a column, not two synonyms.
    pub(crate) fn is_same_name(a: &str, b: &str) -> bool {
        plain(a) == plain(b)
    }

    /// Reports whether a column holds numbers.
    pub(crate) fn is_number(&self) -> bool {
        match self {
            Self::Low
            | Self::High
            | Self::LimitLow
            | Self::LimitHigh
            | Self::Factor
            | Self::Offset => true,
            Self::AddressField(field) => is_number_field(field),
            _ => false,
        }
    }
}

/// Fields of addresses that hold numbers with fractions, in every plugin that has them.
pub(crate) fn is_number_field(field: &str) -> bool {
    ["scale", "offset", "deadband", "deadband_percent"].contains(&field)
}

/// A header without case, marks and blanks.
fn plain(header: &str) -> String {
    header.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase()
}
