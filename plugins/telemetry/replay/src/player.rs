//! A recording against a clock: what is due, from `start` to `end`.

use busbar_plugin_sdk::Reason;

use crate::decimate::Decimator;
use crate::recording::{Fault, Recording, Update};
use crate::remarks::Remarks;

/// Updates that are read before the caller looks whether to go on.
pub(crate) const MAX_UPDATES_AT_ONCE: usize = 16_384;
/// Longest duration of the last instant, nanoseconds of the recording.
const MAX_LAST_STEP: i64 = 10_000_000_000;

/// Progress of the player.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// All that is due was taken.
    Waiting,
    /// Updates since this time are due, and not played yet.
    More(i64),
    /// The end has come, and lasted, at this time.
    Ended(i64),
}

/// Plays a recording. Times are nanoseconds from where it starts.
pub(crate) struct Player {
    recording: Box<dyn Recording>,
    decimator: Decimator,
    /// From the recording's origin to where playing starts and ends.
    start: i64,
    end: i64,
    /// The instant that comes next, and its updates.
    next: Option<i64>,
    updates: Vec<Update>,
    /// State of each tag before the start.
    before: Vec<Option<Update>>,
    /// In a pass after the first: tags that have no value of it yet, whose values would be
    /// those of the end of the pass before.
    is_unset: Vec<bool>,
    /// Set where such a pass begins; then the time of its first instant.
    expects_first: bool,
    first: Option<i64>,
    /// The last instant that was played, and how long after the one before it.
    last: Option<i64>,
    step: i64,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// Search for the start of playing.
    Seeking,
    Playing,
    /// After the last instant.
    Ending,
}

impl Player {
    /// Plays `recording` from `start` to `end`, both from its origin.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub(crate) fn new(
        mut recording: Box<dyn Recording>,
        is_discrete: Vec<bool>,
        interval: Option<i64>,
        start: i64,
        end: i64,
    ) -> Result<Self, Fault> {
        recording.skip_to(start)?;
        let (before, is_unset) = (vec![None; is_discrete.len()], vec![false; is_discrete.len()]);
        let decimator = Decimator::new(is_discrete.into_iter(), interval);
        Ok(Self {
            recording,
            decimator,
            start,
            end,
            next: None,
            updates: Vec::new(),
            before,
            is_unset,
            expects_first: false,
            first: None,
            last: None,
            step: 0,
            state: State::Seeking,
        })
    }

    /// Appends what is due until `head`, times counted from the start.
    ///
    /// # Errors
    /// What ends the recording before its end.
    pub(crate) fn advance(
        &mut self,
        head: i64,
        out: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) -> Result<Progress, Fault> {
        let mut taken = 0;
        while self.state != State::Ending {
            if taken >= MAX_UPDATES_AT_ONCE {
                return Ok(Progress::More(self.last.unwrap_or(0)));
            }
            let Some(time) = self.load(remarks)? else { break };
            taken += 1 + self.updates.len();
            if self.state == State::Seeking {
                if time < 0 {
                    self.keep_before();
                    continue;
                }
                self.state = State::Playing;
                self.begin(out);
            }
            let time = time.max(0);
            if self.first.is_some_and(|first| first < time) {
                self.end_first_instant(out);
            }
            if time > head {
                self.decimator.release(head, out);
                return Ok(Progress::Waiting);
            }
            self.play(time, out);
        }
        self.end_first_instant(out);
        Ok(self.finish(head, out))
    }

    /// Goes back to the start, for another pass.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub(crate) fn rewind(&mut self, out: &mut Vec<Update>) -> Result<(), Fault> {
        self.recording.rewind()?;
        (self.next, self.last, self.step, self.state) = (None, None, 0, State::Playing);
        self.updates.clear();
        let is_set = self.before.iter().map(Option::is_some);
        self.is_unset = is_set.map(|is_set| !is_set).collect();
        (self.expects_first, self.first) = (true, None);
        self.begin(out);
        Ok(())
    }

    /// After the first instant of a further pass, tags without a value of it are missing.
    fn end_first_instant(&mut self, out: &mut Vec<Update>) {
        let Some(first) = self.first.take() else { return };
        for point in 0..self.is_unset.len() {
            if std::mem::take(&mut self.is_unset[point]) {
                self.decimator.take(Update::missing(point, first, Reason::NotConnected), out);
            }
        }
    }

    /// Reads the next instant, unless it is there; its time from the start.
    fn load(&mut self, remarks: &mut Remarks) -> Result<Option<i64>, Fault> {
        if self.next.is_none() {
            self.updates.clear();
            if self.state == State::Seeking {
                self.recording.mark();
            }
            let time = self.recording.read(&mut self.updates, remarks)?;
            let time = time.filter(|time| *time <= self.end);
            self.next = time.map(|time| time.saturating_sub(self.start));
        }
        if self.next.is_none() {
            self.state = State::Ending;
        }
        Ok(self.next)
    }

    fn keep_before(&mut self) {
        for update in self.updates.drain(..) {
            let point = update.point;
            self.before[point] = Some(update);
        }
        self.next = None;
    }

    /// Applies the state before the start at the start.
    fn begin(&mut self, out: &mut Vec<Update>) {
        for update in self.before.iter().flatten() {
            self.decimator.take(Update { nanos: 0, ..update.clone() }, out);
        }
    }

    fn play(&mut self, time: i64, out: &mut Vec<Update>) {
        if std::mem::take(&mut self.expects_first) {
            self.first = Some(time);
        }
        for update in self.updates.drain(..) {
            self.is_unset[update.point] = false;
            let nanos = update.nanos.saturating_sub(self.start);
            self.decimator.take(Update { nanos, ..update }, out);
        }
        if let Some(last) = self.last.filter(|last| *last < time) {
            self.step = time - last;
        }
        self.last = Some(time);
        self.next = None;
    }

    fn finish(&mut self, head: i64, out: &mut Vec<Update>) -> Progress {
        // The last instant lasts as long as the one before it.
        let end = self.last.unwrap_or(0).saturating_add(self.step.min(MAX_LAST_STEP));
        if head < end {
            self.decimator.release(head, out);
            return Progress::Waiting;
        }
        self.decimator.close(out);
        Progress::Ended(end)
    }

    /// Reports whether anything was played in this pass.
    pub(crate) fn has_played(&self) -> bool {
        self.last.is_some()
    }
}

#[cfg(test)]
#[path = "player_tests.rs"]
mod tests;
