//! Tags of Sparkplug B (Eclipse Sparkplug 3.0, and payloads of 2.2): edge nodes, found by
//! the topics of their messages, and requests for births where the settings allow them.

pub(crate) mod node;
pub(crate) mod payload;

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{LogLevel, Reason};
use srad_types::payload::{DataType, Message, Metric, Payload as Outgoing, metric};

use self::node::{Kind, Node};
use self::payload::Payload;
use crate::desk::Desk;
use crate::points::MetricPlace;

/// The namespace of Sparkplug B, first level of all of its topics.
pub(crate) const NAMESPACE: &str = "spBv1.0";
/// Shortest time between two requests to one edge node.
const MIN_REQUEST_INTERVAL: Duration = Duration::from_secs(10);
/// Shortest time between requests to any, so that births do not all come at once.
const REQUEST_SPACING: Duration = Duration::from_millis(50);
/// The metric that asks an edge node for its birth (Sparkplug 3.0, 6.4.24).
const REBIRTH: &str = "Node Control/Rebirth";

/// All edge nodes that tags name.
pub(crate) struct Fleet {
    nodes: Vec<Node>,
    /// By group and id.
    by_group: HashMap<String, HashMap<String, usize>>,
    requests: Option<Requests>,
}

/// Which edge nodes are to be asked for their births.
struct Requests {
    waiting: VecDeque<usize>,
    /// By node, in this connection.
    asked: Vec<Option<Instant>>,
    last: Option<Instant>,
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
        fleet.requests = requests_rebirth.then(|| Requests {
            waiting: VecDeque::new(),
            asked: vec![None; fleet.nodes.len()],
            last: None,
        });
        fleet
    }

    /// The filters to subscribe to, two a node, in order of nodes.
    pub(crate) fn filters(&self) -> Vec<String> {
        let filters = |Node { group, id, .. }: &Node| {
            [format!("{NAMESPACE}/{group}/+/{id}"), format!("{NAMESPACE}/{group}/+/{id}/+")]
        };
        self.nodes.iter().flat_map(filters).collect()
    }

    /// Marks the points that the filter of this index would have brought.
    pub(crate) fn refuse(&self, filter: usize, desk: &mut Desk) {
        if let Some(node) = self.nodes.get(filter / 2) {
            node.mark_all(Reason::Configuration, desk);
        }
    }

    /// A connection begins.
    pub(crate) fn begin(&mut self) {
        for node in &mut self.nodes {
            node.begin();
        }
        if let Some(requests) = &mut self.requests {
            requests.waiting.clear();
            requests.asked.fill(None);
        }
    }

    /// The broker brings what comes from now on: births were before, so they are asked for.
    pub(crate) fn note_subscribed(&mut self, now: Instant) {
        for node in 0..self.nodes.len() {
            self.want_birth(node, now);
        }
    }

    /// Takes a message; false if its topic is none of Sparkplug's.
    pub(crate) fn heed(
        &mut self,
        topic: &str,
        payload: &[u8],
        is_retained: bool,
        now: Instant,
        desk: &mut Desk,
    ) -> bool {
        let mut levels = topic.split('/');
        if levels.next() != Some(NAMESPACE) {
            return false;
        }
        if is_retained {
            // None of these is ever retained (Sparkplug 3.0, 5.4 to 5.8), so its age is unknown.
            desk.ignored.retained += 1;
            return true;
        }
        let (Some(group), Some(word), Some(id)) = (levels.next(), levels.next(), levels.next())
        else {
            desk.ignored.topics += 1;
            return true;
        };
        let device = levels.next();
        let node = self.by_group.get(group).and_then(|nodes| nodes.get(id)).copied();
        let (Some(node), Some(kind), None) = (node, kind_of(word, device), levels.next()) else {
            desk.ignored.topics += 1;
            return true;
        };
        let taken = Payload::parse(payload)
            .and_then(|payload| self.nodes[node].heed(kind, device, payload, desk));
        match taken {
            Ok(needs_birth) => {
                if needs_birth {
                    self.want_birth(node, now);
                }
            }
            Err(fault) => {
                desk.ignored.malformed += 1;
                desk.tell(LogLevel::Warning, &format!("'{topic}': {fault}"));
            }
        }
        true
    }

    /// The next message to send: topic and payload.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        wall_clock: fn() -> SystemTime,
    ) -> Option<(String, Vec<u8>)> {
        let requests = self.requests.as_mut()?;
        if requests.next_at().is_some_and(|next_at| now < next_at) {
            return None;
        }
        let node = requests.waiting.pop_front()?;
        requests.last = Some(now);
        if let Some(asked) = requests.asked.get_mut(node) {
            *asked = Some(now);
        }
        let Node { group, id, .. } = self.nodes.get(node)?;
        Some((format!("{NAMESPACE}/{group}/NCMD/{id}"), rebirth_request(wall_clock())))
    }

    /// When [`Fleet::next_request`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let requests = self.requests.as_ref().filter(|requests| !requests.waiting.is_empty())?;
        requests.next_at()
    }

    fn want_birth(&mut self, node: usize, now: Instant) {
        let Some(requests) = &mut self.requests else { return };
        let asked = requests.asked.get(node).copied().flatten();
        let is_recent = asked.is_some_and(|asked| now < asked + MIN_REQUEST_INTERVAL);
        if !is_recent && !requests.waiting.contains(&node) {
            requests.waiting.push_back(node);
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

impl Requests {
    /// Before then nobody is asked.
    fn next_at(&self) -> Option<Instant> {
        self.last.map(|last| last + REQUEST_SPACING)
    }
}

/// What a message is, by its topic; commands are for others.
fn kind_of(word: &str, device: Option<&str>) -> Option<Kind> {
    match (word, device) {
        ("NBIRTH", None) | ("DBIRTH", Some(_)) => Some(Kind::Birth),
        ("NDATA", None) | ("DDATA", Some(_)) => Some(Kind::Data),
        ("NDEATH", None) | ("DDEATH", Some(_)) => Some(Kind::Death),
        _ => None,
    }
}

/// Milliseconds since 1970.
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
