//! Shared view of a server, and its state for all pages.
//!
//! A thread follows the viewer; pages read what it put down and are woken when that changes.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use busbar_client::{Event, PictureState, View};
use busbar_protocol::message::{Command, Target};
use busbar_protocol::pictures;
use busbar_types::AlarmState;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tokio::sync::{broadcast, watch};

use crate::message::{AlarmCounts, FromPage, PictureCondition, ToPage};
use crate::options::Options;
use crate::picture::Picture;
use crate::steering::{PageId, Steering};

/// Size of the picture until a page says its own, pixels.
const FIRST_SIZE: [u32; 2] = [1280, 720];
/// Time without a sign of life after which the viewer's picture is dead.
const SILENT: Duration = Duration::from_millis(1000);
/// Time without a sign of life after which the viewer is started again: large pictures of a
/// software rasterizer take long.
const HUNG: Duration = Duration::from_secs(5);
/// The longest delay before a viewer that keeps ending is started again.
const LONGEST_DELAY: Duration = Duration::from_secs(5);
/// Period at which the viewer is polled without an event.
const POLL_PERIOD: Duration = Duration::from_millis(100);
/// Time without a poll after which no picture counts as live.
const MAX_UNPOLLED: Duration = Duration::from_millis(1000);
/// Replaced pictures whose last true instant is remembered. For a page with an older one, the
/// instant of the oldest counts.
const MAX_SUPERSEDED: usize = 64;
/// Events that wait for a page; one that lags by more misses the oldest.
const MAX_TOLD: usize = 256;

/// View of a server, with its state.
pub(crate) struct Hub {
    view: View,
    shown: Mutex<ViewerSnapshot>,
    steering: Mutex<Steering>,
    /// Raised with whatever a page may have to send.
    changes: watch::Sender<u64>,
    events: broadcast::Sender<ToPage>,
    /// Reports whether the viewer's queue was full at the last command.
    is_full: AtomicBool,
    /// Reason for which there never was a scene, once that is known.
    failure: watch::Sender<Option<String>>,
}

/// State of the newest picture, for a page that knows of an older one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PageState {
    /// Number of the newest picture.
    pub(crate) number: u64,
    pub(crate) condition: PictureCondition,
    /// Time since the viewer last confirmed the newest picture.
    pub(crate) age: Duration,
    /// Time since the picture that the page knows of was true; none where that is the newest.
    pub(crate) behind: Option<Duration>,
}

/// State of the viewer at the last poll.
struct ViewerSnapshot {
    picture: Arc<Picture>,
    condition: PictureCondition,
    /// Instant at which the picture was true, nanoseconds of the clock since boot, which goes on
    /// while the machine sleeps.
    true_at: u64,
    /// Instant of the last poll.
    polled_at: Instant,
    /// Pictures that were replaced: number, and the last instant at which each was true.
    superseded: VecDeque<(u64, u64)>,
    /// Reports whether there ever was a picture.
    was_ever_ready: bool,
    alarms: HashMap<String, AlarmState>,
}

impl Hub {
    /// Starts a viewer, and a thread that follows it.
    ///
    /// # Errors
    /// No descriptors or no thread left.
    pub(crate) fn start(options: &Options) -> std::io::Result<Arc<Self>> {
        let view = View::open(busbar_client::Options {
            program: options.program.clone(),
            config: options.config.clone(),
            target: Target::Offscreen,
            size: FIRST_SIZE,
            panels: options.panels,
            operator: options.operator.clone(),
            silent: SILENT,
            hung: HUNG,
            longest_delay: LONGEST_DELAY,
        })?;
        let shown = ViewerSnapshot {
            picture: Arc::default(),
            condition: PictureCondition::Starting,
            true_at: pictures::now(),
            polled_at: Instant::now(),
            superseded: VecDeque::new(),
            was_ever_ready: false,
            alarms: HashMap::new(),
        };
        let hub = Arc::new(Self {
            view,
            shown: Mutex::new(shown),
            steering: Mutex::default(),
            changes: watch::channel(0).0,
            events: broadcast::channel(MAX_TOLD).0,
            is_full: AtomicBool::new(false),
            failure: watch::channel(None).0,
        });
        // Nobody looks yet.
        hub.send_commands(vec![Command::SetVisible(false)]);
        let followed = Arc::downgrade(&hub);
        std::thread::Builder::new().name("web view".into()).spawn(move || follow(&followed))?;
        Ok(hub)
    }

    /// Returns a receiver that is woken when a page may have something to send.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Subscribes to events from now on.
    pub(crate) fn subscribe_events(&self) -> broadcast::Receiver<ToPage> {
        self.events.subscribe()
    }

    /// Returns the time since the last poll of the viewer.
    pub(crate) fn silence(&self) -> Duration {
        lock(&self.shown).polled_at.elapsed()
    }

    /// Returns the reason for which there never was a scene, once that is known.
    pub(crate) fn failure(&self) -> Option<String> {
        self.failure.borrow().clone()
    }

    /// Returns the process id of the viewer, while there is one.
    pub(crate) fn viewer(&self) -> Option<u32> {
        Some(self.view.process()).filter(|id| *id > 0)
    }

    /// Returns the newest picture that was true.
    pub(crate) fn picture(&self) -> Arc<Picture> {
        lock(&self.shown).picture.clone()
    }

    /// Returns the state of the newest picture, all of one instant; `known` is the number of the
    /// picture that the page knows of.
    pub(crate) fn page_state(&self, known: u64) -> PageState {
        let shown = lock(&self.shown);
        let condition = match shown.condition {
            PictureCondition::Live if shown.polled_at.elapsed() > MAX_UNPOLLED => {
                PictureCondition::Lost
            }
            condition => condition,
        };
        let number = shown.picture.number;
        let boot_now = pictures::now();
        let since = |then: u64| Duration::from_nanos(boot_now.saturating_sub(then));
        let behind = (known != number).then(|| {
            let replaced = shown.superseded.iter().find(|(number, _)| *number >= known);
            since(replaced.map_or(shown.true_at, |(_, true_until)| *true_until))
        });
        PageState { number, condition, age: since(shown.true_at), behind }
    }

    /// Counts alarms by their state.
    pub(crate) fn alarms(&self) -> AlarmCounts {
        AlarmCounts::count(lock(&self.shown).alarms.values().copied())
    }

    /// Adds a page to the view.
    pub(crate) fn join(&self) -> PageId {
        let (page_id, commands) = lock(&self.steering).join();
        self.send_commands(commands);
        page_id
    }

    /// Removes a page from the view.
    pub(crate) fn leave(&self, page_id: PageId) {
        let commands = lock(&self.steering).leave(page_id);
        self.send_commands(commands);
        self.wake();
    }

    /// Reports whether a page steers the view.
    pub(crate) fn is_steering(&self, page_id: PageId) -> bool {
        lock(&self.steering).is_steering(page_id)
    }

    /// Executes a page's message.
    ///
    /// # Errors
    /// In words, why not.
    pub(crate) fn act(&self, page_id: PageId, said: FromPage) -> Result<(), String> {
        let is_takeover = said == FromPage::Steer;
        let commands = lock(&self.steering).act(page_id, said)?;
        self.send_commands(commands);
        if is_takeover {
            self.wake();
        }
        Ok(())
    }

    fn send_commands(&self, commands: Vec<Command>) {
        for command in commands {
            // Input continues; the picture shows its effect.
            let is_full = self.view.command(command).is_err();
            if is_full && !self.is_full.load(Ordering::Relaxed) {
                tracing::warn!("the viewer does not keep up with what pages ask");
            }
            self.is_full.store(is_full, Ordering::Relaxed);
        }
    }

    fn wake(&self) {
        self.changes.send_modify(|count| *count = count.wrapping_add(1));
    }

    /// Polls events and the picture of the viewer.
    fn poll(&self, pixels: &mut Vec<u8>) {
        while let Some((event, _)) = self.view.next_event() {
            self.handle_event(event);
        }
        let Some(seen) = self.view.copy_frame(pixels) else {
            lock(&self.shown).polled_at = Instant::now();
            return;
        };
        let mut shown = lock(&self.shown);
        let before = shown.condition;
        let replaced = (shown.picture.number, shown.true_at);
        shown.polled_at = Instant::now();
        shown.condition = match seen.state {
            PictureState::Live => PictureCondition::Live,
            PictureState::Late => PictureCondition::Late,
            PictureState::Dead => PictureCondition::Lost,
        };
        if seen.state != PictureState::Dead {
            let age = u64::try_from(seen.age.as_nanos()).unwrap_or(u64::MAX);
            shown.true_at = pictures::now().saturating_sub(age);
        }
        let info = seen.info;
        let has_changed =
            seen.is_new && Arc::make_mut(&mut shown.picture).update(info.size, pixels, info.damage);
        if has_changed {
            if shown.superseded.len() == MAX_SUPERSEDED {
                shown.superseded.pop_front();
            }
            shown.superseded.push_back(replaced);
        }
        if has_changed || shown.condition != before {
            drop(shown);
            self.wake();
        }
    }

    fn handle_event(&self, event: Event) {
        let message = match event {
            Event::Ready { device } => {
                tracing::info!("the view is drawn by {device}");
                lock(&self.shown).was_ever_ready = true;
                return;
            }
            Event::Picked(id) => ToPage::Picked(id),
            Event::Alarm(snapshot) => {
                let alarms = &mut lock(&self.shown).alarms;
                match snapshot.state {
                    AlarmState::Normal => drop(alarms.remove(&snapshot.alarm)),
                    state => drop(alarms.insert(snapshot.alarm, state)),
                }
                // Counts are sent with beats: a storm of alarms is no storm of messages.
                return;
            }
            Event::Lost(how) => {
                tracing::warn!("the viewer is lost: {how}");
                ToPage::Lost(how)
            }
            Event::Recovered { is_another, how } => {
                tracing::info!("the viewer is back: {how}");
                if is_another {
                    // It tells them all again.
                    lock(&self.shown).alarms.clear();
                }
                return;
            }
            Event::Failed(words) => {
                if !lock(&self.shown).was_ever_ready {
                    self.failure.send_replace(Some(words.clone()));
                }
                ToPage::Refused(words)
            }
            Event::Error(words) => ToPage::Refused(words),
            _ => return,
        };
        // Nobody may be there.
        let _ = self.events.send(message);
    }
}

/// Polls the viewer at each of its events, until nobody has the hub.
fn follow(hub: &Weak<Hub>) {
    let mut pixels = Vec::new();
    while let Some(hub) = hub.upgrade() {
        hub.poll(&mut pixels);
        let timeout = Timespec { tv_sec: 0, tv_nsec: i64::from(POLL_PERIOD.subsec_nanos()) };
        let events = hub.view.has_events();
        // Interrupted is as good as awake.
        let _ = poll(&mut [PollFd::from_borrowed_fd(events, PollFlags::IN)], Some(&timeout));
    }
}

/// Locks; a thread that panicked under a lock left nothing half done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
