//! The connection to a server: one session after the other, for ever.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;
use std::time::{Duration, Instant};

use busbar_link::Backoff;
use busbar_plugin_sdk::{Host, LinkState, Reason, SampleSink};
use tokio::sync::watch;
use tokio::task::LocalSet;
use tokio::time::{sleep, timeout};

use crate::fault::Fault;
use crate::namespaces::NamespaceMemory;
use crate::point_states::PointStates;
use crate::session;
use crate::settings::Config;
use crate::url::Url;
use crate::watch::Watch;
use crate::world::World;

/// Duration of a session after which the first reconnection attempt is quick.
const STABLE_AFTER: Duration = Duration::from_secs(10);
/// Deadline of closing a session.
pub(crate) const CLOSE_LIMIT: Duration = Duration::from_millis(800);

/// The way to the servers.
pub(crate) struct Link {
    pub(crate) config: Config,
    pub(crate) point_states: Rc<RefCell<PointStates>>,
    pub(crate) sink: SampleSink,
    pub(crate) host: Host,
    pub(crate) world: World,
    /// Becomes true when it is time to say goodbye.
    pub(crate) stop: watch::Receiver<bool>,
    /// Namespaces as they were first.
    pub(crate) namespaces: RefCell<NamespaceMemory>,
}

impl Link {
    /// Serves until it is told to stop.
    pub(crate) async fn run(self) {
        self.point_states.borrow_mut().lose(Reason::NotConnected);
        let names: Vec<_> = self.config.servers.iter().map(Url::to_string).collect();
        let text = format!("{}: connecting", names.join(", "));
        self.sink.report_link(LinkState::Connecting, &text);
        let mut backoff = Backoff::new(self.config.reconnect);
        for server in self.config.servers.iter().cycle() {
            let started = Instant::now();
            let Err(fault) = self.serve_guarded(server).await;
            if matches!(fault, Fault::Stopped) {
                return;
            }
            if started.elapsed() >= STABLE_AFTER {
                backoff.reset();
            }
            let delay = backoff.next_delay();
            self.point_states.borrow_mut().lose(Reason::Communication);
            let text = format!("{server}: {fault}; next try in {:.1} s", delay.as_secs_f64());
            self.point_states.borrow().tell_mirror(&text);
            self.sink.report_link(LinkState::Down, &text);
            if self.stopped_within(delay).await {
                return;
            }
        }
    }

    /// Serves one session; why it ended.
    pub(crate) async fn serve_once(&self) -> String {
        let Some(server) = self.config.servers.first() else { return String::new() };
        let Err(fault) = self.serve_guarded(server).await;
        self.point_states.borrow_mut().lose(Reason::Communication);
        fault.to_string()
    }

    /// Serves one connection; a panic of the library over a server's message ends the session
    /// alone.
    async fn serve_guarded(&self, server: &Url) -> Result<Infallible, Fault> {
        let tasks = LocalSet::new();
        tasks.run_until(CatchPanic(Box::pin(self.serve(server)))).await
    }

    async fn serve(&self, server: &Url) -> Result<Infallible, Fault> {
        let mut stop = self.stop.clone();
        let (client, mut driver) = tokio::select! {
            biased;
            _ = stop.wait_for(|stop| *stop) => return Err(Fault::Stopped),
            opened = session::open(&self.world, &self.config, server) => opened?,
        };
        let client = Rc::new(client);
        let work = async {
            let (config, point_states) = (self.config.clone(), Rc::clone(&self.point_states));
            // Tags wait for their values until these come.
            point_states.borrow_mut().lose(Reason::NotConnected);
            let watch = Watch::begin(
                Rc::clone(&client),
                config,
                point_states,
                self.host.clone(),
                self.world.wall_clock,
                (server.text.as_str(), &self.namespaces),
            )
            .await?;
            let mut text = format!("{server}: connected");
            for moved in watch.moved_namespaces() {
                text.push_str("; ");
                text.push_str(&moved);
            }
            self.sink.report_link(LinkState::Up, &text);
            Err(watch.run().await)
        };
        let goodbye = async {
            // An error is the end of whoever would tell: that is a goodbye, too.
            let _ = stop.wait_for(|stop| *stop).await;
        };
        let fault = tokio::select! {
            biased;
            () = goodbye => Fault::Stopped,
            ended = driver.during(work) => ended.map_or_else(|fault| fault, |never: Infallible| match never {}),
        };
        if matches!(fault, Fault::Stopped) {
            let close = async {
                session::close(&client, CLOSE_LIMIT).await;
                Ok(())
            };
            let _ = timeout(CLOSE_LIMIT, driver.during(close)).await;
        }
        Err(fault)
    }

    /// Waits for a delay; reports whether a stop was requested meanwhile.
    async fn stopped_within(&self, delay: Duration) -> bool {
        let mut stop = self.stop.clone();
        tokio::select! {
            biased;
            _ = stop.wait_for(|stop| *stop) => true,
            () = sleep(delay) => false,
        }
    }
}

/// A future whose panic is a fault.
pub(crate) struct CatchPanic<F>(pub(crate) std::pin::Pin<Box<F>>);

impl<T, F: Future<Output = Result<T, Fault>>> Future for CatchPanic<F> {
    type Output = Result<T, Fault>;

    fn poll(
        mut self: std::pin::Pin<&mut Self>,
        context: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Self::Output> {
        let poll = std::panic::AssertUnwindSafe(|| self.0.as_mut().poll(context));
        // What it held is dropped with it, and the point states are emptied before the next session.
        std::panic::catch_unwind(poll).unwrap_or(std::task::Poll::Ready(Err(Fault::Panic)))
    }
}
