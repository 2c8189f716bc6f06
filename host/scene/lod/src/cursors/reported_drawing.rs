//! Last reported drawing: what is drawn at present, and what has changed since the report.

/// Last reported drawing, and the changes since.
pub(super) struct ReportedDrawing {
    /// True if groups were merged or split.
    pub(super) has_regrouped: bool,
    /// Cursors that moved or bent, with repetitions, drawn or not.
    pub(super) changed: Vec<usize>,
    /// Cursors that are drawn, by index.
    pub(super) drawn: Vec<usize>,
    /// State of each cursor: [`WAS_DRAWN`] and, during the search, [`IS_DRAWN`].
    pub(super) states: Vec<u8>,
}

/// Bit of an item in the last report.
pub(super) const WAS_DRAWN: u8 = 1;
/// Bit of an item that the search has found.
pub(super) const IS_DRAWN: u8 = 2;

impl ReportedDrawing {
    /// Creates the state before the first report.
    pub(super) fn nothing() -> Self {
        Self { has_regrouped: true, changed: Vec::new(), drawn: Vec::new(), states: Vec::new() }
    }
}
