//! Subscriptions of a session: from what the server publishes to values, and what is to be
//! asked for because of it. No socket, no clock.
//!
//! A sign that something was sent which did not come, or could not be understood, never
//! leaves the values before it as they were: they are suspect until the missing notification
//! comes, or until they are read anew.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::time::{Duration, Instant, SystemTime};

use async_opcua::types::{
    DataChangeNotification, DataValue, EventNotificationList, ExtensionObject, NodeId,
    NotificationMessage, PublishResponse, StatusChangeNotification, SubscriptionAcknowledgement,
};
use busbar_plugin_sdk::LogLevel;

use crate::conditions::{EVENTS_HANDLE, Event, read_event};
use crate::fault::Fault;
use crate::point_states::PointStates;
use crate::sequence::Arrival;
use crate::subscription::Subscription;

/// Shortest time between two readings of the values of one subscription.
const READ_INTERVAL: Duration = Duration::from_millis(100);
/// Shortest time between two requests for all conditions.
const REFRESH_INTERVAL: Duration = Duration::from_secs(2);
/// Acknowledgements that wait for a publish request.
const MAX_ACKNOWLEDGEMENTS: usize = 10_000;

/// Something to ask the server for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Inquiry {
    /// A notification that is missing.
    Republish { subscription: u32, number: u32 },
    /// The values of items.
    Read { subscription: u32, epoch: u64, items: Vec<usize> },
    /// All conditions of interest.
    Refresh,
}

/// Moment of an event loop: its own time, and the wall clock's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub(crate) now: Instant,
    pub(crate) wall: SystemTime,
}

/// Conditions as the server has them, and the subscription of their events.
pub(crate) struct Events {
    pub(crate) subscription: u32,
    pub(crate) by_node: HashMap<NodeId, usize>,
    /// By condition: whether it has a node.
    pub(crate) known: Vec<bool>,
    refresh: Refresh,
}

/// Requests for all conditions.
#[derive(Default)]
struct Refresh {
    is_due: bool,
    last: Option<Instant>,
    /// Number of requests that have not ended.
    open: u32,
    /// An end counts only after a start: events were lost, and with them perhaps the end of
    /// a request before.
    is_start_needed: bool,
    /// The server tells of starts.
    has_starts: bool,
}

impl Events {
    /// Conditions whose events come by a subscription, and which were asked for just now.
    pub(crate) fn new(
        subscription: u32,
        by_node: HashMap<NodeId, usize>,
        known: Vec<bool>,
        now: Instant,
    ) -> Self {
        let refresh = Refresh { last: Some(now), open: 1, ..Refresh::default() };
        Self { subscription, by_node, known, refresh }
    }
}

/// All subscriptions of a session.
pub(crate) struct SubscriptionSet {
    point_states: Rc<RefCell<PointStates>>,
    all: Vec<Subscription>,
    pub(crate) events: Option<Events>,
    namespaces: Vec<String>,
    inquiries: Vec<Inquiry>,
    acknowledgements: Vec<SubscriptionAcknowledgement>,
}

impl SubscriptionSet {
    pub(crate) fn new(point_states: Rc<RefCell<PointStates>>, namespaces: Vec<String>) -> Self {
        Self {
            point_states,
            all: Vec::new(),
            events: None,
            namespaces,
            inquiries: Vec::new(),
            acknowledgements: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, subscription: Subscription) {
        self.all.push(subscription);
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Longest silence of a subscription that is borne.
    pub(crate) fn limit(&self) -> Option<Duration> {
        self.all.iter().map(|one| one.limit).max()
    }

    /// Counts the silence of all subscriptions from now on.
    pub(crate) fn begin(&mut self, now: Instant) {
        for one in &mut self.all {
            one.heard = now;
        }
    }

    /// Takes at most `max` acknowledgements of notifications that were received.
    pub(crate) fn take_acknowledgements(&mut self, max: usize) -> Vec<SubscriptionAcknowledgement> {
        let count = self.acknowledgements.len().min(max);
        self.acknowledgements.drain(..count).collect()
    }

    /// Finds a subscription that gave no sign of life for longer than is borne.
    ///
    /// # Errors
    /// A fault where a subscription was silent for too long.
    pub(crate) fn check_silence(&self, now: Instant) -> Result<(), Fault> {
        match self.all.iter().find(|one| one.is_overdue(now)) {
            Some(one) => Err(Fault::SilentSubscription {
                silence: now.saturating_duration_since(one.heard),
                due: one.due,
            }),
            None => Ok(()),
        }
    }

    /// Takes the publish response of the server.
    ///
    /// # Errors
    /// An error where a subscription ended.
    pub(crate) fn take(&mut self, answer: PublishResponse, at: Moment) -> Result<(), Fault> {
        let message = answer.notification_message;
        check_end(&message)?;
        let has_data = message.notification_data.as_ref().is_some_and(|data| !data.is_empty());
        let found = self.all.iter().position(|one| one.id == answer.subscription_id);
        let Some(index) = found else {
            if has_data {
                self.note("the server published for a subscription that there is not");
                self.lose_all();
                let published = message.publish_time.checked_ticks();
                for one in &mut self.all {
                    one.begin_doubt(published);
                }
                self.point_states.borrow_mut().flush();
            }
            return Ok(());
        };
        let one = &mut self.all[index];
        one.heard = at.now;
        if has_data {
            let (id, number) = (one.id, message.sequence_number);
            self.acknowledge(id, number);
        }
        let available = answer.available_sequence_numbers.unwrap_or_default();
        let arrival = self.all[index].sequence.take(message, &available);
        self.handle_arrival(index, arrival, !answer.more_notifications, at)
    }

    /// Takes a notification that was asked for; none where the server does not have it.
    ///
    /// # Errors
    /// An error where a subscription ended.
    pub(crate) fn take_republished(
        &mut self,
        subscription: u32,
        number: u32,
        message: Option<NotificationMessage>,
        at: Moment,
    ) -> Result<(), Fault> {
        let Some(index) = self.all.iter().position(|one| one.id == subscription) else {
            return Ok(());
        };
        if let Some(message) = &message {
            check_end(message)?;
            self.acknowledge(subscription, number);
        }
        let arrival = self.all[index].sequence.take_republished(number, message);
        self.handle_arrival(index, arrival, false, at)
    }

    /// Takes the values of items that were read.
    pub(crate) fn take_read(
        &mut self,
        subscription: u32,
        epoch: u64,
        values: impl IntoIterator<Item = (usize, DataValue)>,
        at: Moment,
    ) {
        let Some(one) = self.all.iter_mut().find(|one| one.id == subscription) else { return };
        one.is_reading = false;
        one.next_read = at.now + READ_INTERVAL;
        // What is missing meanwhile may have been sent before they were read.
        if one.epoch == epoch && !one.sequence.has_gap() {
            one.doubt = None;
            let mut point_states = self.point_states.borrow_mut();
            for (item, value) in values {
                point_states.take_read(item, &value, at.now, at.wall);
            }
            point_states.flush();
        }
    }

    /// Suspects all values: for a while nothing was heard that is believed.
    pub(crate) fn lose_all(&mut self) {
        for index in 0..self.all.len() {
            self.lose(index);
        }
    }

    /// Lists the requests that the server is to get now.
    pub(crate) fn inquire(&mut self, now: Instant) -> Vec<Inquiry> {
        let mut inquiries = std::mem::take(&mut self.inquiries);
        for one in &mut self.all {
            if !one.is_lossy || one.is_reading || now < one.next_read || one.sequence.has_gap() {
                continue;
            }
            let point_states = self.point_states.borrow();
            let items = point_states.items_to_read(one.items.clone(), now);
            one.is_lossy = point_states.has_lost(one.items.clone());
            if !items.is_empty() {
                one.is_reading = true;
                let (subscription, epoch) = (one.id, one.epoch);
                inquiries.push(Inquiry::Read { subscription, epoch, items });
            }
        }
        if let Some(events) = &mut self.events {
            let refresh = &mut events.refresh;
            let is_early = refresh.last.is_some_and(|last| now < last + REFRESH_INTERVAL);
            if refresh.is_due && !is_early {
                (refresh.is_due, refresh.last) = (false, Some(now));
                refresh.open += 1;
                if let Some(mirror) = self.point_states.borrow().mirror() {
                    mirror.begin_refresh();
                }
                inquiries.push(Inquiry::Refresh);
            }
        }
        inquiries
    }

    /// Finds the time to ask at the latest, where something waits for its time.
    pub(crate) fn next_inquiry(&self) -> Option<Instant> {
        let point_states = self.point_states.borrow();
        let reads = self.all.iter().filter(|one| {
            let is_waiting = one.is_lossy && !one.is_reading && !one.sequence.has_gap();
            is_waiting && !point_states.items_to_read(one.items.clone(), one.next_read).is_empty()
        });
        let refresh = self.events.as_ref().map(|events| &events.refresh);
        let refresh = refresh.filter(|refresh| refresh.is_due).and_then(|refresh| refresh.last);
        let reads = reads.map(|one| one.next_read);
        reads.chain(refresh.map(|last| last + REFRESH_INTERVAL)).min()
    }

    fn acknowledge(&mut self, subscription_id: u32, sequence_number: u32) {
        // What is not acknowledged the server drops by itself, when it has too much of it.
        if self.acknowledgements.len() < MAX_ACKNOWLEDGEMENTS {
            let one = SubscriptionAcknowledgement { subscription_id, sequence_number };
            self.acknowledgements.push(one);
        }
    }

    fn handle_arrival(
        &mut self,
        index: usize,
        arrival: Arrival,
        is_last: bool,
        at: Moment,
    ) -> Result<(), Fault> {
        let items = self.all[index].items.clone();
        if arrival.is_gap_new {
            self.note("a notification is missing: its values are uncertain until it comes");
            self.point_states.borrow_mut().suspect(items.clone());
            self.suspect_conditions(index);
        }
        if arrival.is_lost {
            self.note("notifications were lost: their values are read anew");
            self.lose(index);
        }
        let mut is_understood = true;
        let published = arrival.ready.iter().map(|message| message.publish_time.checked_ticks());
        let is_doubted = published.max().is_some_and(|time| self.all[index].is_doubted(time));
        self.point_states.borrow_mut().is_more_missing =
            is_doubted || self.all[index].sequence.has_gap();
        for message in arrival.ready {
            for data in message.notification_data.unwrap_or_default() {
                is_understood &= self.apply(index, &data, at);
            }
        }
        self.point_states.borrow_mut().is_more_missing = false;
        if !is_understood {
            self.note("a notification could not be understood: its values are read anew");
            self.lose(index);
        }
        if is_doubted {
            self.note(
                "a notification may be older than one that was lost: its values are read anew",
            );
            self.lose(index);
        }
        if let Some(number) = arrival.republish {
            let subscription = self.all[index].id;
            self.inquiries.push(Inquiry::Republish { subscription, number });
        }
        let is_of_events = self.is_of_events(index);
        let mut point_states = self.point_states.borrow_mut();
        if arrival.is_filled && is_understood {
            point_states.restore(items.clone(), at.now, at.wall);
        }
        let is_sound = is_understood && !is_doubted && !arrival.is_lost && !arrival.is_duplicate;
        if is_sound && is_last && !self.all[index].sequence.has_gap() {
            point_states.confirm(items, at.now, at.wall);
            if is_of_events {
                point_states.confirm_conditions(at.now, at.wall);
            }
        }
        if is_of_events && let Some(mirror) = point_states.mirror() {
            mirror.confirm();
        }
        point_states.flush();
        Ok(())
    }

    fn note(&self, text: &str) {
        self.point_states.borrow_mut().name(LogLevel::Warning, text);
    }

    fn is_of_events(&self, index: usize) -> bool {
        let id = self.all[index].id;
        self.events.as_ref().is_some_and(|events| events.subscription == id)
    }

    /// Notes that reports of a subscription are lost.
    fn lose(&mut self, index: usize) {
        let one = &mut self.all[index];
        one.epoch += 1;
        one.is_lossy = true;
        self.point_states.borrow_mut().suspect_lost(one.items.clone());
        self.suspect_conditions(index);
    }

    /// Notes that events may be missing, where this is their subscription.
    fn suspect_conditions(&mut self, index: usize) {
        if self.is_of_events(index) {
            self.suspect_events();
        }
    }

    fn suspect_events(&mut self) {
        let Some(events) = &mut self.events else { return };
        let refresh = &mut events.refresh;
        refresh.is_due = true;
        refresh.is_start_needed |= refresh.open > 0 && refresh.has_starts;
        refresh.open = 0;
        let mut point_states = self.point_states.borrow_mut();
        point_states.begin_refresh();
        point_states.tell_mirror("events were lost: its conditions are asked for anew");
    }

    /// Applies a part of a notification; whether it could be understood.
    fn apply(&mut self, index: usize, data: &ExtensionObject, at: Moment) -> bool {
        let items = self.all[index].items.clone();
        if let Some(changes) = data.inner_as::<DataChangeNotification>() {
            let mut is_understood = true;
            let mut point_states = self.point_states.borrow_mut();
            for change in changes.monitored_items.iter().flatten() {
                let item = change.client_handle as usize;
                if items.contains(&item) {
                    point_states.take(item, &change.value, at.now, at.wall);
                } else {
                    is_understood = false;
                }
            }
            is_understood
        } else if let Some(list) = data.inner_as::<EventNotificationList>() {
            self.is_of_events(index) && self.take_events(list, at)
        } else {
            false
        }
    }

    fn take_events(&mut self, list: &EventNotificationList, at: Moment) -> bool {
        let mut is_understood = true;
        for event in list.events.iter().flatten() {
            let fields = event.event_fields.as_deref().unwrap_or_default();
            let read = read_event(fields);
            match read {
                _ if event.client_handle != EVENTS_HANDLE => is_understood = false,
                Event::State { condition, told } => {
                    let mut point_states = self.point_states.borrow_mut();
                    if let Some(mirror) = point_states.mirror() {
                        mirror.take(&self.namespaces, condition, &told);
                    }
                    let events = self.events.as_ref();
                    if let Some(place) = events.and_then(|events| events.by_node.get(condition)) {
                        point_states.take_event(*place, &told, at.now, at.wall);
                    }
                }
                Event::RefreshStart => {
                    if let Some(events) = &mut self.events {
                        events.refresh.is_start_needed = false;
                        events.refresh.has_starts = true;
                    }
                }
                Event::RefreshEnd => self.end_refresh(at),
                Event::RefreshRequired => self.suspect_events(),
                Event::Other => {}
                Event::Unreadable => is_understood = false,
            }
        }
        is_understood
    }

    fn end_refresh(&mut self, at: Moment) {
        let Some(events) = &mut self.events else { return };
        let refresh = &mut events.refresh;
        if refresh.is_start_needed || refresh.open == 0 {
            return;
        }
        refresh.open -= 1;
        let mut point_states = self.point_states.borrow_mut();
        if refresh.open == 0 {
            point_states.end_refresh(&events.known, at.now, at.wall);
        }
        if let Some(mirror) = point_states.mirror() {
            mirror.end_refresh();
        }
    }
}

/// Finds the notification that a subscription ended, whatever its number is.
fn check_end(message: &NotificationMessage) -> Result<(), Fault> {
    let data = message.notification_data.iter().flatten();
    let mut ended = data.filter_map(|data| data.inner_as::<StatusChangeNotification>());
    match ended.next() {
        Some(change) => {
            Err(Fault::Refused { what: "the subscription ended", status: change.status })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
#[path = "subscriptions_tests.rs"]
mod tests;
