//! Tags of Sparkplug B (Eclipse Sparkplug 3.0, and payloads of 2.2): edge nodes, found by
//! the topics of their messages, and requests for births where the settings allow them.

mod aliases;
mod metric_value;
pub(crate) mod node;
pub(crate) mod payload;
mod requests;

use std::collections::HashMap;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{LogLevel, Reason};
use srad_types::payload::{DataType, Message, Metric, Payload as Outgoing, metric};

use self::node::{Kind, Node};
use self::payload::{Payload, PayloadFault};
use self::requests::RebirthRequests;
use crate::point_states::PointStates;
use crate::points::MetricPlace;

/// The namespace of Sparkplug B, first level of all of its topics.
pub(crate) const NAMESPACE: &str = "spBv1.0";
/// The metric that asks an edge node for its birth (Sparkplug 3.0, 6.4.24).
const REBIRTH: &str = "Node Control/Rebirth";

/// All edge nodes that tags name.
pub(crate) struct Fleet {
    nodes: Vec<Node>,
    /// By group and id.
    by_group: HashMap<String, HashMap<String, usize>>,
    requests: Option<RebirthRequests>,
}

impl Fleet {
    /// `places` are those of the points from `first` on, in their order.
    pub(crate) fn new(
        places: impl IntoIterator<Item = MetricPlace>,
        first: usize,
        requests_rebirth: bool,
    ) -> Self {
        let mut fleet = Self { nodes: Vec::new(), by_group: HashMap::new(), requests: None };
        for (index, place) in places.into_iter().enumerate() {
            let node = fleet.node(&place.group, &place.edge_node);
            fleet.nodes[node].add(place.device.as_deref(), &place.metric, first + index);
        }
        fleet.requests = requests_rebirth.then(|| RebirthRequests::new(fleet.nodes.len()));
        fleet
    }

    /// Returns the topic filters to subscribe to, two per node, in the order of the nodes.
    pub(crate) fn filters(&self) -> Vec<String> {
        let filters = |Node { group, id, .. }: &Node| {
            [format!("{NAMESPACE}/{group}/+/{id}"), format!("{NAMESPACE}/{group}/+/{id}/+")]
        };
        self.nodes.iter().flat_map(filters).collect()
    }

    /// Marks the points that the filter of this index would have brought.
    pub(crate) fn refuse(&mut self, filter: usize, point_states: &mut PointStates) {
        if let Some(node) = self.nodes.get_mut(filter / 2) {
            node.mark_all(Reason::Configuration, point_states);
        }
    }

    /// Resets the state of all edge nodes for a new connection.
    pub(crate) fn begin(&mut self) {
        for node in &mut self.nodes {
            node.begin();
        }
        if let Some(requests) = &mut self.requests {
            requests.clear();
        }
    }

    /// Requests births after a subscription, because earlier ones did not arrive.
    pub(crate) fn note_subscribed(&mut self, now: Instant) {
        for node in 0..self.nodes.len() {
            self.want_birth(node, now);
        }
    }

    /// Takes a message, or the fault of one whose payload was not taken; false if its topic
    /// is none of these edge nodes'.
    pub(crate) fn handle(
        &mut self,
        topic: &str,
        payload: Result<&[u8], PayloadFault>,
        is_retained: bool,
        now: Instant,
        point_states: &mut PointStates,
    ) -> bool {
        let mut levels = topic.split('/');
        if levels.next() != Some(NAMESPACE) {
            return false;
        }
        let (Some(group), Some(word), Some(id)) = (levels.next(), levels.next(), levels.next())
        else {
            return false;
        };
        let Some(&index) = self.by_group.get(group).and_then(|nodes| nodes.get(id)) else {
            return false;
        };
        let Some(node) = self.nodes.get_mut(index) else { return false };
        if is_retained {
            // None of these is ever retained (Sparkplug 3.0, 5.4 to 5.8), and what is comes
            // from before the subscription (MQTT 3.1.1, 3.3.1.3).
            point_states.ignored.retained += 1;
            let text = format!(
                "a retained message of '{topic}' is left out: messages of Sparkplug are never \
                 retained, so its age is unknown"
            );
            point_states.tell(LogLevel::Warning, &text);
            return true;
        }
        let (device, rest) = (levels.next(), levels.next());
        let payload = payload.and_then(Payload::parse);
        let is_birth_needed = match (kind_of(word, device), rest) {
            (Some(kind), None) => {
                let is_birth_needed = node.handle(kind, device, payload, point_states);
                if (kind, device) == (Kind::Birth, None) && !is_birth_needed {
                    self.settle_birth(index);
                }
                is_birth_needed
            }
            // Commands are for others.
            _ if ["NCMD", "DCMD"].contains(&word) => false,
            _ => {
                node.lose_all(&format!("'{topic}' is no topic of Sparkplug B"), point_states);
                true
            }
        };
        if is_birth_needed {
            self.want_birth(index, now);
        }
        true
    }

    /// Returns the next message to send: topic and payload.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        wall_clock: fn() -> SystemTime,
    ) -> Option<(String, Vec<u8>)> {
        let node = self.requests.as_mut()?.next(now)?;
        let Node { group, id, .. } = self.nodes.get(node)?;
        Some((format!("{NAMESPACE}/{group}/NCMD/{id}"), rebirth_request(wall_clock())))
    }

    /// When [`Fleet::next_request`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.requests.as_ref()?.deadline()
    }

    fn want_birth(&mut self, node: usize, now: Instant) {
        if let Some(requests) = &mut self.requests {
            requests.want(node, now);
        }
    }

    fn settle_birth(&mut self, node: usize) {
        if let Some(requests) = &mut self.requests {
            requests.settle(node);
        }
    }

    fn node(&mut self, group: &str, id: &str) -> usize {
        let nodes = self.by_group.entry(group.to_owned()).or_default();
        *nodes.entry(id.to_owned()).or_insert_with(|| {
            self.nodes.push(Node::new(group.to_owned(), id.to_owned()));
            self.nodes.len() - 1
        })
    }
}

/// Kind of a message by its topic (Sparkplug 3.0, 4.1).
fn kind_of(word: &str, device: Option<&str>) -> Option<Kind> {
    match (word, device) {
        ("NBIRTH", None) | ("DBIRTH", Some(_)) => Some(Kind::Birth),
        ("NDATA", None) | ("DDATA", Some(_)) => Some(Kind::Data),
        ("NDEATH", None) | ("DDEATH", Some(_)) => Some(Kind::Death),
        _ => None,
    }
}

/// Converts a time to milliseconds since 1970-01-01 UTC; 0 for earlier times.
pub(crate) fn millis(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

fn rebirth_request(now: SystemTime) -> Vec<u8> {
    let metric = Metric {
        name: Some(REBIRTH.into()),
        timestamp: Some(millis(now)),
        datatype: Some(DataType::Boolean as u32),
        value: Some(metric::Value::BooleanValue(true)),
        ..Metric::default()
    };
    let payload =
        Outgoing { timestamp: Some(millis(now)), metrics: vec![metric], ..Outgoing::default() };
    payload.encode_to_vec()
}

#[cfg(test)]
mod life_tests;
