//! Equipment by number: how a site refers to what a view places in its scene.

/// Number of a piece of equipment in an [`EquipmentDirectory`]. It holds until the next reload.
///
/// Overlay pictures use the same numbers for the nodes of lines and tints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EquipmentNumber(pub u32);

/// Directory of all equipment that reports may name.
pub trait EquipmentDirectory {
    /// Returns the number of the equipment with an id or an alias.
    fn find(&self, id: &str) -> Option<EquipmentNumber>;

    /// Returns the ids of the equipment and of all that is above it, the outermost first; empty for
    /// a number that is not there.
    fn path(&self, equipment: EquipmentNumber) -> Vec<String>;
}
