//! Delivery on a thread of its own: the dispatcher is followed, and each server has a lane, so that
//! one that hangs keeps no other from its messages.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_link::{Backoff, IoLoop, ReconnectBounds};
use busbar_plugin_sdk::{
    Error, Host, LinkState, LogLevel, MAX_NOTIFY_MESSAGE, NotificationBatch, NotificationReport,
    Worker,
};
use tokio::sync::Notify as Wake;

use crate::dispatcher::{Dispatcher, Message};
use crate::mail::MailSender;
use crate::outcome::Outcome;
use crate::settings::{Config, Target};
use crate::store::Store;
use crate::webhook::WebhookSender;

/// Period at which delays, repetitions and limits are looked at.
const TICK: Duration = Duration::from_millis(500);
/// Delays between tries of a server that fails.
const RETRY: ReconnectBounds =
    ReconnectBounds { min: Duration::from_secs(2), max: Duration::from_secs(300) };
/// Faults that a report names; further ones are counted.
const MAX_NAMED_FAULTS: usize = 3;
/// Name lookups at the same time.
const MAX_LOOKUPS: usize = 4;

/// Delivery that runs until it is dropped.
pub(crate) struct Delivery {
    shared: Arc<Shared>,
    _worker: Worker,
}

/// State shared between the host's calls and the thread.
#[derive(Default)]
struct Shared {
    exchange: Mutex<Exchange>,
    wake: Wake,
}

#[derive(Default)]
struct Exchange {
    /// Batch that was handed over last. The host repeats what is not taken, so that the last one
    /// has all that is missing.
    batch: Option<NotificationBatch>,
    run: u64,
    taken: u64,
    health: Health,
}

/// Health of delivery as the report says it.
#[derive(Clone, Debug, Default)]
struct Health {
    is_down: bool,
    delivered: u64,
    message: String,
    waiting: u64,
    undelivered: u64,
}

/// Server with its sender.
enum Lane {
    Mail(MailSender),
    Webhook(String, WebhookSender),
}

/// State of the thread.
struct Core {
    config: Config,
    host: Host,
    store: Option<Store>,
    dispatcher: Dispatcher,
    clock: WallClock,
    /// Present faults by the address or server that they are of.
    faults: BTreeMap<String, String>,
    store_fault: Option<String>,
    delivered: u64,
    shared: Arc<Shared>,
    wakes: Vec<Arc<Wake>>,
}

/// Wall clock that does not jump while the thread runs.
struct WallClock {
    start: u64,
    began: Instant,
}

impl WallClock {
    fn new() -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { start: since.as_millis() as u64, began: Instant::now() }
    }

    /// Returns the time in milliseconds since 1970.
    fn now(&self) -> u64 {
        self.start.saturating_add(self.began.elapsed().as_millis() as u64)
    }
}

impl Shared {
    fn exchange(&self) -> MutexGuard<'_, Exchange> {
        self.exchange.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Delivery {
    /// Opens the state file, loads certificates, and starts the thread.
    ///
    /// # Errors
    /// [`Error::settings`] with the file at fault; [`Error::failed`] where the state file is used by
    /// another instance, or cannot be written.
    pub(crate) fn start(config: &Config, host: &Host) -> Result<Self, Error> {
        let mut lanes = Vec::new();
        if let Some(mail) = &config.mail {
            lanes.push(Lane::Mail(MailSender::new(mail, config.timeout)?));
        }
        for (name, webhook) in &config.webhooks {
            let sender = WebhookSender::new(name, webhook, config.timeout)?;
            lanes.push(Lane::Webhook(name.clone(), sender));
        }
        let opened = config.state_file.as_deref().map(Store::open).transpose();
        let (store, state) = match opened.map_err(Error::failed)? {
            None => (None, None),
            Some((store, state, fault)) => {
                fault.iter().for_each(|fault| host.log(LogLevel::Error, fault));
                (Some(store), state)
            }
        };
        let mut dispatcher = state.unwrap_or_else(|| Dispatcher::new(fastrand::u64(..)));
        let dropped = dispatcher.drop_unknown_targets(config);
        if dropped > 0 {
            let text = format!("{dropped} messages that waited are to addresses that are gone");
            host.log(LogLevel::Warning, &text);
        }
        let shared = Arc::new(Shared::default());
        let io_loop = IoLoop::new(MAX_LOOKUPS)
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let (theirs, config, own_host) = (Arc::clone(&shared), config.clone(), host.clone());
        let worker = Worker::start(host, "notifier", move |running| {
            let core = Core {
                config,
                host: own_host,
                store,
                dispatcher,
                clock: WallClock::new(),
                faults: BTreeMap::new(),
                store_fault: None,
                delivered: 0,
                shared: Arc::clone(&theirs),
                wakes: Vec::new(),
            };
            io_loop.run_until(running.stopped(), run(core, lanes));
        })?;
        Ok(Self { shared, _worker: worker })
    }

    /// Hands a batch to the thread, and returns what was taken and how delivery goes.
    pub(crate) fn exchange(&self, batch: NotificationBatch) -> NotificationReport {
        let mut exchange = self.shared.exchange();
        let taken = if exchange.run == batch.run { exchange.taken } else { 0 };
        let Health { is_down, delivered, message, waiting, undelivered } = exchange.health.clone();
        exchange.batch = Some(batch);
        drop(exchange);
        self.shared.wake.notify_one();
        let delivery = match (is_down, delivered) {
            (true, _) => LinkState::Down,
            (false, 0) => LinkState::Connecting,
            (false, _) => LinkState::Up,
        };
        NotificationReport { taken, delivery, message, waiting, undelivered }
    }
}

/// Follows the dispatcher until the thread ends.
async fn run(mut core: Core, lanes: Vec<Lane>) {
    let shared = Arc::clone(&core.shared);
    core.wakes = lanes.iter().map(|_| Arc::new(Wake::new())).collect();
    let wakes = core.wakes.clone();
    let core = Rc::new(RefCell::new(core));
    for (lane, wake) in lanes.into_iter().zip(wakes) {
        tokio::task::spawn_local(serve(Rc::clone(&core), lane, wake));
    }
    loop {
        core.borrow_mut().step();
        tokio::select! {
            () = shared.wake.notified() => {}
            () = tokio::time::sleep(TICK) => {}
        }
    }
}

/// Hands over the messages of one server, one after another.
async fn serve(core: Rc<RefCell<Core>>, lane: Lane, wake: Arc<Wake>) {
    let mut backoff = Backoff::new(RETRY);
    loop {
        let message = core.borrow_mut().dispatcher.begin(|target| lane.serves(target));
        let Some(message) = message else {
            wake.notified().await;
            continue;
        };
        let outcome = lane.send(&message).await;
        let has_failed = matches!(outcome, Outcome::Failed(_));
        core.borrow_mut().finish(&lane, &message, outcome);
        if has_failed {
            tokio::time::sleep(backoff.next_delay()).await;
        } else {
            backoff.reset();
        }
    }
}

impl Lane {
    fn serves(&self, target: &Target) -> bool {
        match (self, target) {
            (Self::Mail(_), Target::Mail(_)) => true,
            (Self::Webhook(own, _), Target::Webhook(name)) => own == name,
            _ => false,
        }
    }

    /// Returns the label of faults of the server itself.
    fn label(&self) -> String {
        match self {
            Self::Mail(_) => "mail server".to_owned(),
            Self::Webhook(name, _) => Target::Webhook(name.clone()).to_string(),
        }
    }

    async fn send(&self, message: &Message) -> Outcome {
        match (self, &message.target) {
            (Self::Mail(sender), Target::Mail(address)) => sender.send(message, address).await,
            (Self::Webhook(_, sender), _) => sender.send(message).await,
            (Self::Mail(_), Target::Webhook(_)) => {
                Outcome::Refused("a message is in the wrong lane".to_owned())
            }
        }
    }
}

impl Core {
    /// Takes over what the host has handed over, and makes the messages that are due.
    fn step(&mut self) {
        let (batch, now) = (self.shared.exchange().batch.take(), self.clock.now());
        let run = batch.as_ref().map(|batch| batch.run);
        let mut has_changed =
            batch.is_some_and(|batch| self.dispatcher.take(&batch, &self.config, now));
        has_changed |= self.dispatcher.plan(&self.config, now);
        if has_changed {
            // On the disk before anybody is told, and before the host forgets it.
            self.save();
            self.wakes.iter().for_each(|wake| wake.notify_one());
        }
        self.publish(run);
    }

    fn finish(&mut self, lane: &Lane, message: &Message, outcome: Outcome) {
        let Message { key, recipient, target, .. } = message;
        let address = target.to_string();
        match outcome {
            Outcome::Delivered => {
                self.dispatcher.delivered(key);
                self.delivered += 1;
                self.faults.remove(&address);
                self.faults.remove(&lane.label());
            }
            Outcome::Refused(words) => {
                self.dispatcher.give_up(key);
                // The server answers: only this address is at fault.
                self.faults.remove(&lane.label());
                let words = format!("{words} (a message to {recipient} is given up)");
                self.note_fault(address, words);
            }
            Outcome::Failed(words) => {
                let now = self.clock.now();
                if self.dispatcher.failed(key, &self.config, now) {
                    let hours = self.config.give_up.as_secs() / 3_600;
                    let text = format!("a message to {recipient} is given up after {hours} h");
                    self.host.log(LogLevel::Error, &text);
                }
                self.note_fault(lane.label(), words);
            }
        }
        self.save();
        self.publish(None);
    }

    /// Notes a fault; a new one is logged.
    fn note_fault(&mut self, label: String, words: String) {
        if self.faults.get(&label) != Some(&words) {
            self.host.log(LogLevel::Error, &words);
            self.faults.insert(label, words);
        }
    }

    fn save(&mut self) {
        let Some(store) = &self.store else { return };
        match store.write(&self.dispatcher) {
            Ok(()) => self.store_fault = None,
            Err(fault) => {
                if self.store_fault.as_ref() != Some(&fault) {
                    self.host.log(LogLevel::Error, &fault);
                }
                self.store_fault = Some(fault);
            }
        }
    }

    /// Puts the report where the host's next call finds it.
    fn publish(&self, run: Option<u64>) {
        let mut exchange = self.shared.exchange();
        if let Some(run) = run {
            (exchange.run, exchange.taken) = (run, self.dispatcher.taken(run));
        }
        exchange.health = Health {
            is_down: !self.faults.is_empty() || self.store_fault.is_some(),
            delivered: self.delivered,
            message: self.message(),
            waiting: self.dispatcher.waiting() as u64,
            undelivered: self.dispatcher.undelivered(),
        };
    }

    fn message(&self) -> String {
        let faults = self.store_fault.iter().chain(self.faults.values());
        let mut parts: Vec<String> = faults.clone().take(MAX_NAMED_FAULTS).cloned().collect();
        let more = faults.count().saturating_sub(MAX_NAMED_FAULTS);
        if more > 0 {
            parts.push(format!("{more} more faults are in the log"));
        }
        let (waiting, undelivered) = (self.dispatcher.waiting(), self.dispatcher.undelivered());
        for (count, what) in [
            (waiting as u64, "messages wait"),
            (undelivered, "messages reached nobody"),
            (self.delivered, "messages delivered"),
        ] {
            if count > 0 {
                parts.push(format!("{count} {what}"));
            }
        }
        if parts.is_empty() {
            parts.push("nothing was to be told yet".to_owned());
        }
        let text: String = parts.join(" · ").chars().filter(|c| !c.is_control()).collect();
        text[..text.floor_char_boundary(MAX_NOTIFY_MESSAGE)].to_owned()
    }
}
