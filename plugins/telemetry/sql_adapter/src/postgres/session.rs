//! One connection: queries in their periods, and notifications as they come.
//!
//! A server holds notifications back while a transaction of ours is open (PostgreSQL 17,
//! NOTIFY). The samples of an answer are published before the transaction ends, so they
//! never come after a notification that is newer.

use std::cell::RefCell;
use std::future::poll_fn;
use std::pin::pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use busbar_plugin_sdk::LogLevel;
use futures_util::TryStreamExt;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::Notify;
use tokio::time::{sleep_until, timeout};
use tokio_postgres::error::{DbError, Severity, SqlState};
use tokio_postgres::{AsyncMessage, Client, Connection, Error, Statement};

use super::{LinkFault, fault_of};
use crate::answer::{Answer, MAX_ROWS, QueryFault, Samples};
use crate::point_states::{PointStates, shown};
use crate::schedule::Schedule;
use crate::settings::{Channel, Config, QueryConfig};

/// Time beyond the server's own deadline for it to report that a query took too long.
const GRACE: Duration = Duration::from_secs(1);
/// Suspension of a query whose answer ended the connection.
const SUSPENSION: Duration = Duration::from_secs(300);
/// Time from a notification that cannot be used to the query that is asked anew, once for
/// all that come meanwhile.
const ASK_ANEW: Duration = Duration::from_secs(1);
/// Time from the failure of a query without a period to its next try.
const RETRY: Duration = Duration::from_secs(30);
/// Empty query that keeps the connection alive.
const KEEPALIVE: &str = "";

/// Messages that come unasked. Polling it drives the connection.
pub(super) type Messages =
    Box<dyn FnMut(&mut Context<'_>) -> Poll<Option<Result<AsyncMessage, Error>>>>;

/// The messages of a connection, whatever it runs over.
pub(super) fn messages<S, T>(mut connection: Connection<S, T>) -> Messages
where
    S: AsyncRead + AsyncWrite + Unpin + 'static,
    T: AsyncRead + AsyncWrite + Unpin + 'static,
{
    Box::new(move |cx| connection.poll_message(cx))
}

/// State of the session that outlives a connection.
pub(super) struct Session<'a> {
    queries: &'a [QueryConfig],
    channels: &'a [Channel],
    timeout: Duration,
    keepalive: Duration,
    point_states: &'a RefCell<PointStates>,
    /// By query: until when it is left out.
    suspended: Vec<Option<Instant>>,
    /// The query under way.
    current: Option<usize>,
}

impl<'a> Session<'a> {
    pub(super) fn new(
        config: &'a Config,
        keepalive: Duration,
        point_states: &'a RefCell<PointStates>,
    ) -> Self {
        let Config { queries, channels, timeout, .. } = config;
        let suspended = vec![None; queries.len()];
        Self {
            queries,
            channels,
            timeout: *timeout,
            keepalive,
            point_states,
            suspended,
            current: None,
        }
    }

    /// Serves until the connection ends; says why.
    pub(super) async fn run(&mut self, client: Client, mut messages: Messages) -> LinkFault {
        let (point_states, channels) = (self.point_states, self.channels);
        // Wakes the polling when a query is to be asked anew.
        let wanted = Notify::new();
        let fault = {
            let receive =
                poll_fn(|cx| poll_messages(cx, &mut messages, channels, point_states, &wanted));
            let mut poll = pin!(self.poll(client, &wanted));
            tokio::select! {
                biased;
                fault = receive => match timeout(Duration::ZERO, poll).await {
                    // The server's own word, which came just before the end.
                    Ok(refused @ LinkFault::Refused(_)) => refused,
                    _ => fault,
                },
                fault = &mut poll => fault,
            }
        };
        point_states.borrow_mut().flush();
        if let (LinkFault::OversizedMessage(_), Some(query)) = (&fault, self.current) {
            self.suspended[query] = Some(Instant::now() + SUSPENSION);
        }
        self.current = None;
        fault
    }

    async fn poll(&mut self, mut client: Client, wanted: &Notify) -> LinkFault {
        match self.poll_until_fault(&mut client, wanted).await {
            Ok(never) => match never {},
            Err(fault) => fault,
        }
    }

    async fn poll_until_fault(
        &mut self,
        client: &mut Client,
        wanted: &Notify,
    ) -> Result<std::convert::Infallible, LinkFault> {
        self.set_up(client).await?;
        self.point_states.borrow_mut().note_connected();
        let mut now = Instant::now();
        let is_used = |query| self.point_states.borrow().is_used(query);
        let mut schedule =
            Schedule::new(self.queries.iter().map(|query| query.period), is_used, now);
        self.leave_out_suspended(&mut schedule, now);
        let mut statements: Vec<Option<Statement>> = vec![None; self.queries.len()];
        let mut heard = now;
        loop {
            self.ask_anew(&mut schedule);
            let alive_until = heard + self.keepalive;
            let due = schedule.next().filter(|(_, due)| *due <= alive_until);
            tokio::select! {
                biased;
                () = sleep_until(due.map_or(alive_until, |(_, due)| due).into()) => {}
                () = wanted.notified() => continue,
            }
            now = Instant::now();
            match due {
                Some((query, _)) => {
                    schedule.note_run(query, now);
                    self.current = Some(query);
                    self.run_query(client, query, &mut statements[query]).await?;
                    self.current = None;
                    let is_asked_once = self.queries[query].period.is_none();
                    if is_asked_once && self.point_states.borrow().has_failed(query) {
                        schedule.bring_forward(query, Instant::now() + RETRY);
                    }
                }
                None => {
                    let alive = client.batch_execute(KEEPALIVE);
                    self.within("a keepalive".into(), alive)
                        .await?
                        .map_err(|error| fault_of(&error))?;
                }
            }
            heard = Instant::now();
        }
    }

    /// Makes the connection one that only reads, and listens, before anything is asked:
    /// what changes after the first answers is then told.
    async fn set_up(&self, client: &Client) -> Result<(), LinkFault> {
        let millis = self.timeout.as_millis();
        let mut commands = format!(
            "SET default_transaction_read_only = on; SET statement_timeout = {millis}; \
             SET idle_in_transaction_session_timeout = {}; SET client_min_messages = warning",
            (self.timeout + GRACE).as_millis()
        );
        for Channel { name, query } in self.channels {
            if self.point_states.borrow().is_used(*query) {
                let quoted = name.replace('"', "\"\"");
                commands += &format!("; LISTEN \"{quoted}\"");
            }
        }
        let done = self.within("the set-up".into(), client.batch_execute(&commands)).await?;
        done.map_err(|error| fault_of(&error))
    }

    /// Plans queries anew of which a notification could not be used.
    fn ask_anew(&self, schedule: &mut Schedule) {
        let wanted = self.point_states.borrow_mut().take_wanted();
        let at = Instant::now() + ASK_ANEW;
        let is_asked = |query: &usize| self.suspended[*query].is_none_or(|until| until <= at);
        for query in wanted.into_iter().filter(is_asked) {
            schedule.bring_forward(query, at);
        }
    }

    fn leave_out_suspended(&mut self, schedule: &mut Schedule, now: Instant) {
        for (query, until) in self.suspended.iter_mut().enumerate() {
            *until = until.filter(|until| *until > now);
            let Some(until) = *until else { continue };
            schedule.put_off(query, until);
            let fault = QueryFault::Refused(format!(
                "its answer was too long, which ended the connection; it is left out for {} s: \
                 select less text",
                (until - now).as_secs()
            ));
            self.point_states.borrow_mut().note_answer(query, Err(fault));
        }
    }

    async fn run_query(
        &self,
        client: &mut Client,
        query: usize,
        statement: &mut Option<Statement>,
    ) -> Result<(), LinkFault> {
        let what = format!("query '{}'", self.queries[query].name);
        let asked = self.ask(client, query, statement);
        let outcome = self.within(what, asked).await?;
        let Err(error) = outcome else { return Ok(()) };
        // It may fit the tables no more.
        *statement = None;
        if client.is_closed() || is_fatal(&error) {
            return Err(fault_of(&error));
        }
        let fault = query_fault(&error, self.timeout);
        self.point_states.borrow_mut().note_answer(query, Err(fault));
        Ok(())
    }

    /// Runs a query in a transaction of its own and publishes what it gave.
    async fn ask(
        &self,
        client: &mut Client,
        query: usize,
        statement: &mut Option<Statement>,
    ) -> Result<(), Error> {
        let prepared = match statement {
            Some(prepared) => prepared.clone(),
            None => client.prepare(&self.queries[query].sql).await?,
        };
        *statement = Some(prepared.clone());
        let transaction = client.build_transaction().read_only(true).start().await?;
        let outcome = match check(&prepared) {
            Err(fault) => Err(fault),
            Ok(()) => {
                let portal = transaction.bind(&prepared, &[]).await?;
                // One row more tells that there are too many.
                let rows = transaction.query_portal_raw(&portal, MAX_ROWS as i32 + 1).await?;
                let points = self.point_states.borrow().points(query);
                let names: Vec<_> = prepared.columns().iter().map(|column| column.name()).collect();
                let mut rows = pin!(rows);
                let rules = self.point_states.borrow().time_rules();
                match Answer::begin(&points, &names, &rules) {
                    Err(fault) => Err(fault),
                    Ok(answer) => gather(answer, &mut rows).await?,
                }
            }
        };
        self.point_states.borrow_mut().note_answer(query, outcome);
        transaction.rollback().await
    }

    /// Waits for what the server answers in time even where it takes as long as it may.
    async fn within<T>(&self, what: String, work: impl Future<Output = T>) -> Result<T, LinkFault> {
        let limit = self.timeout + GRACE;
        timeout(limit, work).await.map_err(|_| LinkFault::Silent { what, limit })
    }
}

/// Reads rows to their end, or until there are too many.
async fn gather(
    mut answer: Answer<'_>,
    rows: &mut (impl TryStreamExt<Ok = tokio_postgres::Row, Error = Error> + Unpin),
) -> Result<Result<Samples, QueryFault>, Error> {
    while let Some(row) = rows.try_next().await? {
        if let Err(fault) = answer.take(&row) {
            return Ok(Err(fault));
        }
    }
    Ok(answer.finish())
}

fn check(statement: &Statement) -> Result<(), QueryFault> {
    let refused = |what: &str| Err(QueryFault::Refused(what.to_owned()));
    if !statement.params().is_empty() {
        return refused("it has parameters ($1), which nobody gives it: write the values");
    }
    if statement.columns().is_empty() {
        return refused("it gives no columns: write a SELECT");
    }
    Ok(())
}

/// Takes all messages that are there; ends with the connection.
fn poll_messages(
    cx: &mut Context<'_>,
    messages: &mut Messages,
    channels: &[Channel],
    point_states: &RefCell<PointStates>,
    wanted: &Notify,
) -> Poll<LinkFault> {
    loop {
        match messages(cx) {
            Poll::Ready(Some(Ok(AsyncMessage::Notification(told)))) => {
                let mut channels = channels.iter();
                if let Some(channel) = channels.find(|channel| channel.name == told.channel()) {
                    point_states.borrow_mut().note_notification(channel.query, told.payload());
                }
            }
            Poll::Ready(Some(Ok(AsyncMessage::Notice(notice)))) => {
                let text = format!("the server says: {}", shown(notice.message()));
                point_states.borrow().log(LogLevel::Debug, &text);
            }
            Poll::Ready(Some(Ok(_))) => {}
            Poll::Ready(Some(Err(error))) => return Poll::Ready(fault_of(&error)),
            Poll::Ready(None) => {
                return Poll::Ready(LinkFault::Lost("the connection was closed".into()));
            }
            Poll::Pending => {
                point_states.borrow_mut().flush();
                if point_states.borrow().has_wanted() {
                    wanted.notify_one();
                }
                return Poll::Pending;
            }
        }
    }
}

fn is_fatal(error: &Error) -> bool {
    let severity = error.as_db_error().and_then(DbError::parsed_severity);
    match severity {
        Some(severity) => matches!(severity, Severity::Fatal | Severity::Panic),
        // Not the server's word: the connection itself is at fault.
        None => error.as_db_error().is_none(),
    }
}

/// Converts an error to a fault of the query, where the connection is well.
fn query_fault(error: &Error, limit: Duration) -> QueryFault {
    let Some(refusal) = error.as_db_error() else {
        return QueryFault::Refused(shown(&error.to_string()));
    };
    let text = shown(refusal.message());
    let code = refusal.code();
    if *code == SqlState::QUERY_CANCELED {
        return QueryFault::Unavailable(format!(
            "{text}: it took longer than {} ms (timeout_seconds), or somebody stopped it",
            limit.as_millis()
        ));
    }
    // Classes 40 conflicts, 53 lack of resources, 55 not in the right state, 57
    // intervention, 58 system (PostgreSQL 17, appendix A).
    let is_passing = ["40", "53", "55", "57", "58"].iter().any(|c| code.code().starts_with(c));
    let hint = refusal.hint().map(|hint| format!(" ({})", shown(hint))).unwrap_or_default();
    let text = format!("{text}{hint}");
    if is_passing { QueryFault::Unavailable(text) } else { QueryFault::Refused(text) }
}
