//! The scene's equipment, as panels show it.

/// Rows of the equipment tree or of search results; only visible rows are requested.
pub trait EquipmentRows {
    /// Returns the number of rows.
    fn len(&self) -> usize;

    /// Reports whether there are no rows.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pieces of equipment in all.
    fn total(&self) -> usize;

    /// Reports whether the search found more than the rows listed.
    fn is_truncated(&self) -> bool;

    /// Returns the row of the selected equipment.
    fn selected(&self) -> Option<usize>;

    /// Returns one row of the list.
    fn row(&self, index: usize) -> EquipmentRow;
}

/// A piece of equipment in its tree.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EquipmentRow {
    /// Entry number that commands refer to.
    pub entry: u32,
    /// Depth in the tree, 0 at the top.
    pub depth: u16,
    /// True while the branch is open; none for a leaf.
    pub is_open: Option<bool>,
    /// True for the selected equipment.
    pub is_selected: bool,
    /// The last part of its id.
    pub label: String,
    /// Equipment id of the row.
    pub id: String,
    /// Descriptive name; may be empty.
    pub name: String,
    /// Other ids of it.
    pub aliases: Vec<String>,
    /// Id of the parent equipment, given in search results only.
    pub within: Option<String>,
}
