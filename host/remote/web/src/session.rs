//! Session of one page: its socket, pictures sent, messages received.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::{SinkExt, StreamExt};
use tokio::sync::{broadcast, mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::{MissedTickBehavior, interval, sleep_until, timeout};

use crate::encode;
use crate::hub::{Hub, PageState};
use crate::message::{AlarmCounts, FromPage, PictureCondition, ToPage};
use crate::pacing::{MAX_BEHIND, Pacing};
use crate::steering::PageId;

/// Period of unsolicited beats. A page that probes is answered at once; one that does not marks its
/// picture dead all the same.
const BEAT_PERIOD: Duration = Duration::from_millis(250);
/// Period of pings to a page, and its longest silence.
const PING_PERIOD: Duration = Duration::from_secs(5);
const MAX_SILENCE: Duration = Duration::from_secs(15);
/// Longest time that a message may take to leave.
const MAX_SEND: Duration = Duration::from_secs(10);
/// Messages that wait to leave: a picture, beats and events. From half of them on, beats are left
/// out and events stay with the hub. A page whose answers do not fit is ended.
const MAX_WAITING: usize = 64;
/// Burst and rate of a page's messages, a second.
const MAX_BURST: f64 = 500.0;
const MAX_RATE: f64 = 250.0;

/// Close code (RFC 6455, 7.4.2, private use) for a server without a free place.
pub(crate) const CLOSE_FULL: u16 = 4001;

/// Reason for the end of a session, as close code and words.
struct SessionEnd {
    code: u16,
    why: String,
}

struct Session {
    hub: Arc<Hub>,
    page_id: PageId,
    out: mpsc::Sender<Message>,
    pacing: Pacing,
    /// Number of the picture that the page was last woken for.
    known: u64,
    encoding: Option<JoinHandle<Option<Vec<u8>>>>,
    reported: (PictureCondition, bool),
    /// Instant of the last beat, and the number of the page's newest probe.
    beat_at: Instant,
    probe: u32,
    /// Alarm counts that were sent last.
    alarms: Option<AlarmCounts>,
    /// Number of `view` messages of the page, and its visibility.
    views: u32,
    is_visible: bool,
    allowance: f64,
    counted: Instant,
    received_at: Instant,
}

/// Serves a page until it goes, or the server does.
pub(crate) async fn run(socket: WebSocket, hub: Arc<Hub>, mut stopping: watch::Receiver<bool>) {
    let (mut sink, mut stream) = socket.split();
    let (out, mut waiting) = mpsc::channel(MAX_WAITING);
    let writer = tokio::spawn(async move {
        while let Some(message) = waiting.recv().await {
            if !matches!(timeout(MAX_SEND, sink.send(message)).await, Ok(Ok(()))) {
                return;
            }
        }
        let _ = timeout(MAX_SEND, sink.close()).await;
    });
    let (mut changes, mut events) = (hub.changes(), hub.subscribe_events());
    let mut session = Session::open(hub, out);
    let (mut beats, mut pings) = (interval(BEAT_PERIOD), interval(PING_PERIOD));
    beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let end = loop {
        let due = session.due().map(tokio::time::Instant::from_std);
        let step = tokio::select! {
            message = stream.next() => match message {
                Some(Ok(message)) => session.receive(message),
                // It went, or broke the protocol: there is nobody to tell.
                _ => break None,
            },
            encoded = encoded(&mut session.encoding) => session.send_picture(encoded),
            _ = changes.changed() => session.note_change(),
            // What a page has no room for waits with the hub, where the oldest goes first.
            event = events.recv(), if session.has_room() => match event {
                Ok(event) => session.send(&event),
                Err(broadcast::error::RecvError::Lagged(_)) => Ok(()),
                Err(broadcast::error::RecvError::Closed) => break None,
            },
            _ = beats.tick() => session.beat_if_due(),
            _ = pings.tick() => session.ping(),
            () = at(due) => Ok(()),
            _ = stopping.changed() => Err(SessionEnd {
                code: close_code::AWAY,
                why: "the server ends".into(),
            }),
        };
        if let Err(end) = step {
            break Some(end);
        }
        session.send_next();
    };
    session.close(end);
    // What waits goes, within its time.
    let _ = writer.await;
}

/// The page's next picture, once it is encoded.
async fn encoded(encoding: &mut Option<JoinHandle<Option<Vec<u8>>>>) -> Option<Vec<u8>> {
    match encoding {
        Some(handle) => handle.await.ok().flatten(),
        None => std::future::pending().await,
    }
}

async fn at(due: Option<tokio::time::Instant>) {
    match due {
        Some(due) => sleep_until(due).await,
        None => std::future::pending().await,
    }
}

impl Session {
    fn open(hub: Arc<Hub>, out: mpsc::Sender<Message>) -> Self {
        let (page_id, now) = (hub.join(), Instant::now());
        let mut session = Self {
            known: 0,
            page_id,
            out,
            pacing: Pacing::new(),
            encoding: None,
            reported: (PictureCondition::Starting, false),
            beat_at: now,
            probe: 0,
            alarms: None,
            views: 0,
            is_visible: true,
            allowance: MAX_BURST,
            counted: now,
            received_at: now,
            hub,
        };
        let steers = session.hub.is_steering(page_id);
        session.reported.1 = steers;
        // There is room for that.
        let _ = session.send(&ToPage::Steers(steers));
        let _ = session.note_change();
        session
    }

    fn send(&self, message: &ToPage) -> Result<(), SessionEnd> {
        let Ok(text) = serde_json::to_string(message) else { return Ok(()) };
        self.out.try_send(Message::Text(text.into())).map_err(|_| SessionEnd {
            code: close_code::AGAIN,
            why: "the page does not read".into(),
        })
    }

    /// Sends a beat, unless a probe was answered lately.
    fn beat_if_due(&mut self) -> Result<(), SessionEnd> {
        if self.beat_at.elapsed() < BEAT_PERIOD / 2 { Ok(()) } else { self.beat() }
    }

    /// Sends a beat: condition and age of the picture that the page shows.
    fn beat(&mut self) -> Result<(), SessionEnd> {
        let PageState { mut condition, age, .. } = self.follow_picture();
        let now = Instant::now();
        let behind = self.pacing.behind(now);
        if condition == PictureCondition::Live && behind > MAX_BEHIND {
            condition = PictureCondition::Behind;
        }
        self.reported.0 = condition;
        let age = u64::try_from(age.max(behind).as_millis()).unwrap_or(u64::MAX);
        if self.has_room() {
            self.beat_at = now;
            self.send(&ToPage::Beat(condition, age, self.views, self.probe))?;
            let alarms = self.hub.alarms();
            if self.alarms.replace(alarms) != Some(alarms) {
                self.send(&ToPage::Alarms(alarms))?;
            }
        }
        Ok(())
    }

    /// Reports whether there is room for messages that can wait; pictures always find some.
    fn has_room(&self) -> bool {
        self.out.capacity() > MAX_WAITING / 2
    }

    fn ping(&self) -> Result<(), SessionEnd> {
        if self.received_at.elapsed() > MAX_SILENCE {
            return Err(SessionEnd { code: close_code::AWAY, why: "the page is silent".into() });
        }
        // Where there is no room, something is on its way anyhow.
        let _ = self.out.try_send(Message::Ping(Bytes::new()));
        Ok(())
    }

    /// Takes note of a new picture; the state of the newest.
    fn follow_picture(&mut self) -> PageState {
        let state = self.hub.page_state(self.known);
        if let Some(behind) = state.behind {
            self.known = state.number;
            let now = Instant::now();
            // On Linux, instants reach back before the boot.
            self.pacing.note_change(now.checked_sub(behind).unwrap_or(now));
        }
        state
    }

    /// Processes a change of the hub: a new picture, condition or control.
    fn note_change(&mut self) -> Result<(), SessionEnd> {
        let PageState { condition, .. } = self.follow_picture();
        let steers = self.hub.is_steering(self.page_id);
        if std::mem::replace(&mut self.reported.1, steers) != steers {
            self.send(&ToPage::Steers(steers))?;
        }
        if (condition == PictureCondition::Live) != (self.reported.0 == PictureCondition::Live) {
            self.beat()?;
        }
        Ok(())
    }

    /// Takes what the page says.
    fn receive(&mut self, message: Message) -> Result<(), SessionEnd> {
        self.received_at = Instant::now();
        self.count()?;
        let text = match message {
            Message::Text(text) => text,
            Message::Ping(_) | Message::Pong(_) => return Ok(()),
            Message::Close(_) => {
                return Err(SessionEnd { code: close_code::NORMAL, why: String::new() });
            }
            Message::Binary(_) => {
                return Err(SessionEnd {
                    code: close_code::UNSUPPORTED,
                    why: "bytes; say JSON".into(),
                });
            }
        };
        let said = FromPage::parse(&text).map_err(|fault| SessionEnd {
            code: close_code::POLICY,
            why: format!("no message: {fault}"),
        })?;
        match said {
            FromPage::Shown(number) => {
                // One that was never sent changes nothing.
                self.pacing.note_shown(number, Instant::now());
                return Ok(());
            }
            FromPage::Probe(number) => {
                self.probe = number;
                return self.beat();
            }
            FromPage::View { visible, .. } => {
                self.views = self.views.wrapping_add(1);
                self.is_visible = visible;
            }
            _ => {}
        }
        match self.hub.act(self.page_id, said) {
            Ok(()) => Ok(()),
            Err(why) => self.send(&ToPage::Refused(why)),
        }
    }

    /// Counts a message of the page against what it may say.
    fn count(&mut self) -> Result<(), SessionEnd> {
        let passed = self.received_at.saturating_duration_since(self.counted).as_secs_f64();
        self.counted = self.received_at;
        self.allowance = (self.allowance + passed * MAX_RATE).min(MAX_BURST) - 1.0;
        if self.allowance < 0.0 {
            let why = format!("more than {MAX_RATE} messages a second");
            return Err(SessionEnd { code: close_code::POLICY, why });
        }
        Ok(())
    }

    /// Returns the instant at which there may be something to send without an event.
    fn due(&self) -> Option<Instant> {
        self.pacing.due().filter(|_| self.is_visible)
    }

    /// Begins to encode what the page lacks, if it can take it.
    fn send_next(&mut self) {
        if self.encoding.is_some() || !self.is_visible {
            return;
        }
        let (picture, now) = (self.hub.picture(), Instant::now());
        let Some(next) = self.pacing.plan(&picture, now) else { return };
        let (areas, tiles) = picture.cover(&next.tiles);
        self.pacing.note_sent(&picture, &tiles, next.format, now);
        let format = next.format;
        self.encoding = Some(tokio::task::spawn_blocking(move || {
            let message = encode::message(&picture, &areas, format);
            message.inspect_err(|error| tracing::error!("a picture is not encoded: {error}")).ok()
        }));
    }

    fn send_picture(&mut self, encoded: Option<Vec<u8>>) -> Result<(), SessionEnd> {
        self.encoding = None;
        let fault = |why: &str| SessionEnd { code: close_code::ERROR, why: why.to_owned() };
        let bytes = encoded.ok_or_else(|| fault("a picture cannot be encoded"))?;
        self.pacing.note_encoded(bytes.len(), Instant::now());
        let sent = self.out.try_send(Message::Binary(bytes.into()));
        sent.map_err(|_| fault("the page does not read"))
    }

    /// Leaves the view, and sends the reason where there is one.
    fn close(self, end: Option<SessionEnd>) {
        self.hub.leave(self.page_id);
        let Some(SessionEnd { code, why }) = end else { return };
        let _ = self.out.try_send(Message::Close(Some(CloseFrame { code, reason: cut(&why) })));
    }
}

/// Refuses a page for which there is no place.
pub(crate) async fn refuse(mut socket: WebSocket, places: usize) {
    let reason = cut(&format!("all {places} places are taken; close another page of this view"));
    let close = Message::Close(Some(CloseFrame { code: CLOSE_FULL, reason }));
    let _ = timeout(MAX_SEND, socket.send(close)).await;
    // Until it answers, or does not.
    let _ = timeout(MAX_SEND, socket.recv()).await;
}

/// Cuts a reason to the room of a closing frame (RFC 6455, 5.5).
fn cut(why: &str) -> Utf8Bytes {
    const MAX_REASON_BYTES: usize = 123;
    let mut end = why.len().min(MAX_REASON_BYTES);
    while !why.is_char_boundary(end) {
        end -= 1;
    }
    why[..end].into()
}
