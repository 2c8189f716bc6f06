//! Host program of an embedded view: its operator, its camera commands, and the picks for it.

use std::collections::VecDeque;

use busbar_scene::NodeIndex;
use busbar_ui::Command;

/// Picks that a host program has yet to hear; of more the oldest goes.
const MAX_HOST_PICKS: usize = 256;

/// State of the interface to a host program.
#[derive(Default)]
pub(crate) struct HostProgram {
    /// True if a host program embeds the view.
    pub(crate) is_attached: bool,
    /// Name of the operator who acts on alarms.
    pub(crate) operator: String,
    /// Camera commands for the next frame.
    pub(crate) camera_commands: Vec<Command>,
    /// Picked nodes that the host program has not received yet.
    picks: VecDeque<Option<NodeIndex>>,
}

impl HostProgram {
    /// Notes what an operator picked.
    pub(crate) fn note_pick(&mut self, node: Option<NodeIndex>) {
        if self.picks.len() == MAX_HOST_PICKS {
            self.picks.pop_front();
        }
        self.picks.push_back(node);
    }

    /// Takes the picks since the last call.
    pub(crate) fn take_picks(&mut self) -> VecDeque<Option<NodeIndex>> {
        std::mem::take(&mut self.picks)
    }
}
