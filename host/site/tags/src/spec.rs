//! Definitions of tags, and sets of them.

use std::ops::RangeInclusive;
use std::time::Duration;

use busbar_types::ValueKind;

use crate::TagHandle;
use crate::derived::Derivations;

/// Definition of a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct TagSpec {
    /// Unique id of the tag.
    pub id: String,
    /// Name shown to people.
    pub name: String,
    /// Type of its values; a sample of another type is bad.
    pub kind: ValueKind,
    /// Unit, such as `kV`; empty for none.
    pub unit: String,
    /// Plausible measuring range: a value outside it is uncertain.
    pub range: Option<RangeInclusive<f64>>,
    /// Age above which a value is stale.
    pub freshness: Duration,
    /// Conversion from the source's number to the tag's unit; for [`ValueKind::F64`] alone.
    pub scale: Option<Scale>,
    /// A number nearer than this to the one before does not change it, in the tag's
    /// unit; 0 for none.
    pub dead_band: f64,
    /// Worked out of other tags: an [`Expression`](crate::Expression) of their ids.
    pub expression: Option<String>,
}

/// Definitions and derivations of all tags of a scene. A tag's handle is its index.
#[derive(Debug, Default)]
pub struct TagSet {
    specs: Vec<TagSpec>,
    derived: Derivations,
}

/// A straight line: `number * factor + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Factor by which a number is multiplied.
    pub factor: f64,
    /// Offset added after the multiplication.
    pub offset: f64,
}

/// A tag that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("tag '{id}': {cause}")]
pub struct TagSpecError {
    /// Id of the tag.
    pub id: String,
    /// Cause of the error.
    pub cause: String,
    /// Remedy for the user.
    pub remedy: String,
}

impl TagSet {
    /// Builds a set of tags with their derivations.
    ///
    /// # Errors
    /// The tags whose expressions cannot be read, name tags that are not there, or go
    /// in a circle.
    pub fn new(specs: Vec<TagSpec>) -> Result<Self, Vec<TagSpecError>> {
        let derived = Derivations::from_specs(&specs)?;
        Ok(Self { specs, derived })
    }

    /// Returns the definitions of all tags, by handle.
    pub fn specs(&self) -> &[TagSpec] {
        &self.specs
    }

    /// Returns the definition of a tag.
    pub fn spec(&self, tag: TagHandle) -> Option<&TagSpec> {
        self.specs.get(tag.0 as usize)
    }

    pub(crate) fn derived(&self) -> &Derivations {
        &self.derived
    }
}

impl Scale {
    /// The number in the tag's unit.
    pub fn apply(self, number: f64) -> f64 {
        number * self.factor + self.offset
    }
}
