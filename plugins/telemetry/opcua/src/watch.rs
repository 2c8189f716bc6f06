//! Service loop of an activated session: publishing, keep-alives and refused items.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant, SystemTime};

use async_opcua::types::{
    DataValue, NodeId, NotificationMessage, PublishRequest, PublishResponse, StatusCode,
};
use busbar_plugin_sdk::{Host, LogLevel, SampleFlags};
use tokio::task::JoinSet;
use tokio::time::sleep;

use crate::client::{Client, answer};
use crate::conditions;
use crate::engineering_units;
use crate::fault::Fault;
use crate::namespaces::NamespaceMemory;
use crate::point_states::PointStates;
use crate::session::{self, Server};
use crate::settings::Config;
use crate::subscription;
use crate::subscriptions::{Events, Inquiry, Moment, SubscriptionSet};

/// Most publish requests that wait at the server at once.
const MAX_PUBLISHES: usize = 64;
/// Most nodes that one request looks for or reads.
const NODES_PER_READ: usize = 500;
/// Most acknowledgements of one publish request.
const MAX_ACKNOWLEDGED: usize = 1000;
/// Period in which the server is asked again for nodes that it did not know.
const ASK_AGAIN: Duration = Duration::from_secs(30);
/// Delay of an event-loop turn from which this process counts as stopped, so that waiting messages
/// may be old.
const STALLED_AFTER: Duration = Duration::from_secs(1);
/// States of a server (OPC 10000-5, 12.6).
const RUNNING: i32 = 0;
const TEST: i32 = 5;
/// The names of a server's states (OPC 10000-5, 12.6), by number.
const STATES: [&str; 8] = [
    "running",
    "failed",
    "without configuration",
    "suspended",
    "shut down",
    "a test",
    "a communication fault",
    "unknown",
];

/// Service loop of a session: its subscriptions, publish requests and reads.
pub(crate) struct Watch {
    client: Rc<Client>,
    config: Config,
    point_states: Rc<RefCell<PointStates>>,
    server: Server,
    host: Host,
    wall_clock: fn() -> SystemTime,
    subscriptions: SubscriptionSet,
    /// Items that the server refused, each with its subscription.
    refused: Vec<(u32, Vec<usize>)>,
    /// Number of publish requests that wait at the server, and number that there are to be.
    waiting: usize,
    wanted: usize,
    state: i32,
}

/// Result of a task of the session.
enum Done {
    Published(Result<Box<PublishResponse>, Fault>),
    Republished(u32, u32, Result<Option<NotificationMessage>, Fault>),
    Read(u32, u64, Vec<usize>, Result<Vec<DataValue>, Fault>),
    Alive(Result<Option<i32>, Fault>),
}

/// Returns the event loop's time.
fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

impl Watch {
    /// Subscribes to all tags of a server, whose namespaces are compared with those before.
    pub(crate) async fn begin(
        client: Rc<Client>,
        config: Config,
        point_states: Rc<RefCell<PointStates>>,
        host: Host,
        wall_clock: fn() -> SystemTime,
        (name, memory): (&str, &RefCell<NamespaceMemory>),
    ) -> Result<Self, Fault> {
        let mut server = session::describe(&client).await?;
        server.moved = memory.borrow_mut().compare(name, &server.namespaces);
        let subscriptions =
            SubscriptionSet::new(Rc::clone(&point_states), server.namespaces.clone());
        let mut watch = Self {
            client,
            config,
            point_states,
            server,
            host,
            wall_clock,
            subscriptions,
            refused: Vec::new(),
            waiting: 0,
            wanted: 0,
            state: RUNNING,
        };
        watch.note_state(watch.server.state);
        watch.subscribe().await?;
        match watch.subscribe_to_events().await {
            // The values of other tags come all the same.
            Err(Fault::Refused { what, status }) => {
                watch.point_states.borrow_mut().refuse_conditions(what, status);
            }
            outcome => outcome?,
        }
        watch.wanted = (watch.subscriptions.len() + 1).min(MAX_PUBLISHES);
        watch.subscriptions.begin(now());
        Ok(watch)
    }

    /// Namespaces by whose index tags are addressed and which are others than before, in
    /// words.
    pub(crate) fn moved_namespaces(&self) -> Vec<String> {
        let point_states = self.point_states.borrow();
        let points = point_states.points();
        let items = points.items.iter().map(|item| &item.node);
        let conditions = points.conditions.iter().map(|condition| &condition.node);
        let used: Vec<_> = items.chain(conditions).filter_map(|node| node.bare_index()).collect();
        let moved = self.server.moved.iter().filter(|moved| used.contains(&moved.index));
        moved.map(|moved| moved.in_words()).collect()
    }

    /// Subscribes to the events of all conditions and refreshes them, where tags or the alarm
    /// mirror need them.
    async fn subscribe_to_events(&mut self) -> Result<(), Fault> {
        let addresses: Vec<_> = {
            let point_states = self.point_states.borrow();
            point_states
                .points()
                .conditions
                .iter()
                .map(|condition| condition.node.clone())
                .collect()
        };
        let mirror = self.point_states.borrow().mirror().cloned();
        if addresses.is_empty() && mirror.is_none() {
            return Ok(());
        }
        let nodes: Vec<Option<NodeId>> = addresses
            .iter()
            .map(|address| match self.server.moved(address) {
                Some(_) => None,
                None => address.resolve(&self.server.namespaces),
            })
            .collect();
        let mut known = Vec::with_capacity(nodes.len());
        let ids: Vec<_> = nodes.iter().map(|node| node.clone().unwrap_or_default()).collect();
        for some in ids.chunks(NODES_PER_READ) {
            known.extend(conditions::known(&self.client, some).await?);
        }
        known.resize(nodes.len(), false);
        for condition in (0..nodes.len()).filter(|condition| !known[*condition]) {
            let moved = self.server.moved(&addresses[condition]);
            let why = moved.map_or("the server has none".into(), |moved| moved.in_words());
            self.point_states.borrow_mut().miss_condition(condition, &why);
        }
        let freshness = self.point_states.borrow().min_freshness();
        let (client, end) = (&self.client, self.point_states.borrow().points().items.len());
        let subscription =
            subscription::create(client, &self.config, freshness, end..end, now()).await?;
        subscription::add_events(client, subscription.id).await?;
        if let Some(mirror) = &mirror {
            mirror.begin_refresh();
        }
        conditions::refresh(client, subscription.id).await?;
        let by_node = nodes.into_iter().zip(0..).filter_map(|(node, index)| Some((node?, index)));
        let events = Events::new(subscription.id, by_node.collect(), known, now());
        self.subscriptions.events = Some(events);
        self.subscriptions.add(subscription);
        Ok(())
    }

    async fn subscribe(&mut self) -> Result<(), Fault> {
        let count = self.point_states.borrow().points().items.len();
        let freshness = self.point_states.borrow().min_freshness();
        let mut slowest = Duration::ZERO;
        for first in (0..count).step_by(self.config.items_per_subscription) {
            let items = first..count.min(first + self.config.items_per_subscription);
            let subscription =
                subscription::create(&self.client, &self.config, freshness, items.clone(), now())
                    .await?;
            slowest = slowest.max(subscription.due);
            let items: Vec<_> = items.collect();
            let (client, id) = (&self.client, subscription.id);
            self.read_units(&items).await?;
            let refused =
                subscription::add_items(client, &self.server, &self.point_states, id, &items)
                    .await?;
            if !refused.is_empty() {
                self.refused.push((id, refused));
            }
            self.subscriptions.add(subscription);
        }
        if freshness.is_some_and(|freshness| slowest > freshness) {
            self.host.log(
                LogLevel::Warning,
                &format!(
                    "the server gives a sign of life every {} ms only: values that do not change \
                     go stale by a freshness below that",
                    slowest.as_millis()
                ),
            );
        }
        Ok(())
    }

    /// Reads the units of items before their values.
    async fn read_units(&self, items: &[usize]) -> Result<(), Fault> {
        let Self { client, server, point_states, .. } = self;
        engineering_units::read(client, server, point_states, items, self.nodes_per_read()).await
    }

    fn nodes_per_read(&self) -> usize {
        self.server.nodes_per_read.unwrap_or(NODES_PER_READ).min(NODES_PER_READ)
    }

    /// Works until the session ends.
    pub(crate) async fn run(mut self) -> Fault {
        let mut tasks = JoinSet::new();
        let sign = self.config.silence / 3;
        let mut is_asking = false;
        let (mut next_sign, mut next_try) = (now(), now() + ASK_AGAIN);
        loop {
            self.publish(&mut tasks);
            let began = now();
            let inquiry = self.subscriptions.next_inquiry().unwrap_or(next_try);
            let deadline = next_sign.min(next_try).min(inquiry).saturating_duration_since(began);
            let done = tokio::select! {
                biased;
                Some(done) = tasks.join_next() => Some(done),
                () = sleep(deadline) => None,
            };
            if now().saturating_duration_since(began) > deadline + STALLED_AFTER {
                self.host.log(LogLevel::Warning, "stopped for a while: values are read anew");
                self.subscriptions.lose_all();
            }
            let outcome = match done {
                // A task ends by a panic of the library alone.
                Some(Err(_)) => Err(Fault::Panic),
                Some(Ok(Done::Alive(state))) => {
                    is_asking = false;
                    self.take_state(state)
                }
                Some(Ok(done)) => self.take(done),
                None => self.subscriptions.check_silence(now()),
            };
            if let Err(fault) = outcome {
                return fault;
            }
            if let Err(fault) = self.inquire(&mut tasks).await {
                return fault;
            }
            if now() >= next_sign {
                next_sign = now() + sign;
                if !std::mem::replace(&mut is_asking, true) {
                    self.ask_for_state(&mut tasks, sign * 2);
                }
            }
            if now() >= next_try {
                next_try = now() + ASK_AGAIN;
                if let Err(fault) = self.ask_again().await {
                    return fault;
                }
            }
        }
    }

    fn moment(&self) -> Moment {
        Moment { now: now(), wall: (self.wall_clock)() }
    }

    /// Keeps as many publish requests at the server as there are to be.
    fn publish(&mut self, tasks: &mut JoinSet<Done>) {
        // Each waits for its turn: the server answers one a sign of life.
        let patience = self.subscriptions.limit().unwrap_or(self.config.silence);
        let turns = u32::try_from(self.wanted).unwrap_or(u32::MAX).saturating_add(1);
        let limit = patience.saturating_mul(turns);
        while self.waiting < self.wanted && self.subscriptions.len() > 0 {
            let acknowledged = self.subscriptions.take_acknowledgements(MAX_ACKNOWLEDGED);
            let client = Rc::clone(&self.client);
            tasks.spawn_local(async move {
                let request = PublishRequest {
                    request_header: client.header(limit),
                    subscription_acknowledgements: Some(acknowledged),
                };
                Done::Published(
                    answer!(client, "publishing", Publish, request, limit).map(Box::new),
                )
            });
            self.waiting += 1;
        }
    }

    fn ask_for_state(&self, tasks: &mut JoinSet<Done>, limit: Duration) {
        let client = Rc::clone(&self.client);
        tasks.spawn_local(async move { Done::Alive(session::server_state(&client, limit).await) });
    }

    fn take_state(&mut self, state: Result<Option<i32>, Fault>) -> Result<(), Fault> {
        match state {
            Err(Fault::NoAnswer(_)) => Err(Fault::Silent(self.config.silence)),
            state => {
                self.note_state(state?);
                Ok(())
            }
        }
    }

    /// Notes the state of the server, where it has one. Only the states running and test serve
    /// trustworthy values.
    fn note_state(&mut self, state: Option<i32>) {
        let Some(state) = state else { return };
        if std::mem::replace(&mut self.state, state) == state {
            return;
        }
        let name = usize::try_from(state).ok().and_then(|state| STATES.get(state));
        let name = name.copied().unwrap_or("none of the standard");
        self.host.log(LogLevel::Warning, &format!("the server's state is now: {name}"));
        let origin = if state == TEST { SampleFlags::TEST } else { SampleFlags::LIVE };
        let Moment { now, wall } = self.moment();
        let mut point_states = self.point_states.borrow_mut();
        point_states.set_server(![RUNNING, TEST].contains(&state), origin, now, wall);
        point_states.flush();
    }

    fn take(&mut self, done: Done) -> Result<(), Fault> {
        let at = self.moment();
        match done {
            Done::Published(answer) => {
                self.waiting = self.waiting.saturating_sub(1);
                match answer {
                    Ok(answer) => self.subscriptions.take(*answer, at),
                    Err(Fault::Refused {
                        status: StatusCode::BadTooManyPublishRequests, ..
                    }) if self.wanted > 1 => {
                        self.wanted = self.waiting.max(1);
                        Ok(())
                    }
                    Err(fault) => Err(self.silent(fault)),
                }
            }
            Done::Republished(subscription, number, message) => {
                let message = message.map_err(|fault| self.silent(fault))?;
                self.subscriptions.take_republished(subscription, number, message, at)
            }
            Done::Read(subscription, epoch, items, values) => {
                let values = values.map_err(|fault| self.silent(fault))?;
                let values = items.into_iter().zip(values);
                self.subscriptions.take_read(subscription, epoch, values, at);
                Ok(())
            }
            Done::Alive(state) => self.take_state(state),
        }
    }

    fn silent(&self, fault: Fault) -> Fault {
        match fault {
            Fault::NoAnswer(_) => Fault::Silent(self.config.silence),
            fault => fault,
        }
    }

    /// Sends the requests for what is missing: Republish and Read.
    async fn inquire(&mut self, tasks: &mut JoinSet<Done>) -> Result<(), Fault> {
        for inquiry in self.subscriptions.inquire(now()) {
            let client = Rc::clone(&self.client);
            match inquiry {
                Inquiry::Republish { subscription, number } => {
                    tasks.spawn_local(async move {
                        let message = session::republish(&client, subscription, number).await;
                        Done::Republished(subscription, number, message)
                    });
                }
                Inquiry::Read { subscription, epoch, items } => {
                    let (items, nodes): (Vec<_>, Vec<_>) = {
                        let point_states = self.point_states.borrow();
                        let node = |item: usize| {
                            let address = &point_states.points().items.get(item)?.node;
                            Some((item, address.resolve(&self.server.namespaces)?))
                        };
                        items.into_iter().filter_map(node).unzip()
                    };
                    let per_read = self.nodes_per_read();
                    tasks.spawn_local(async move {
                        let values = session::read_values(&client, &nodes, per_read).await;
                        Done::Read(subscription, epoch, items, values)
                    });
                }
                Inquiry::Refresh => {
                    let events = self.subscriptions.events.as_ref();
                    if let Some(id) = events.map(|events| events.subscription) {
                        conditions::refresh(&client, id).await?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Asks for nodes that were refused: a server may have loaded them since.
    async fn ask_again(&mut self) -> Result<(), Fault> {
        let mut refused = std::mem::take(&mut self.refused);
        for (id, items) in &mut refused {
            self.read_units(items).await?;
            let (client, point_states) = (&self.client, &self.point_states);
            *items =
                subscription::add_items(client, &self.server, point_states, *id, items).await?;
        }
        refused.retain(|(_, items)| !items.is_empty());
        self.refused = refused;
        Ok(())
    }
}
