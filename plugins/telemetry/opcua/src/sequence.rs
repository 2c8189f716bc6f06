//! Sequence numbers of a subscription's notifications (OPC 10000-4, 5.14.1.1 and 7.8): gaps,
//! Republish, duplicates, and servers whose keep-alives count otherwise.
//!
//! The first notification has the number 1. A keep-alive has the number of the notification
//! that comes next, and uses none. Some servers have it use a number, others have it repeat
//! the last one; both are told apart here by what they send. No socket, no clock.

use std::collections::{BTreeMap, VecDeque};
use std::hash::{DefaultHasher, Hash, Hasher};

use async_opcua::types::{DataChangeNotification, NotificationMessage};

/// Notifications that wait for those before them.
const MAX_HELD: usize = 128;
/// Missing notifications that are asked for, one after the other; of a longer gap all values
/// are read anew.
const MAX_REPUBLISHED: u32 = 64;
/// Messages that are remembered, for their duplicates to be known.
const MAX_SEEN: usize = 64;
/// Numbers in succession that a keep-alive announced and no notification had, after which
/// keep-alives count as using numbers.
const KEEP_ALIVES_TO_LEARN: u32 = 3;

/// Number after another; they begin anew at 1 (OPC 10000-4, 7.8).
fn after(number: u32) -> u32 {
    number.checked_add(1).unwrap_or(1)
}

/// Numbers from one to another, negative where the other comes before it.
fn distance(from: u32, to: u32) -> i32 {
    to.wrapping_sub(from).cast_signed()
}

/// Fingerprint of a notification: the items that it is of, in their order.
fn fingerprint(message: &NotificationMessage) -> u64 {
    let mut hasher = DefaultHasher::new();
    for data in message.notification_data.iter().flatten() {
        match data.inner_as::<DataChangeNotification>() {
            Some(changes) => {
                for change in changes.monitored_items.iter().flatten() {
                    change.client_handle.hash(&mut hasher);
                }
            }
            None => data.binary_type_id().hash(&mut hasher),
        }
    }
    hasher.finish()
}

/// Number of a keep-alive, as a server counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum KeepAliveNumber {
    /// Number of the next notification, as the standard has it.
    #[default]
    Next,
    /// A number of its own, which no notification has.
    Own,
    /// Number of the last notification, repeated.
    Last,
}

/// Consequence of a message.
#[derive(Debug, Default)]
pub(crate) struct Arrival {
    /// Notifications whose turn it is, in their order.
    pub(crate) ready: Vec<NotificationMessage>,
    /// Notifications are known to be missing, and were not before.
    pub(crate) is_gap_new: bool,
    /// Notifications are lost for good: all values are to be read anew.
    pub(crate) is_lost: bool,
    /// True where the last missing notification arrived, so that the gap is filled.
    pub(crate) is_filled: bool,
    /// Number of a notification to ask for.
    pub(crate) republish: Option<u32>,
    /// The very message, or the notification that it announces, came before.
    pub(crate) is_duplicate: bool,
}

/// Order of one subscription's notifications.
#[derive(Debug)]
pub(crate) struct Sequence {
    /// Number of the notification that comes next.
    next: u32,
    /// Number after the last notification that is known to have been sent.
    end: u32,
    /// Notifications that wait for those before them.
    held: BTreeMap<u32, NotificationMessage>,
    /// Number that was asked for and not answered yet.
    asked: Option<u32>,
    /// Numbers of keep-alives that no notification had yet, and whether the server kept each
    /// for Republish at once.
    announced: BTreeMap<u32, bool>,
    /// Number, time and fingerprint of messages that came; no fingerprint of keep-alives.
    seen: VecDeque<(u32, i64, Option<u64>)>,
    counting: KeepAliveNumber,
    /// Announced numbers in succession that no notification had.
    evidence: u32,
    /// Number that comes next if the server began to count anew.
    restarted: Option<u32>,
}

impl Default for Sequence {
    fn default() -> Self {
        Self {
            next: 1,
            end: 1,
            held: BTreeMap::new(),
            asked: None,
            announced: BTreeMap::new(),
            seen: VecDeque::new(),
            counting: KeepAliveNumber::Next,
            evidence: 0,
            restarted: None,
        }
    }
}

impl Sequence {
    /// Reports whether notifications are known to be missing.
    pub(crate) fn has_gap(&self) -> bool {
        distance(self.next, self.end) > 0
    }

    /// Takes a message that the server sent, keep-alive or notification; `available` are
    /// the numbers that the server keeps for Republish.
    pub(crate) fn take(&mut self, message: NotificationMessage, available: &[u32]) -> Arrival {
        let mut arrival = Arrival::default();
        let had_gap = self.has_gap();
        let number = message.sequence_number;
        let is_keep_alive = message.notification_data.as_ref().is_none_or(Vec::is_empty);
        let is_remembered = !is_keep_alive || self.counting == KeepAliveNumber::Own;
        if is_remembered && self.is_duplicate(&message, is_keep_alive) {
            arrival.is_duplicate = true;
            return arrival;
        }
        if available.iter().any(|kept| self.announced.get(kept) == Some(&false)) {
            self.keep_alives_use_none(&mut arrival);
        }
        if self.restarted == Some(number) && number != self.next {
            self.adopt(if is_keep_alive { number } else { after(number) }, &mut arrival);
        } else if is_keep_alive {
            let is_overtaken = self.is_overtaken(&message);
            self.take_keep_alive(number, available.contains(&number), is_overtaken, &mut arrival);
        } else {
            self.take_data(number, message, &mut arrival);
        }
        self.proceed(had_gap, &mut arrival);
        arrival
    }

    /// Takes the answer to a request for a notification: the message, or none where the
    /// server does not have it.
    pub(crate) fn take_republished(
        &mut self,
        number: u32,
        message: Option<NotificationMessage>,
    ) -> Arrival {
        let mut arrival = Arrival::default();
        if self.asked != Some(number) {
            return arrival;
        }
        self.asked = None;
        let had_gap = self.has_gap();
        if had_gap && self.next == number {
            match message.filter(|message| message.sequence_number == number) {
                Some(message)
                    if message.notification_data.as_ref().is_some_and(|d| !d.is_empty()) =>
                {
                    self.is_duplicate(&message, false);
                    self.held.insert(number, message);
                }
                // The server kept a keep-alive: nothing is missing.
                Some(_) if self.announced.contains_key(&number) => {
                    self.counting = KeepAliveNumber::Own;
                    self.announced.insert(number, true);
                }
                _ => self.give_up(&mut arrival),
            }
        }
        self.proceed(had_gap, &mut arrival);
        arrival
    }

    /// Reports whether the identical message came before, and remembers it.
    fn is_duplicate(&mut self, message: &NotificationMessage, is_keep_alive: bool) -> bool {
        let time = message.publish_time.checked_ticks();
        let content = (!is_keep_alive).then(|| fingerprint(message));
        let key = (message.sequence_number, time, content);
        // Without a time nothing tells a duplicate from a server that counts anew.
        if time != 0 && self.seen.contains(&key) {
            return true;
        }
        if self.seen.len() == MAX_SEEN {
            self.seen.pop_front();
        }
        self.seen.push_back(key);
        false
    }

    /// Reports whether a keep-alive was published before the notification of its number, which
    /// came already.
    fn is_overtaken(&self, keep_alive: &NotificationMessage) -> bool {
        let number = keep_alive.sequence_number;
        let time = keep_alive.publish_time.checked_ticks();
        time != 0
            && self.seen.iter().any(|(seen, published, content)| {
                *seen == number && content.is_some() && *published > time
            })
    }

    fn take_keep_alive(
        &mut self,
        number: u32,
        is_kept: bool,
        is_overtaken: bool,
        arrival: &mut Arrival,
    ) {
        if self.counting == KeepAliveNumber::Own && self.announced.get(&number) == Some(&false) {
            // The same number a second time: a keep-alive uses none.
            self.keep_alives_use_none(arrival);
            (self.next, self.end) = (number, number);
            self.held.clear();
        }
        let ahead = distance(self.next, number);
        if ahead >= 0 {
            self.restarted = None;
        }
        match self.counting {
            KeepAliveNumber::Last if ahead == -1 => {}
            KeepAliveNumber::Last if ahead >= 0 => {
                // Either the notification of this number is lost, or the next one is meant.
                self.counting = KeepAliveNumber::Next;
                self.extend(after(number));
            }
            KeepAliveNumber::Next if ahead == -1 && is_overtaken => arrival.is_duplicate = true,
            KeepAliveNumber::Next if ahead == -1 && !self.has_gap() => {
                // That of the last notification: what was lost before, nobody knows.
                self.counting = KeepAliveNumber::Last;
                arrival.is_lost = true;
            }
            _ if ahead < 0 => self.go_back(number, arrival),
            _ if is_kept || self.counting == KeepAliveNumber::Own => {
                // Kept for Republish already, so it is no number of what is yet to come:
                // that of a notification that is lost, or its own. Republish tells.
                self.announce(number, is_kept);
                self.extend(after(number));
            }
            _ => {
                if ahead == 0 && self.announced.contains_key(&number) {
                    // The same number a second time: a keep-alive uses none.
                    self.evidence = 0;
                }
                self.announce(number, is_kept);
                self.extend(number);
            }
        }
    }

    fn take_data(&mut self, number: u32, message: NotificationMessage, arrival: &mut Arrival) {
        if self.announced.contains_key(&number) {
            if self.counting == KeepAliveNumber::Own && distance(self.next, number) < 0 {
                (self.next, self.end) = (number, number);
                self.held.clear();
            }
            self.keep_alives_use_none(arrival);
        }
        if distance(self.next, number) < 0 {
            self.go_back(after(number), arrival);
            return;
        }
        self.restarted = None;
        self.extend(after(number));
        if self.held.len() == MAX_HELD {
            self.give_up(arrival);
        }
        if self.held.insert(number, message).is_some() {
            // Two with one number: nobody knows which is newer.
            self.held.remove(&number);
            arrival.is_lost = true;
        }
    }

    /// Notes a number that was used before by another message: the server counts anew, or
    /// says late what was given up. What it has must be read.
    fn go_back(&mut self, next: u32, arrival: &mut Arrival) {
        self.restarted = Some(next);
        arrival.is_lost = true;
    }

    /// Restarts the sequence at this number, from which the server counts anew.
    fn adopt(&mut self, next: u32, arrival: &mut Arrival) {
        self.held.clear();
        self.announced.clear();
        (self.next, self.end, self.asked, self.restarted) = (next, next, None, None);
        self.counting = KeepAliveNumber::Next;
        self.evidence = 0;
        arrival.is_lost = true;
    }

    /// Notes that a number which a keep-alive had is that of a notification.
    fn keep_alives_use_none(&mut self, arrival: &mut Arrival) {
        self.evidence = 0;
        self.announced.clear();
        if self.counting == KeepAliveNumber::Own {
            // What was lost while that was believed, nobody knows.
            self.counting = KeepAliveNumber::Next;
            arrival.is_lost = true;
        }
    }

    fn announce(&mut self, number: u32, is_kept: bool) {
        self.announced.insert(number, is_kept);
        if self.announced.len() > MAX_HELD {
            self.announced.pop_first();
        }
    }

    fn extend(&mut self, end: u32) {
        if distance(self.end, end) > 0 {
            self.end = end;
        }
    }

    /// Gives up the missing notifications and continues after the gap.
    fn give_up(&mut self, arrival: &mut Arrival) {
        arrival.is_lost = true;
        if self.missing() > MAX_REPUBLISHED {
            self.next = self.first_held().unwrap_or(self.end);
            self.evidence = 0;
        }
        while self.has_gap() && !self.held.contains_key(&self.next) {
            if self.counting != KeepAliveNumber::Own {
                let is_announced = self.announced.remove(&self.next).is_some();
                self.evidence = if is_announced { self.evidence.saturating_add(1) } else { 0 };
            }
            self.next = after(self.next);
        }
        if self.evidence >= KEEP_ALIVES_TO_LEARN && self.counting == KeepAliveNumber::Next {
            self.counting = KeepAliveNumber::Own;
        }
    }

    /// Held notification that comes first.
    fn first_held(&self) -> Option<u32> {
        self.held.keys().copied().min_by_key(|number| distance(self.next, *number))
    }

    /// Notifications that are missing before the next one that is held.
    fn missing(&self) -> u32 {
        let end = self.first_held().unwrap_or(self.end);
        distance(self.next, end).max(0).cast_unsigned()
    }

    /// Releases the notifications that are in order, and requests the missing ones.
    fn proceed(&mut self, had_gap: bool, arrival: &mut Arrival) {
        loop {
            self.release(arrival);
            if self.missing() <= MAX_REPUBLISHED {
                break;
            }
            self.give_up(arrival);
        }
        let has_gap = self.has_gap();
        arrival.is_gap_new = has_gap && !had_gap;
        arrival.is_filled = had_gap && !has_gap && !arrival.is_lost;
        if !has_gap {
            self.asked = None;
        } else if self.asked != Some(self.next) {
            self.asked = Some(self.next);
            arrival.republish = Some(self.next);
        }
    }

    fn release(&mut self, arrival: &mut Arrival) {
        loop {
            if let Some(message) = self.held.remove(&self.next) {
                self.announced.remove(&self.next);
                arrival.ready.push(message);
            } else if self.counting != KeepAliveNumber::Own
                || !self.announced.contains_key(&self.next)
            {
                break;
            }
            self.next = after(self.next);
        }
        self.extend(self.next);
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
