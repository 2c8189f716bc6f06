//! An activated session at work: publishing, signs of life, what the server refused.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::time::{Duration, Instant, SystemTime};

use async_opcua::types::{
    DataChangeNotification, EventNotificationList, ExtensionObject, NodeId, PublishRequest,
    PublishResponse, StatusChangeNotification, StatusCode, SubscriptionAcknowledgement,
};
use busbar_plugin_sdk::{Host, LogLevel};
use tokio::task::JoinSet;
use tokio::time::sleep;

use crate::board::Board;
use crate::client::{Client, answer};
use crate::conditions::{self, Event, Told, read_event};
use crate::fault::Fault;
use crate::session::{self, Server};
use crate::settings::Config;
use crate::subscription::{self, Subscription};

/// Publish requests that wait at the server at once.
const MAX_PUBLISHES: usize = 64;
/// Nodes that are looked for at once.
const NODES_PER_READ: usize = 500;
/// Acknowledgements of one publish request.
const MAX_ACKNOWLEDGED: usize = 1000;
/// How often the server is asked again for nodes that it did not know.
const ASK_AGAIN: Duration = Duration::from_secs(30);
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

/// What a session works with.
pub(crate) struct Watch {
    pub(crate) client: Rc<Client>,
    pub(crate) config: Config,
    pub(crate) board: Rc<RefCell<Board>>,
    pub(crate) server: Server,
    pub(crate) host: Host,
    pub(crate) wall_clock: fn() -> SystemTime,
    subscriptions: Vec<Subscription>,
    /// Items that the server refused, each with its subscription.
    refused: Vec<(u32, Vec<usize>)>,
    /// The subscription of events, and what its conditions are at the server; none where
    /// no tag is of a condition.
    events: Option<Events>,
    acknowledgements: Vec<SubscriptionAcknowledgement>,
    /// Publish requests that wait at the server, and how many there are to be.
    waiting: usize,
    wanted: usize,
    state: i32,
}

/// How conditions are found again.
struct Events {
    subscription: u32,
    by_node: HashMap<NodeId, usize>,
    /// By condition: whether it has a node.
    known: Vec<bool>,
    /// Whether the conditions are to be asked for anew.
    is_refresh_due: bool,
}

/// What a task found.
enum Done {
    Published(Result<Box<PublishResponse>, Fault>),
    Alive(Result<Option<i32>, Fault>),
}

/// The event loop's time.
fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

impl Watch {
    /// Subscribes to all tags.
    pub(crate) async fn begin(
        client: Rc<Client>,
        config: Config,
        board: Rc<RefCell<Board>>,
        host: Host,
        wall_clock: fn() -> SystemTime,
    ) -> Result<Self, Fault> {
        let server = session::describe(&client).await?;
        let mut watch = Self {
            client,
            config,
            board,
            server,
            host,
            wall_clock,
            subscriptions: Vec::new(),
            refused: Vec::new(),
            events: None,
            acknowledgements: Vec::new(),
            waiting: 0,
            wanted: 0,
            state: 0,
        };
        watch.subscribe().await?;
        match watch.subscribe_to_events().await {
            // The values of other tags come all the same.
            Err(Fault::Refused { what, status }) => {
                watch.board.borrow_mut().refuse_conditions(what, status);
            }
            outcome => outcome?,
        }
        watch.wanted = (watch.subscriptions.len() + 1).min(MAX_PUBLISHES);
        Ok(watch)
    }

    /// Where tags are of conditions, has the server report all their events, and the
    /// state of those that there are.
    async fn subscribe_to_events(&mut self) -> Result<(), Fault> {
        let nodes: Vec<Option<NodeId>> = {
            let board = self.board.borrow();
            let conditions = board.points().conditions.iter();
            conditions.map(|condition| condition.node.resolve(&self.server.namespaces)).collect()
        };
        let mirror = self.board.borrow().mirror().cloned();
        if nodes.is_empty() && mirror.is_none() {
            return Ok(());
        }
        let mut known = Vec::with_capacity(nodes.len());
        let ids: Vec<_> = nodes.iter().map(|node| node.clone().unwrap_or_default()).collect();
        for some in ids.chunks(NODES_PER_READ) {
            known.extend(conditions::known(&self.client, some).await?);
        }
        known.resize(nodes.len(), false);
        for condition in (0..nodes.len()).filter(|condition| !known[*condition]) {
            self.board.borrow_mut().miss_condition(condition);
        }
        let freshness = self.board.borrow().min_freshness();
        let (client, end) = (&self.client, self.board.borrow().points().items.len());
        let subscription =
            subscription::create(client, &self.config, freshness, end..end, now()).await?;
        subscription::add_events(client, subscription.id).await?;
        if let Some(mirror) = &mirror {
            mirror.begin_refresh();
        }
        conditions::refresh(client, subscription.id).await?;
        let by_node = nodes.into_iter().zip(0..).filter_map(|(node, index)| Some((node?, index)));
        self.events = Some(Events {
            subscription: subscription.id,
            by_node: by_node.collect(),
            known,
            is_refresh_due: false,
        });
        self.subscriptions.push(subscription);
        Ok(())
    }

    async fn subscribe(&mut self) -> Result<(), Fault> {
        let count = self.board.borrow().points().items.len();
        let freshness = self.board.borrow().min_freshness();
        for first in (0..count).step_by(self.config.items_per_subscription) {
            let items = first..count.min(first + self.config.items_per_subscription);
            let subscription =
                subscription::create(&self.client, &self.config, freshness, items.clone(), now())
                    .await?;
            let items: Vec<_> = items.collect();
            let (client, id) = (&self.client, subscription.id);
            let refused =
                subscription::add_items(client, &self.server, &self.board, id, &items).await?;
            if !refused.is_empty() {
                self.refused.push((id, refused));
            }
            self.subscriptions.push(subscription);
        }
        Ok(())
    }

    /// Works until the session ends.
    pub(crate) async fn run(mut self) -> Fault {
        let mut tasks = JoinSet::new();
        let sign = self.config.silence / 3;
        let mut is_asking = false;
        let (mut next_sign, mut next_try) = (now(), now() + ASK_AGAIN);
        loop {
            self.publish(&mut tasks);
            let deadline = next_sign.min(next_try).saturating_duration_since(now());
            let done = tokio::select! {
                biased;
                Some(done) = tasks.join_next() => Some(done),
                () = sleep(deadline) => None,
            };
            let outcome = match done {
                // A task ends by a panic of the library alone.
                Some(Err(_)) => Err(Fault::Panic),
                Some(Ok(Done::Alive(state))) => {
                    is_asking = false;
                    self.note_state(state)
                }
                Some(Ok(Done::Published(answer))) => {
                    self.waiting = self.waiting.saturating_sub(1);
                    self.heed(answer)
                }
                None => self.check_silence(),
            };
            if let Err(fault) = outcome {
                return fault;
            }
            if let Err(fault) = self.refresh_if_due().await {
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

    /// Keeps as many publish requests at the server as there are to be.
    fn publish(&mut self, tasks: &mut JoinSet<Done>) {
        let patience = self.subscriptions.iter().map(Subscription::limit).max();
        let limit = patience.unwrap_or(self.config.silence);
        while self.waiting < self.wanted && !self.subscriptions.is_empty() {
            let count = self.acknowledgements.len().min(MAX_ACKNOWLEDGED);
            let acknowledged: Vec<_> = self.acknowledgements.drain(..count).collect();
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

    fn note_state(&mut self, state: Result<Option<i32>, Fault>) -> Result<(), Fault> {
        let state = match state {
            Err(Fault::NoAnswer(_)) => return Err(Fault::Silent(self.config.silence)),
            state => state?.unwrap_or_default(),
        };
        if std::mem::replace(&mut self.state, state) != state {
            let name = usize::try_from(state).ok().and_then(|state| STATES.get(state));
            let name = name.copied().unwrap_or("none of the standard");
            self.host.log(LogLevel::Warning, &format!("the server's state is now: {name}"));
        }
        Ok(())
    }

    fn check_silence(&self) -> Result<(), Fault> {
        let is_overdue = self.subscriptions.iter().any(|one| one.is_overdue(now()));
        if is_overdue { Err(Fault::Silent(self.config.silence)) } else { Ok(()) }
    }

    fn heed(&mut self, answer: Result<Box<PublishResponse>, Fault>) -> Result<(), Fault> {
        let answer = match answer {
            Ok(answer) => answer,
            Err(Fault::Refused { status: StatusCode::BadTooManyPublishRequests, .. })
                if self.wanted > 1 =>
            {
                self.wanted = self.waiting.max(1);
                return Ok(());
            }
            Err(Fault::NoAnswer(_)) => return Err(Fault::Silent(self.config.silence)),
            Err(fault) => return Err(fault),
        };
        let found = self.subscriptions.iter_mut().find(|one| one.id == answer.subscription_id);
        // One of a session before this one may still speak.
        let Some(subscription) = found else { return Ok(()) };
        let message = answer.notification_message;
        if message.notification_data.as_ref().is_some_and(|data| !data.is_empty()) {
            self.acknowledgements.push(SubscriptionAcknowledgement {
                subscription_id: subscription.id,
                sequence_number: message.sequence_number,
            });
        }
        let items = subscription.items.clone();
        let is_of_events =
            self.events.as_ref().is_some_and(|events| events.subscription == subscription.id);
        let ready = subscription.take(message, now())?;
        for data in
            ready.into_iter().flat_map(|message| message.notification_data.unwrap_or_default())
        {
            self.apply(&data)?;
        }
        let mut board = self.board.borrow_mut();
        if !answer.more_notifications {
            board.confirm(items, now());
            if is_of_events {
                board.confirm_conditions(now());
            }
        }
        if is_of_events && let Some(mirror) = board.mirror() {
            mirror.confirm();
        }
        board.flush();
        Ok(())
    }

    /// Asks for all conditions anew where events may have been missed.
    async fn refresh_if_due(&mut self) -> Result<(), Fault> {
        let Some(events) = &mut self.events else { return Ok(()) };
        if !std::mem::take(&mut events.is_refresh_due) {
            return Ok(());
        }
        if let Some(mirror) = self.board.borrow().mirror() {
            mirror.begin_refresh();
        }
        conditions::refresh(&self.client, events.subscription).await
    }

    fn heed_events(&mut self, list: &EventNotificationList) {
        let Some(events) = &mut self.events else { return };
        let (now, wall) = (now(), (self.wall_clock)());
        let mut board = self.board.borrow_mut();
        for event in list.events.iter().flatten() {
            match read_event(event.event_fields.as_deref().unwrap_or_default()) {
                Event::State { condition, time, quality, fields } => {
                    if let Some(mirror) = board.mirror() {
                        let told = Told { time, quality, fields };
                        mirror.take(&self.server.namespaces, condition, &told);
                    }
                    if let Some(&condition) = events.by_node.get(condition) {
                        board.take_event(condition, (time, quality, fields), now, wall);
                    }
                }
                Event::RefreshEnd => {
                    board.end_refresh(&events.known, now, wall);
                    if let Some(mirror) = board.mirror() {
                        mirror.end_refresh();
                    }
                }
                Event::RefreshRequired => events.is_refresh_due = true,
                Event::Other => {}
            }
        }
    }

    fn apply(&mut self, data: &ExtensionObject) -> Result<(), Fault> {
        if let Some(changes) = data.inner_as::<DataChangeNotification>() {
            let (now, wall) = (now(), (self.wall_clock)());
            let mut board = self.board.borrow_mut();
            for change in changes.monitored_items.iter().flatten() {
                board.take(change.client_handle as usize, &change.value, now, wall);
            }
        } else if let Some(list) = data.inner_as::<EventNotificationList>() {
            self.heed_events(list);
        } else if let Some(change) = data.inner_as::<StatusChangeNotification>() {
            return Err(Fault::Refused { what: "the subscription ended", status: change.status });
        }
        Ok(())
    }

    /// Asks for nodes that were refused: a server may have loaded them since.
    async fn ask_again(&mut self) -> Result<(), Fault> {
        let mut refused = std::mem::take(&mut self.refused);
        for (id, items) in &mut refused {
            let (client, board) = (&self.client, &self.board);
            *items = subscription::add_items(client, &self.server, board, *id, items).await?;
        }
        refused.retain(|(_, items)| !items.is_empty());
        self.refused = refused;
        Ok(())
    }
}
