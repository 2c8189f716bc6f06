//! Commands that wait for the viewer.

use std::collections::VecDeque;

use busbar_protocol::message::{Command, MAX_TAGS_A_MESSAGE, PointerEvent};

use crate::desired_state::DesiredState;

/// Commands that wait at most; then callers get [`crate::OutboxFull`].
const MAX_WAITING: usize = 4096;

/// Queue of commands in their order. A later command replaces an earlier one that it overrides.
#[derive(Debug, Default)]
pub(crate) struct Outbox(VecDeque<Command>);

impl Outbox {
    /// Reports whether any command finds room.
    pub(crate) fn has_room(&self) -> bool {
        self.0.len() < MAX_WAITING
    }

    /// Appends a command to the queue, where there is room.
    pub(crate) fn push(&mut self, command: Command) {
        if let Some(last) = self.0.back_mut()
            && merges(last, &command)
        {
            match (last, command) {
                (Command::SetTags(tags), Command::SetTags(more)) => tags.extend(more),
                (last, command) => *last = command,
            }
        } else if self.has_room() {
            self.0.push_back(command);
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Command> {
        self.0.pop_front()
    }

    /// Resets the queue for a new viewer: the desired state, then actions that are not done yet.
    pub(crate) fn reset(&mut self, desired: &DesiredState) {
        let is_deed = |command: &Command| {
            matches!(command, Command::ActOnAlarm { .. } | Command::Reload(_) | Command::Pick(_))
        };
        let deeds: Vec<_> = self.0.drain(..).filter(is_deed).collect();
        self.0.extend(desired.commands().into_iter().chain(deeds));
    }
}

/// Reports whether the later of two neighbouring commands supersedes the earlier one, or can be
/// merged with it.
fn merges(last: &Command, next: &Command) -> bool {
    match (last, next) {
        (Command::Resize(_), Command::Resize(_))
        | (Command::SetVisible(_), Command::SetVisible(_))
        | (
            Command::SetCamera(_) | Command::UseCamera(_),
            Command::SetCamera(_) | Command::UseCamera(_),
        )
        | (Command::SetTheta(_), Command::SetTheta(_))
        | (Command::SetTime(_), Command::SetTime(_))
        | (Command::Pointer(PointerEvent::Moved(_)), Command::Pointer(PointerEvent::Moved(_))) => {
            true
        }
        (Command::SetTags(tags), Command::SetTags(more)) => {
            tags.len() + more.len() <= MAX_TAGS_A_MESSAGE
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewer_that_reads_nothing_costs_no_more_than_the_limit() {
        let mut outbox = Outbox::default();
        let moved = |x| Command::Pointer(PointerEvent::Moved([x, 0.0]));
        (0..1_000_000).for_each(|x| outbox.push(moved(x as f32)));
        assert_eq!(outbox.0, [moved(999_999.0)]);
        (1..MAX_WAITING).for_each(|_| outbox.push(Command::Pick([1, 1])));
        assert!(!outbox.has_room());
        outbox.push(Command::Pick([1, 1]));
        assert_eq!(outbox.0.len(), MAX_WAITING);
    }
}
