//! The scene's equipment, as panels show it.

/// The equipment as rows of a tree or of what a search found: only rows in view are asked
/// for.
pub trait EquipmentRows {
    /// Number of rows.
    fn len(&self) -> usize;

    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pieces of equipment in all.
    fn total(&self) -> usize;

    /// Whether more was found than there are rows.
    fn is_truncated(&self) -> bool;

    /// The row of what is selected.
    fn selected(&self) -> Option<usize>;

    /// One row.
    fn row(&self, index: usize) -> EquipmentRow;
}

/// A piece of equipment in its tree.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EquipmentRow {
    /// Its number, for commands.
    pub entry: u32,
    /// How deep it stands.
    pub depth: u16,
    /// Whether what is under it is shown; none where nothing is.
    pub is_open: Option<bool>,
    /// Whether it is what is selected.
    pub is_selected: bool,
    /// The last part of its id.
    pub label: String,
    /// Equipment id.
    pub id: String,
    /// What people call it; may be empty.
    pub name: String,
    /// Other ids of it.
    pub aliases: Vec<String>,
    /// What it is a part of, where that is not seen from its place.
    pub within: Option<String>,
}
