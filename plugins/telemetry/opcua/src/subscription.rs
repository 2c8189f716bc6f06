//! Subscriptions and their monitored items (OPC 10000-4, 5.13 and 5.14).

use std::cell::RefCell;
use std::ops::Range;
use std::time::{Duration, Instant};

use async_opcua::types::{
    AttributeId, CreateMonitoredItemsRequest, CreateSubscriptionRequest, DataChangeFilter,
    DataChangeTrigger, DeadbandType, ExtensionObject, MonitoredItemCreateRequest, MonitoringMode,
    MonitoringParameters, NodeId, ReadValueId, StatusCode, TimestampsToReturn,
};

use crate::client::{Client, answer};
use crate::conditions::events_item;
use crate::fault::Fault;
use crate::point_states::PointStates;
use crate::points::{Deadband, Item};
use crate::sequence::Sequence;
use crate::session::Server;
use crate::settings::Config;

/// Items of one request, where the server does not say.
const ITEMS_PER_CALL: usize = 500;
/// A subscription gives a sign of life this many times within the shortest freshness of
/// its tags, and within the silence that is borne.
const SIGNS_OF_LIFE: u32 = 4;
/// Notifications of a subscription that one which belongs to none may have overtaken: as many
/// as publish requests wait at the server.
const MAX_DOUBTED: u32 = 64;
/// The server keeps a subscription at least this many signs of life long (OPC 10000-4,
/// 5.14.2: three).
const MIN_LIFETIMES: u32 = 3;

/// Subscription of a session, with the state of its notifications.
pub(crate) struct Subscription {
    pub(crate) id: u32,
    /// Indices of the point states that belong to the subscription.
    pub(crate) items: Range<usize>,
    /// Longest time between two signs of life, as the server has it.
    pub(crate) due: Duration,
    /// Longest silence of the server beyond a sign of life before it is lost.
    pub(crate) limit: Duration,
    pub(crate) heard: Instant,
    pub(crate) sequence: Sequence,
    /// Number that grows with each loss of reports; values read under an older one are outdated.
    pub(crate) epoch: u64,
    /// True where items may have values that no report brought.
    pub(crate) is_lossy: bool,
    /// True while values are being read, since the last loss or before it.
    pub(crate) is_reading: bool,
    /// Earliest time of the next read of values.
    pub(crate) next_read: Instant,
    /// Doubt about the order of notifications, since one came that belongs to no subscription.
    pub(crate) doubt: Option<Doubt>,
}

/// Doubt about notifications that were published no later than one which belongs to no
/// subscription: that one may have had newer values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Doubt {
    /// Publish time of the one that belongs to no subscription, in ticks of the server's clock.
    until: i64,
    /// Notifications that may still be doubted, so that a clock which was set back ends it.
    left: u32,
}

/// Creates a subscription without items.
pub(crate) async fn create(
    client: &Client,
    config: &Config,
    freshness: Option<Duration>,
    items: Range<usize>,
    now: Instant,
) -> Result<Subscription, Fault> {
    let patience = freshness.map_or(config.silence, |freshness| freshness.min(config.silence));
    let signs = patience / SIGNS_OF_LIFE;
    let keep_alive = count(signs, config.publishing);
    let lifetime = count(config.session_timeout, config.publishing);
    let request = CreateSubscriptionRequest {
        request_header: client.header(client.limit()),
        requested_publishing_interval: config.publishing.as_secs_f64() * 1000.0,
        requested_lifetime_count: lifetime.max(keep_alive.saturating_mul(MIN_LIFETIMES)),
        requested_max_keep_alive_count: keep_alive,
        max_notifications_per_publish: 0,
        publishing_enabled: true,
        priority: 0,
    };
    let answer = answer!(client, "creating a subscription", CreateSubscription, request)?;
    let interval = Duration::try_from_secs_f64(answer.revised_publishing_interval / 1000.0)
        .map_err(|_| Fault::Server("a publishing interval that is no time"))?;
    let sign = interval.saturating_mul(answer.revised_max_keep_alive_count.max(1));
    Ok(Subscription::new(answer.subscription_id, items, sign, config.silence, now))
}

/// Returns the number of whole intervals in a time, at least one.
fn count(time: Duration, interval: Duration) -> u32 {
    let count = time.as_millis() / interval.as_millis().max(1);
    u32::try_from(count).unwrap_or(u32::MAX).max(1)
}

/// Adds items to a subscription; those that the server refuses are told, and returned.
pub(crate) async fn add_items(
    client: &Client,
    server: &Server,
    point_states: &RefCell<PointStates>,
    id: u32,
    items: &[usize],
) -> Result<Vec<usize>, Fault> {
    let mut refused = Vec::new();
    let mut known = Vec::with_capacity(items.len());
    for &item in items {
        let address = point_states.borrow().points().items[item].node.clone();
        if let Some(moved) = server.moved(&address) {
            let (status, why) = (StatusCode::BadConfigurationError, moved.in_words());
            point_states.borrow_mut().refuse_in_words(item, status, &why);
            continue;
        }
        match address.resolve(&server.namespaces) {
            Some(node) => known.push((item, node)),
            None => {
                point_states.borrow_mut().refuse(item, StatusCode::BadNodeIdUnknown);
                refused.push(item);
            }
        }
    }
    let per_call = server.items_per_call.unwrap_or(ITEMS_PER_CALL).min(ITEMS_PER_CALL);
    for some in known.chunks(per_call) {
        let requests = some
            .iter()
            .map(|(item, node)| {
                request_of(&point_states.borrow().points().items[*item], *item, node)
            })
            .collect();
        let request = CreateMonitoredItemsRequest {
            request_header: client.header(client.limit()),
            subscription_id: id,
            timestamps_to_return: TimestampsToReturn::Source,
            items_to_create: Some(requests),
        };
        let answer = answer!(client, "adding monitored items", CreateMonitoredItems, request)?;
        let results = answer.results.unwrap_or_default();
        if results.len() != some.len() {
            return Err(Fault::Server("another number of results than of monitored items"));
        }
        for ((item, _), result) in some.iter().zip(results) {
            if result.status_code.is_bad() {
                point_states.borrow_mut().refuse(*item, result.status_code);
                refused.push(*item);
            } else {
                point_states.borrow_mut().accept(*item);
            }
        }
    }
    point_states.borrow_mut().flush();
    Ok(refused)
}

/// Has a subscription report the events of the server.
pub(crate) async fn add_events(client: &Client, id: u32) -> Result<(), Fault> {
    let request = CreateMonitoredItemsRequest {
        request_header: client.header(client.limit()),
        subscription_id: id,
        timestamps_to_return: TimestampsToReturn::Neither,
        items_to_create: Some(vec![events_item()]),
    };
    let answer = answer!(client, "asking for events", CreateMonitoredItems, request)?;
    let result = answer.results.unwrap_or_default().first().map(|result| result.status_code);
    match result {
        Some(status) if !status.is_bad() => Ok(()),
        Some(status) => Err(Fault::Refused { what: "asking for events", status }),
        None => Err(Fault::Server("no result of a monitored item")),
    }
}

fn request_of(item: &Item, handle: usize, node: &NodeId) -> MonitoredItemCreateRequest {
    let filter = |deadband_type: DeadbandType, value| {
        ExtensionObject::from_message(DataChangeFilter {
            trigger: DataChangeTrigger::StatusValue,
            deadband_type: deadband_type as u32,
            deadband_value: value,
        })
    };
    MonitoredItemCreateRequest {
        item_to_monitor: ReadValueId {
            node_id: node.clone(),
            attribute_id: AttributeId::Value as u32,
            ..ReadValueId::default()
        },
        monitoring_mode: MonitoringMode::Reporting,
        requested_parameters: MonitoringParameters {
            client_handle: u32::try_from(handle).unwrap_or(u32::MAX),
            sampling_interval: item.sampling.as_secs_f64() * 1000.0,
            filter: match item.deadband {
                Deadband::None => ExtensionObject::null(),
                Deadband::Absolute(value) => filter(DeadbandType::Absolute, value),
                Deadband::Percent(value) => filter(DeadbandType::Percent, value),
            },
            queue_size: item.queue,
            discard_oldest: true,
        },
    }
}

impl Subscription {
    /// A subscription that gives a sign of life at least once in `due`, beyond which so much
    /// `silence` is borne.
    pub(crate) fn new(
        id: u32,
        items: Range<usize>,
        due: Duration,
        silence: Duration,
        now: Instant,
    ) -> Self {
        Self {
            id,
            items,
            due,
            limit: due.saturating_add(silence),
            heard: now,
            sequence: Sequence::default(),
            epoch: 0,
            is_lossy: false,
            is_reading: false,
            next_read: now,
            doubt: None,
        }
    }

    /// Begins the doubt about notifications published no later than this, in ticks.
    pub(crate) fn begin_doubt(&mut self, published: i64) {
        let until = self.doubt.map_or(published, |doubt| doubt.until.max(published));
        self.doubt = Some(Doubt { until, left: MAX_DOUBTED });
    }

    /// Reports whether the newest of the notifications that came is doubted, by their publish
    /// time in ticks; one that is not ends the doubt.
    pub(crate) fn is_doubted(&mut self, published: i64) -> bool {
        self.doubt = self.doubt.filter(|doubt| published <= doubt.until && doubt.left > 0);
        if let Some(doubt) = &mut self.doubt {
            doubt.left -= 1;
        }
        self.doubt.is_some()
    }

    /// Tells whether it has been silent for longer than is borne.
    pub(crate) fn is_overdue(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.heard) > self.limit
    }
}

#[cfg(test)]
#[path = "subscription_tests.rs"]
mod tests;
