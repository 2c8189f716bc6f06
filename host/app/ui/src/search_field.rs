//! Search field above a result list, with keyboard navigation.

use egui::{EventFilter, Id, Key, Modifiers, TextEdit, Ui};

/// Characters that can be typed.
const MAX_CHARACTERS: usize = 200;

/// Keys that the field gets and that do not move the focus.
const OURS: EventFilter =
    EventFilter { tab: false, horizontal_arrows: true, vertical_arrows: true, escape: true };

/// Search field with a keyboard cursor in the result list.
#[derive(Clone, Debug, Default)]
pub(crate) struct SearchField {
    pub(crate) query: String,
    wants_focus: bool,
    /// The row that keys are at.
    pub(crate) cursor: usize,
    /// Scroll offset and visible height of the rows, points.
    offset: f32,
    height: f32,
    /// Scroll offset to apply in the next frame.
    goal: Option<f32>,
}

/// Keyboard requests of a search field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FieldKeys {
    /// True if Enter confirms the row at the cursor.
    pub(crate) enters: bool,
    /// A branch is to be opened, or closed.
    pub(crate) opens: Option<bool>,
}

impl SearchField {
    /// The next keys are for this field.
    pub(crate) fn focus(&mut self) {
        self.wants_focus = true;
    }

    /// Shows the field over `rows` rows; whether something else stands in it now, and what
    /// keys ask for.
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        id: &str,
        hint: &str,
        rows: usize,
        step: f32,
    ) -> (bool, FieldKeys) {
        let id = Id::new(id);
        if std::mem::take(&mut self.wants_focus) {
            ui.memory_mut(|memory| memory.request_focus(id));
        }
        let has_focus = ui.memory(|memory| memory.has_focus(id));
        let before = self.query.clone();
        let keys = if has_focus { self.keys(ui, id, rows, step) } else { FieldKeys::default() };
        let field = TextEdit::singleline(&mut self.query).id(id).hint_text(hint);
        ui.add(field.char_limit(MAX_CHARACTERS).desired_width(f32::INFINITY));
        if ui.memory(|memory| memory.has_focus(id)) {
            ui.memory_mut(|memory| memory.set_focus_lock_filter(id, OURS));
        }
        let has_changed = before != self.query;
        if has_changed {
            (self.cursor, self.goal) = (0, Some(0.0));
        }
        (has_changed, keys)
    }

    /// Takes the keys that move the cursor, before the field does.
    fn keys(&mut self, ui: &Ui, id: Id, rows: usize, step: f32) -> FieldKeys {
        let mut keys = FieldKeys::default();
        let page = ((self.height / step) as isize - 1).max(1);
        let mut moves = 0;
        let mut leaves = false;
        ui.input_mut(|input| {
            let mut took = |key| input.count_and_consume_key(Modifiers::NONE, key) as isize;
            moves += took(Key::ArrowDown) - took(Key::ArrowUp);
            moves += page * (took(Key::PageDown) - took(Key::PageUp));
            keys.enters = took(Key::Enter) > 0;
            if self.query.is_empty() {
                let (closes, opens) = (took(Key::ArrowLeft) > 0, took(Key::ArrowRight) > 0);
                keys.opens = (closes || opens).then_some(opens);
            }
            if took(Key::Escape) > 0 {
                leaves = self.query.is_empty();
                self.query.clear();
            }
        });
        if moves != 0 {
            let last = rows.saturating_sub(1);
            self.go_to(self.cursor.saturating_add_signed(moves).min(last), step);
        }
        if leaves || keys.enters {
            ui.memory_mut(|memory| memory.surrender_focus(id));
        }
        keys
    }

    /// Puts the cursor at a row, and the row into view.
    pub(crate) fn go_to(&mut self, row: usize, step: f32) {
        self.cursor = row;
        let top = row as f32 * step;
        if top < self.offset {
            self.goal = Some(top);
        } else if top + step > self.offset + self.height {
            self.goal = Some((top + step - self.height).max(0.0));
        }
    }

    /// An area for rows, scrolled to where the cursor is.
    pub(crate) fn area(&mut self, id: &str) -> egui::ScrollArea {
        let area = egui::ScrollArea::vertical().id_salt(id).auto_shrink(false);
        match self.goal.take() {
            Some(goal) => area.vertical_scroll_offset(goal),
            None => area,
        }
    }

    /// Notes where the rows are now.
    pub(crate) fn note(&mut self, offset: f32, height: f32) {
        (self.offset, self.height) = (offset, height);
    }
}
