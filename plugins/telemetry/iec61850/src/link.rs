//! The connection to a server: sockets around a [`Session`], for ever.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_link::{Backoff, ByteStream, ConnectError, Dial, Endpoint, describe_io_error};
use busbar_plugin_sdk::{Error, LinkState, Reason, SampleSink};
use thiserror::Error;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{sleep, sleep_until, timeout};

use crate::server::{Job, Server};
use crate::service::Request;
use crate::session::{Event, Parameters, Session, SessionFault};
use crate::settings::Config;

/// Bytes that are read at once.
pub(crate) const CHUNK_BYTES: usize = 16 * 1024;
/// A connection that held so long deserves a quick second try.
const STABLE_AFTER: Duration = Duration::from_secs(10);

/// Reason for which a connection ended, or was not made.
#[derive(Debug, Error)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(#[from] ConnectError),
    #[error("{0}")]
    Session(#[from] SessionFault),
    #[error("the server took no data for {} ms", .0.as_millis())]
    Blocked(Duration),
    #[error("{0}")]
    Lost(String),
    #[error("{0}: all of it is asked anew")]
    Changed(String),
    #[error("password: {}", .0.message())]
    Password(Error),
}

/// The event loop's time.
pub(crate) fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// The ways to a server, one of which is in use at a time.
pub(crate) struct Link {
    pub(crate) server: Server,
    pub(crate) config: Config,
    pub(crate) sink: SampleSink,
    pub(crate) dial: Arc<dyn Dial>,
}

impl Link {
    /// Serves for ever; drop the future to end it.
    pub(crate) async fn run(mut self) -> Infallible {
        self.server.end(Reason::NotConnected);
        let endpoints = self.config.endpoints.clone();
        let names: Vec<_> = endpoints.iter().map(Endpoint::to_string).collect();
        self.sink.report_link(LinkState::Connecting, &format!("{}: connecting", names.join(", ")));
        let mut backoff = Backoff::new(self.config.reconnect);
        for endpoint in endpoints.iter().cycle() {
            let started = now();
            let Err(fault) = self.serve(endpoint).await;
            if now() - started >= STABLE_AFTER {
                backoff.reset();
            }
            let delay = backoff.next_delay();
            self.server.end(Reason::Communication);
            let text = format!("{endpoint}: {fault}; next try in {:.1} s", delay.as_secs_f64());
            self.sink.report_link(LinkState::Down, &text);
            sleep(delay).await;
        }
        // There is at least one endpoint, so the cycle never ends.
        std::future::pending().await
    }

    async fn serve(&mut self, endpoint: &Endpoint) -> Result<Infallible, LinkFault> {
        let parameters = parameters(&self.config)?;
        let stream = self.dial.dial(endpoint, self.config.connect_timeout).await?;
        let key = fastrand::u16(..);
        self.converse(endpoint, stream, Session::new(&parameters, key, now())).await
    }

    async fn converse(
        &mut self,
        endpoint: &Endpoint,
        mut stream: Box<dyn ByteStream>,
        mut session: Session<Job>,
    ) -> Result<Infallible, LinkFault> {
        session.start(now())?;
        let mut chunk = vec![0; CHUNK_BYTES];
        loop {
            self.advance(&mut session, now())?;
            send(&mut stream, session.take_output(), self.config.timeout).await?;
            let deadline = self.deadline(&session);
            // In this order, so that simulated time repeats itself.
            tokio::select! {
                biased;
                read = stream.read(&mut chunk) => {
                    let count = read.map_err(|error| LinkFault::Lost(describe_io_error(&error)))?;
                    let bytes = chunk.get(..count).unwrap_or_default();
                    self.receive(&mut session, endpoint, bytes, now())?;
                }
                () = sleep_until(deadline.into()) => {}
            }
        }
    }

    /// Sends what is due.
    ///
    /// # Errors
    /// The connection must be closed.
    pub(crate) fn advance(
        &mut self,
        session: &mut Session<Job>,
        now: Instant,
    ) -> Result<(), LinkFault> {
        session.tick(now)?;
        while session.has_room() {
            let next = self.server.next_request(now, session.max_message());
            let Some((job, request)) = next else { break };
            session.send(request, job, now)?;
        }
        if session.has_room() && session.is_idle(now) {
            session.send(Request::Identify, Job::Test, now)?;
        }
        Ok(())
    }

    fn deadline(&self, session: &Session<Job>) -> Instant {
        let of_session = session.deadline();
        // Without room the next answer is what is waited for.
        let of_server = if session.has_room() { self.server.deadline() } else { None };
        of_server.map_or(of_session, |deadline| deadline.min(of_session))
    }

    /// Processes bytes that were received.
    ///
    /// # Errors
    /// The connection must be closed.
    pub(crate) fn receive(
        &mut self,
        session: &mut Session<Job>,
        endpoint: &Endpoint,
        bytes: &[u8],
        now: Instant,
    ) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Err(LinkFault::Lost("the server closed the connection".into()));
        }
        let (server, sink) = (&mut self.server, &self.sink);
        let mut change = None;
        let outcome = session.receive(bytes, now, |event| match event {
            Event::Up => {
                server.begin();
                sink.report_link(LinkState::Up, &format!("{endpoint}: connected"));
            }
            Event::Answer(job, answer) => server.handle_answer(job, answer, now),
            Event::Report(report) => {
                let found = server.take_report(&report, now).err();
                change = change.take().or(found);
            }
            Event::Unusable(unusable) => server.note_unusable(&unusable, now),
        });
        server.flush();
        outcome?;
        change.map_or(Ok(()), |what| Err(LinkFault::Changed(what)))
    }
}

/// The password is read anew each time, so that one that was replaced is found.
pub(crate) fn parameters(config: &Config) -> Result<Parameters, LinkFault> {
    let Config { selectors, password, timeout, test, .. } = config;
    let read = password.as_ref().map(|secret| secret.read()).transpose();
    let password = read.map_err(LinkFault::Password)?.map(|text| text.reveal().to_owned());
    Ok(Parameters { selectors: selectors.clone(), password, timeout: *timeout, test: *test })
}

/// Sends bytes within a limit.
pub(crate) async fn send(
    stream: &mut Box<dyn ByteStream>,
    bytes: Vec<u8>,
    limit: Duration,
) -> Result<(), LinkFault> {
    if bytes.is_empty() {
        return Ok(());
    }
    let lost = |error: std::io::Error| LinkFault::Lost(describe_io_error(&error));
    let writing = async {
        stream.write_all(&bytes).await?;
        stream.flush().await
    };
    timeout(limit, writing).await.map_err(|_| LinkFault::Blocked(limit))?.map_err(lost)
}
