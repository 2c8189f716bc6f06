//! Requests for births (Node Control/Rebirth): due edge nodes, each not too often.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::{Duration, Instant};

/// Shortest time between two requests to one edge node.
pub(super) const MIN_REQUEST_INTERVAL: Duration = Duration::from_secs(10);
/// Longest time until an edge node that does not answer is asked again.
const MAX_REPEAT_INTERVAL: Duration = Duration::from_secs(640);
/// Shortest time between requests to any, so that births do not all come at once.
const REQUEST_SPACING: Duration = Duration::from_millis(50);

/// Schedule of requests for births. A request that is wanted too early waits until it may be
/// sent; it ends with the birth alone.
pub(super) struct RebirthRequests {
    /// Instants and nodes; an entry counts only while it is its node's `due`.
    queue: BinaryHeap<Reverse<(Instant, usize)>>,
    nodes: Vec<NodeRequest>,
    last: Option<Instant>,
}

/// Requests to one edge node in this connection.
#[derive(Clone, Copy, Debug, Default)]
struct NodeRequest {
    asked: Option<Instant>,
    due: Option<Instant>,
    /// Requests since the last birth.
    repeats: u32,
}

impl RebirthRequests {
    pub(super) fn new(nodes: usize) -> Self {
        let nodes = vec![NodeRequest::default(); nodes];
        Self { queue: BinaryHeap::new(), nodes, last: None }
    }

    /// Drops all pending requests at the start of a connection.
    pub(super) fn clear(&mut self) {
        self.queue.clear();
        self.nodes.fill(NodeRequest::default());
    }

    /// Schedules a rebirth request to a node as soon as the minimum interval permits.
    pub(super) fn want(&mut self, node: usize, now: Instant) {
        let Some(request) = self.nodes.get_mut(node) else { return };
        let at = request.asked.map_or(now, |asked| now.max(asked + MIN_REQUEST_INTERVAL));
        if request.due.is_none_or(|due| at < due) {
            request.due = Some(at);
            self.queue.push(Reverse((at, node)));
        }
    }

    /// Cancels the request to a node.
    pub(super) fn settle(&mut self, node: usize) {
        if let Some(request) = self.nodes.get_mut(node) {
            (request.due, request.repeats) = (None, 0);
        }
    }

    /// Takes the next node to ask.
    pub(super) fn next(&mut self, now: Instant) -> Option<usize> {
        loop {
            if self.deadline()? > now {
                return None;
            }
            let Reverse((at, node)) = self.queue.pop()?;
            let Some(request) = self.nodes.get_mut(node).filter(|node| node.due == Some(at)) else {
                continue;
            };
            // Request or answer may be lost, and a silent node gives no cause to ask again.
            let interval = MIN_REQUEST_INTERVAL.saturating_mul(2_u32 << request.repeats.min(8));
            let again = now + interval.min(MAX_REPEAT_INTERVAL);
            request.repeats += 1;
            (request.asked, request.due) = (Some(now), Some(again));
            self.queue.push(Reverse((again, node)));
            self.last = Some(now);
            return Some(node);
        }
    }

    /// Instant at which [`RebirthRequests::next`] has something to do.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let Reverse((at, _)) = self.queue.peek()?;
        Some(self.last.map_or(*at, |last| (*at).max(last + REQUEST_SPACING)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_request_that_is_due_too_early_waits_and_is_not_forgotten() {
        let (mut requests, start) = (RebirthRequests::new(2), Instant::now());
        requests.want(1, start);
        assert_eq!(requests.next(start), Some(1));
        requests.settle(1);
        requests.want(1, start + SECOND);
        assert_eq!(requests.next(start + SECOND * 9), None);
        assert_eq!(requests.deadline(), Some(start + MIN_REQUEST_INTERVAL));
        assert_eq!(requests.next(start + MIN_REQUEST_INTERVAL), Some(1));
    }

    #[test]
    fn a_birth_ends_it_and_its_absence_repeats_it_ever_more_seldom() {
        let (mut requests, start) = (RebirthRequests::new(1), Instant::now());
        requests.want(0, start);
        let mut asked = Vec::new();
        for second in 0..3000 {
            if requests.next(start + SECOND * second).is_some() {
                asked.push(second);
            }
        }
        assert_eq!(asked, [0, 20, 60, 140, 300, 620, 1260, 1900, 2540]);
        requests.settle(0);
        assert_eq!(requests.next(start + SECOND * 9000), None);
    }

    #[test]
    fn a_thousand_nodes_are_not_asked_at_once() {
        let (mut requests, start) = (RebirthRequests::new(1000), Instant::now());
        (0..1000).for_each(|node| requests.want(node, start));
        let mut asked = vec![0; 1000];
        for tick in 0..1000 {
            if let Some(node) = requests.next(start + REQUEST_SPACING * tick) {
                asked[node] += 1;
            }
            assert_eq!(requests.next(start + REQUEST_SPACING * tick), None);
        }
        assert!(asked.iter().filter(|count| **count > 0).count() > 500);
        requests.clear();
        assert_eq!(requests.deadline(), None);
    }
}
