//! The connection to a cluster: sockets around a [`Session`], one broker after the other,
//! for ever.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use busbar_link::{Backoff, ByteStream, ConnectError, Dial, Endpoint, describe_io_error};
use busbar_plugin_sdk::Error;
use thiserror::Error as ThisError;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{sleep, sleep_until, timeout};

use crate::session::{Announcement, Login, Parameters, Session, SessionFault};
use crate::settings::Config;
use crate::sparkplug::{NAMESPACE, millis};
use crate::subscriber::Subscriber;

/// Bytes that are read at once.
const CHUNK_BYTES: usize = 256 * 1024;
/// Duration of a connection after which the first reconnection attempt is quick.
const STABLE_AFTER: Duration = Duration::from_secs(10);

/// Reason for which a connection ended or was not made.
#[derive(Debug, ThisError)]
enum LinkFault {
    #[error("{0}")]
    Connect(#[from] ConnectError),
    #[error("{0}")]
    Session(#[from] SessionFault),
    #[error("{0}")]
    Secret(Error),
    #[error("the broker took no data for {} ms", .0.as_millis())]
    Blocked(Duration),
    #[error("{0}")]
    Lost(String),
}

/// Surroundings of a connection: dialer and wall clock, replaced in simulations.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) dial: Arc<dyn Dial>,
    pub(crate) wall_clock: fn() -> SystemTime,
}

/// Returns the event loop's time.
pub(crate) fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// Connection loop that serves a cluster.
pub(crate) struct Link {
    pub(crate) subscriber: Subscriber,
    pub(crate) config: Config,
    pub(crate) client_id: String,
    pub(crate) world: World,
}

impl Link {
    /// Serves for ever; drop the future to end it.
    ///
    /// A lost broker is followed by the next at once. The delay begins only when each was tried
    /// since then.
    pub(crate) async fn run(mut self) -> Infallible {
        let brokers = self.config.brokers.clone();
        let mut backoff = Backoff::new(self.config.reconnect);
        let mut tried = 0;
        self.subscriber.open(&self.config);
        for broker in brokers.iter().cycle() {
            let started = now();
            self.subscriber.begin(&broker.to_string());
            let Err(fault) = self.serve(broker).await;
            if now() - started >= STABLE_AFTER {
                backoff.reset();
                tried = 0;
            }
            tried += 1;
            if tried < brokers.len() {
                self.subscriber.end(&format!("{fault}; the next broker is tried"), false);
                continue;
            }
            tried = 0;
            let delay = backoff.next_delay();
            let seconds = delay.as_secs_f64();
            self.subscriber.end(&format!("{fault}; next try in {seconds:.1} s"), true);
            sleep(delay).await;
        }
        std::future::pending().await
    }

    async fn serve(&mut self, broker: &Endpoint) -> Result<Infallible, LinkFault> {
        let parameters = self.parameters().map_err(LinkFault::Secret)?;
        let stream = self.world.dial.dial(broker, self.config.timeout).await?;
        self.converse(stream, &parameters).await
    }

    async fn converse(
        &mut self,
        mut stream: Box<dyn ByteStream>,
        parameters: &Parameters,
    ) -> Result<Infallible, LinkFault> {
        let filters = self.subscriber.filters().to_vec();
        let mut session = Session::new(parameters, filters, now())?;
        let mut is_announced = false;
        loop {
            self.advance(&mut session)?;
            if session.is_subscribed() && !std::mem::replace(&mut is_announced, true) {
                self.announce(&mut session, parameters)?;
            }
            self.write(&mut stream, &session.take_output()).await?;
            let deadline = self.deadline(&session);
            let input = session.input();
            input.reserve(CHUNK_BYTES);
            // In this order, so that simulated time repeats itself; whatever comes first,
            // `advance` follows it, so that a broker that never falls silent is asked too.
            tokio::select! {
                biased;
                read = stream.read_buf(input) => {
                    if read.map_err(|error| LinkFault::Lost(describe_io_error(&error)))? == 0 {
                        return Err(LinkFault::Lost("the broker closed the connection".into()));
                    }
                }
                () = sleep_until(deadline.into()) => {}
            }
        }
    }

    /// Processes received bytes, deadlines and requests that are due.
    fn advance(&mut self, session: &mut Session) -> Result<(), LinkFault> {
        let now = now();
        let subscriber = &mut self.subscriber;
        let outcome = session.advance(now, |event| subscriber.note(event, now));
        subscriber.flush();
        outcome?;
        session.tick(now)?;
        while let Some((topic, payload)) = subscriber.next_request(now, self.world.wall_clock) {
            session.publish(&topic, payload, false)?;
        }
        Ok(())
    }

    /// Publishes the birth of the primary host to edge nodes, where the settings name one
    /// (Sparkplug 3.0, 5.14).
    fn announce(&self, session: &mut Session, parameters: &Parameters) -> Result<(), LinkFault> {
        if let Some(Announcement { topic, payload }) = &parameters.will {
            let payload = payload.replace("false", "true");
            session.publish(topic, payload.into_bytes(), true)?;
        }
        Ok(())
    }

    fn deadline(&self, session: &Session) -> Instant {
        let of_session = session.deadline();
        self.subscriber.deadline().map_or(of_session, |deadline| deadline.min(of_session))
    }

    async fn write(&self, stream: &mut Box<dyn ByteStream>, bytes: &[u8]) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Ok(());
        }
        let limit = self.config.keep_alive;
        let written = async {
            stream.write_all(bytes).await?;
            stream.flush().await
        };
        timeout(limit, written)
            .await
            .map_err(|_| LinkFault::Blocked(limit))?
            .map_err(|error| LinkFault::Lost(describe_io_error(&error)))
    }

    /// Secrets are read for each connection, for they may have been replaced.
    fn parameters(&self) -> Result<Parameters, Error> {
        let config = &self.config;
        let login = match &config.login {
            None => None,
            Some((username, password)) => Some(Login {
                username: username.read()?,
                password: password.as_ref().map(|password| password.read()).transpose()?,
            }),
        };
        let now = (self.world.wall_clock)();
        let will = config.primary_host.as_ref().map(|host| Announcement {
            topic: format!("{NAMESPACE}/STATE/{host}"),
            payload: format!("{{\"online\":false,\"timestamp\":{}}}", millis(now)),
        });
        Ok(Parameters {
            version: config.version,
            client_id: self.client_id.clone(),
            login,
            will,
            keep_alive: config.keep_alive,
            answer_timeout: config.timeout,
            qos: config.qos,
            max_payload: config.max_payload,
        })
    }
}
