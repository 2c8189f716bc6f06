//! One connection: sockets around a [`Session`], for ever.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use busbar_link::{Backoff, ByteStream, ConnectError, Dial, Endpoint, describe_io_error};
use thiserror::Error;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{sleep, sleep_until, timeout};

use crate::apci_session::{Event, Session, SessionFault};
use crate::hub::Hub;
use crate::settings::Config;

/// Bytes that are read at once.
const CHUNK_BYTES: usize = 16 * 1024;
/// A connection that held so long deserves a quick second try.
const STABLE_AFTER: Duration = Duration::from_secs(10);

/// Reason for which a connection ended, or was not made.
#[derive(Debug, Error)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(#[from] ConnectError),
    #[error("{0}")]
    Session(#[from] SessionFault),
    #[error("the station took no data for {} ms (t1)", .0.as_millis())]
    Blocked(Duration),
    #[error("{0}")]
    Lost(String),
}

/// Clock and connector of connections; simulated time has its own.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) dial: Arc<dyn Dial>,
    pub(crate) wall_clock: fn() -> SystemTime,
}

/// The event loop's time.
fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// One of a station's connections.
pub(crate) struct Link {
    pub(crate) hub: Rc<RefCell<Hub>>,
    pub(crate) index: usize,
    pub(crate) endpoint: Endpoint,
    pub(crate) config: Config,
    pub(crate) world: World,
}

impl Link {
    /// Serves for ever; drop the future to end it.
    pub(crate) async fn run(self) -> Infallible {
        let mut backoff = Backoff::new(self.config.reconnect);
        loop {
            let started = now();
            let Err(fault) = self.serve().await;
            if now() - started >= STABLE_AFTER {
                backoff.reset();
            }
            let delay = backoff.next_delay();
            self.hub.borrow_mut().note_lost(self.index, &fault, delay);
            sleep(delay).await;
        }
    }

    async fn serve(&self) -> Result<Infallible, LinkFault> {
        let limit = self.config.connect_timeout;
        let stream = self.world.dial.dial(&self.endpoint, limit).await?;
        self.hub.borrow_mut().note_connected(self.index);
        self.converse(stream).await
    }

    async fn converse(&self, mut stream: Box<dyn ByteStream>) -> Result<Infallible, LinkFault> {
        let mut active = self.hub.borrow().watch_active();
        let mut session = Session::new(self.config.parameters, now());
        let mut chunk = vec![0; CHUNK_BYTES];
        loop {
            let is_active = *active.borrow_and_update() == Some(self.index);
            self.advance(&mut session, is_active)?;
            self.write(&mut stream, session.take_output()).await?;
            let deadline = self.deadline(&session, is_active);
            // In this order, so that simulated time repeats itself; whatever comes first,
            // `advance` follows it.
            tokio::select! {
                biased;
                read = stream.read(&mut chunk) => {
                    let count = read.map_err(|error| LinkFault::Lost(describe_io_error(&error)))?;
                    self.receive(&mut session, chunk.get(..count).unwrap_or_default())?;
                }
                () = sleep_until(deadline.into()) => {}
                // The hub outlives its connections, so this never fails.
                _ = active.changed() => {}
            }
        }
    }

    /// Does what is due.
    fn advance(&self, session: &mut Session, is_active: bool) -> Result<(), LinkFault> {
        let now = now();
        session.tick(now)?;
        if is_active {
            session.start(now);
        }
        if is_active && session.is_started() {
            let mut hub = self.hub.borrow_mut();
            while let Some(asdu) = hub.station.next_request(now, self.world.wall_clock) {
                session.send(asdu, now)?;
            }
        }
        Ok(())
    }

    fn deadline(&self, session: &Session, is_active: bool) -> Instant {
        let of_session = session.deadline();
        let of_station = if is_active { self.hub.borrow().station.deadline() } else { None };
        of_station.map_or(of_session, |deadline| deadline.min(of_session))
    }

    fn receive(&self, session: &mut Session, bytes: &[u8]) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Err(LinkFault::Lost("the station closed the connection".into()));
        }
        let (now, received) = (now(), (self.world.wall_clock)());
        let mut hub = self.hub.borrow_mut();
        let outcome = session.receive(bytes, now, |event| match event {
            Event::Started => hub.note_started(self.index, received, now),
            Event::Asdu(asdu) => hub.station.handle_answer(asdu, received, now),
        });
        hub.station.flush();
        Ok(outcome?)
    }

    async fn write(
        &self,
        stream: &mut Box<dyn ByteStream>,
        bytes: Vec<u8>,
    ) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Ok(());
        }
        let limit = self.config.parameters.t1;
        let written = async {
            stream.write_all(&bytes).await?;
            stream.flush().await
        };
        timeout(limit, written)
            .await
            .map_err(|_| LinkFault::Blocked(limit))?
            .map_err(|error| LinkFault::Lost(describe_io_error(&error)))
    }
}
