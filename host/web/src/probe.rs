//! Entry points for fuzzing: messages of pages, parsed without a socket.

use busbar_protocol::message::Command;

use crate::message::FromPage;
pub use crate::message::MAX_MESSAGE_BYTES;
use crate::steering::{Seat, Steering};

/// Pages of one view, and the one that steers it.
#[derive(Default)]
pub struct Pages {
    steering: Steering,
    seats: Vec<Seat>,
}

impl Pages {
    /// Adds a page; returns commands for the viewer.
    pub fn join(&mut self) -> Vec<Command> {
        let (seat, commands) = self.steering.join();
        self.seats.push(seat);
        commands
    }

    /// Removes a page; returns commands for the viewer.
    pub fn leave(&mut self, page: usize) -> Vec<Command> {
        self.steering.leave(self.seats.remove(page))
    }

    /// Handles a page's message; returns commands for the viewer.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn receive(&mut self, page: usize, text: &str) -> Result<Vec<Command>, String> {
        self.steering.act(self.seats[page], FromPage::parse(text)?)
    }

    /// Returns the number of pages.
    pub fn count(&self) -> usize {
        self.seats.len()
    }

    /// Returns the number of pages that steer; at most one.
    pub fn steering(&self) -> usize {
        self.seats.iter().filter(|seat| self.steering.does_steer(**seat)).count()
    }
}
