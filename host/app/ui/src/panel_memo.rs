//! Memo of the last pass over the panels: with equal inputs a pass has an equal result, and is left
//! out.

use std::cell::RefCell;

use egui::{RawInput, Rect, ViewportInfo};

use crate::{
    AlarmRow, AlarmRows, EquipmentRow, EquipmentRows, ListModels, SceneOverlay, TagRow, TagRows,
    ViewModel,
};

/// Inputs of a pass.
pub(crate) struct PanelMemo {
    window: WindowInput,
    model: ViewModel,
    overlay: SceneOverlay<'static>,
    rows: RequestedRows,
}

/// Input of the window, without events and time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WindowInput {
    screen: Option<Rect>,
    viewport: Option<ViewportInfo>,
    is_focused: bool,
    theme: Option<egui::Theme>,
    has_files: bool,
}

impl WindowInput {
    pub(crate) fn from_input(input: &RawInput) -> Self {
        Self {
            screen: input.screen_rect,
            viewport: input.viewports.get(&input.viewport_id).cloned(),
            is_focused: input.focused,
            theme: input.system_theme,
            has_files: !input.hovered_files.is_empty() || !input.dropped_files.is_empty(),
        }
    }
}

/// Rows by their index in a list.
type IndexedRows<T> = Vec<(usize, T)>;

/// Rows that a pass requested, and the lengths of their lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RequestedRows {
    tags: (IndexedRows<TagRow>, [usize; 2], bool),
    alarms: (IndexedRows<AlarmRow>, usize),
    equipment: (IndexedRows<EquipmentRow>, [usize; 2], bool, Option<usize>),
}

impl RequestedRows {
    /// Requests the same rows of other lists.
    fn of_lists(&self, lists: &ListModels<'_>) -> Self {
        let ListModels { tags, alarms, equipment } = lists;
        fn again<T>(known: &[(usize, T)], len: usize, row: impl Fn(usize) -> T) -> IndexedRows<T> {
            let there = known.iter().filter(|(index, _)| *index < len);
            there.map(|(index, _)| (*index, row(*index))).collect()
        }
        Self {
            tags: (
                again(&self.tags.0, tags.len(), |index| tags.row(index)),
                [tags.len(), tags.total()],
                tags.is_truncated(),
            ),
            alarms: (again(&self.alarms.0, alarms.len(), |index| alarms.row(index)), alarms.len()),
            equipment: (
                again(&self.equipment.0, equipment.len(), |index| equipment.row(index)),
                [equipment.len(), equipment.total()],
                equipment.is_truncated(),
                equipment.selected(),
            ),
        }
    }
}

impl PanelMemo {
    /// Notes the inputs of a pass.
    pub(crate) fn new(
        window: WindowInput,
        model: ViewModel,
        overlay: SceneOverlay<'_>,
        requested: RequestedRows,
        lists: &ListModels<'_>,
    ) -> Self {
        // Lengths of lists count, requested or not.
        let rows = requested.of_lists(lists);
        Self { window, model, overlay: overlay.into_owned(), rows }
    }

    /// Reports whether a pass with these inputs, without events, would see the same but for what is
    /// over the scene.
    pub(crate) fn agrees(
        &self,
        input: &RawInput,
        model: &ViewModel,
        lists: &ListModels<'_>,
    ) -> bool {
        input.events.is_empty()
            && self.window == WindowInput::from_input(input)
            && self.model == *model
            && self.rows == self.rows.of_lists(lists)
    }

    /// Reports whether the content over the scene is the same.
    pub(crate) fn agrees_over_scene(&self, overlay: &SceneOverlay<'_>) -> bool {
        self.overlay == *overlay
    }
}

/// Lists that note which rows a pass requests.
pub(crate) struct RowRecorder<'a> {
    lists: &'a ListModels<'a>,
    requested: RefCell<RequestedRows>,
}

impl<'a> RowRecorder<'a> {
    pub(crate) fn new(lists: &'a ListModels<'a>) -> Self {
        Self { lists, requested: RefCell::default() }
    }

    /// Returns the lists, which note their requests here.
    pub(crate) fn lists(&self) -> ListModels<'_> {
        ListModels { tags: self, alarms: self, equipment: self }
    }

    /// Returns the rows that were requested.
    pub(crate) fn into_requested(self) -> RequestedRows {
        self.requested.into_inner()
    }
}

impl TagRows for RowRecorder<'_> {
    fn len(&self) -> usize {
        self.lists.tags.len()
    }

    fn total(&self) -> usize {
        self.lists.tags.total()
    }

    fn is_truncated(&self) -> bool {
        self.lists.tags.is_truncated()
    }

    fn row(&self, index: usize) -> TagRow {
        let row = self.lists.tags.row(index);
        self.requested.borrow_mut().tags.0.push((index, row.clone()));
        row
    }
}

impl AlarmRows for RowRecorder<'_> {
    fn len(&self) -> usize {
        self.lists.alarms.len()
    }

    fn row(&self, index: usize) -> AlarmRow {
        let row = self.lists.alarms.row(index);
        self.requested.borrow_mut().alarms.0.push((index, row.clone()));
        row
    }

    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)> {
        // Asked for at a key alone, which is an event.
        self.lists.alarms.next_unacknowledged()
    }
}

impl EquipmentRows for RowRecorder<'_> {
    fn len(&self) -> usize {
        self.lists.equipment.len()
    }

    fn total(&self) -> usize {
        self.lists.equipment.total()
    }

    fn is_truncated(&self) -> bool {
        self.lists.equipment.is_truncated()
    }

    fn selected(&self) -> Option<usize> {
        self.lists.equipment.selected()
    }

    fn row(&self, index: usize) -> EquipmentRow {
        let row = self.lists.equipment.row(index);
        self.requested.borrow_mut().equipment.0.push((index, row.clone()));
        row
    }
}
