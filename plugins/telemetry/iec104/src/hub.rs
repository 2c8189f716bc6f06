//! The connections of a station: which of them carries data.

use std::time::{Duration, Instant, SystemTime};

use busbar_link::Endpoint;
use busbar_plugin_sdk::{Host, LinkState, LogLevel, Reason, SampleSink};
use tokio::sync::watch;

use crate::link::LinkFault;
use crate::station::Station;

/// State shared by redundant connections. At most one is active and carries data; the others are
/// kept on standby (IEC 60870-5-104, 10).
pub(crate) struct Hub {
    pub(crate) station: Station,
    sink: SampleSink,
    host: Host,
    /// State of each connection.
    links: Vec<Link>,
    active: watch::Sender<Option<usize>>,
    /// Reports whether the active connection has started data transfer.
    is_started: bool,
}

struct Link {
    endpoint: Endpoint,
    is_connected: bool,
    /// Reports whether the loss of this connection was reported, while another is active.
    is_loss_reported: bool,
}

impl Hub {
    pub(crate) fn new(
        station: Station,
        endpoints: &[Endpoint],
        sink: SampleSink,
        host: Host,
    ) -> Self {
        let link = |endpoint: &Endpoint| Link {
            endpoint: endpoint.clone(),
            is_connected: false,
            is_loss_reported: false,
        };
        let links = endpoints.iter().map(link).collect();
        let (active, _) = watch::channel(None);
        Self { station, sink, host, links, active, is_started: false }
    }

    /// Tells a connection which one is active.
    pub(crate) fn watch_active(&self) -> watch::Receiver<Option<usize>> {
        self.active.subscribe()
    }

    /// Before the first connection.
    pub(crate) fn open(&self) {
        self.station.publish_all(Reason::NotConnected);
        let endpoints: Vec<_> = self.links.iter().map(|link| link.endpoint.to_string()).collect();
        let text = format!("{}: connecting", endpoints.join(", "));
        self.sink.report_link(LinkState::Connecting, &text);
    }

    /// A connection was made.
    pub(crate) fn note_connected(&mut self, index: usize) {
        let link = &mut self.links[index];
        link.is_connected = true;
        link.is_loss_reported = false;
        if self.active.borrow().is_none() {
            self.active.send_replace(Some(index));
        }
    }

    /// Data transfer has started on a connection.
    pub(crate) fn note_started(&mut self, index: usize, started: SystemTime, now: Instant) {
        self.is_started = true;
        self.station.begin(started, now);
        let text = format!("{}: connected", self.links[index].endpoint);
        self.sink.report_link(LinkState::Up, &text);
    }

    /// A connection was lost, or could not be made.
    pub(crate) fn note_lost(&mut self, index: usize, fault: &LinkFault, retry: Duration) {
        self.links[index].is_connected = false;
        let endpoint = &self.links[index].endpoint;
        let text = format!("{endpoint}: {fault}; next try in {:.1} s", retry.as_secs_f64());
        let active = *self.active.borrow();
        if active.is_some_and(|active| active != index) {
            if !std::mem::replace(&mut self.links[index].is_loss_reported, true) {
                self.host.log(LogLevel::Warning, &text);
            }
            return;
        }
        if std::mem::take(&mut self.is_started) {
            self.station.end();
        } else {
            self.station.publish_all(Reason::Communication);
        }
        let next = self.links.iter().position(|link| link.is_connected);
        self.active.send_replace(next);
        match next {
            Some(next) => {
                let text = format!("{text}; switching over to {}", self.links[next].endpoint);
                self.sink.report_link(LinkState::Connecting, &text);
            }
            None => self.sink.report_link(LinkState::Down, &text),
        }
    }
}
