//! Entry points for fuzzing: messages of pages, parsed without a socket.

use busbar_protocol::message::Command;

use crate::message::FromPage;
pub use crate::message::MAX_MESSAGE_BYTES;
use crate::steering::{PageId, Steering};

/// Pages of one view, and the one that steers it.
#[derive(Default)]
pub struct Pages {
    steering: Steering,
    page_ids: Vec<PageId>,
}

impl Pages {
    /// Adds a page; returns commands for the viewer.
    pub fn join(&mut self) -> Vec<Command> {
        let (page_id, commands) = self.steering.join();
        self.page_ids.push(page_id);
        commands
    }

    /// Removes a page; returns commands for the viewer.
    pub fn leave(&mut self, page: usize) -> Vec<Command> {
        self.steering.leave(self.page_ids.remove(page))
    }

    /// Handles a page's message; returns commands for the viewer.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn receive(&mut self, page: usize, text: &str) -> Result<Vec<Command>, String> {
        self.steering.act(self.page_ids[page], FromPage::parse(text)?)
    }

    /// Returns the number of pages.
    pub fn count(&self) -> usize {
        self.page_ids.len()
    }

    /// Returns the number of pages that steer; at most one.
    pub fn steering(&self) -> usize {
        self.page_ids.iter().filter(|page_id| self.steering.is_steering(**page_id)).count()
    }
}
