//! What pages and operators write, read without a socket: for fuzzing.

use busbar_protocol::message::Command;

use crate::message::FromPage;
pub use crate::message::MAX_MESSAGE_BYTES;
use crate::steering::{Seat, Steering};

/// Pages that look at one view, and who of them steers.
#[derive(Default)]
pub struct Pages {
    steering: Steering,
    seats: Vec<Seat>,
}

impl Pages {
    /// One more page; what the viewer is asked.
    pub fn join(&mut self) -> Vec<Command> {
        let (seat, commands) = self.steering.join();
        self.seats.push(seat);
        commands
    }

    /// A page goes; what the viewer is asked.
    pub fn leave(&mut self, page: usize) -> Vec<Command> {
        self.steering.leave(self.seats.remove(page))
    }

    /// A page says something; what the viewer is asked.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn say(&mut self, page: usize, text: &str) -> Result<Vec<Command>, String> {
        self.steering.act(self.seats[page], FromPage::parse(text)?)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.seats.len()
    }

    /// How many of them steer.
    pub fn steering(&self) -> usize {
        self.seats.iter().filter(|seat| self.steering.does_steer(**seat)).count()
    }
}
