//! Faults of a configured network, each with its place and remedy.

/// Faults of a network.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TopologyError {
    /// A name that nothing has.
    #[error("{place} names the {what} '{name}', which is not there: add it or mend the name")]
    Unknown {
        /// Place in the settings.
        place: String,
        /// Kind of thing that is missing.
        what: &'static str,
        /// Name that nothing has.
        name: String,
    },
    /// A name that two things have.
    #[error("the {what} '{name}' is there twice: rename one")]
    Twice {
        /// Kind of thing that is doubled.
        what: &'static str,
        /// Name that two have.
        name: String,
    },
    /// Both ends are the same node.
    #[error("the branch '{0}' joins a node to itself: name the node at its other end")]
    Loop(String),
    /// A kind that is a switch, and a setting that says otherwise.
    #[error("the branch '{0}' is a switch by its 'kind', and none by 'switch': mend one of them")]
    Kind(String),
    /// Settings of a placement that do not go together.
    #[error("the placement at '{equipment}' {fault}")]
    Placement {
        /// The equipment that it names.
        equipment: String,
        /// The fault, and the remedy.
        fault: String,
    },
    /// A number out of its range.
    #[error("{place} has '{setting}' of {value}: give {range}")]
    Range {
        /// Place in the settings.
        place: String,
        /// Setting that is out of range.
        setting: &'static str,
        /// The number, as given.
        value: String,
        /// Range that is taken.
        range: &'static str,
    },
    /// More than a network may have.
    #[error("{asked} {what}; at most {limit} are taken: split the network")]
    TooMany {
        /// Kind of thing that is counted.
        what: &'static str,
        /// Number that is configured.
        asked: usize,
        /// Limit that is exceeded.
        limit: usize,
    },
    /// Nothing can be energised.
    #[error("no source feeds the network: name one under 'sources'")]
    NoSource,
}
