//! The client in memory, its clock in the caller's hands: for fuzzing.

use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, SampleSink, TagSpec};

use crate::points::Points;
use crate::server::{Job, Server};
use crate::session::{Event, Parameters, Session};
use crate::settings::Settings;

/// Requests that are sent between two pieces of input.
const MAX_REQUESTS: usize = 16;

/// A client whose server is the caller: bytes in, samples and bytes out.
pub struct ClientProbe {
    session: Session<Job>,
    server: Server,
    now: Instant,
}

impl ClientProbe {
    /// A connection that was just made.
    ///
    /// # Errors
    /// What the plugin would say of settings and addresses.
    pub fn new(settings: Settings, tags: &[TagSpec], sink: SampleSink) -> Result<Self, Error> {
        let config = settings.parse()?;
        let parameters = Parameters {
            selectors: config.selectors.clone(),
            password: None,
            timeout: config.timeout,
            test: config.test,
        };
        let (server, now) =
            (Server::new(&config, Points::parse(tags)?, sink, host()), Instant::now());
        let mut session = Session::new(&parameters, 0, now);
        session.start(now).map_err(|fault| Error::failed(fault.to_string()))?;
        Ok(Self { session, server, now })
    }

    /// Takes bytes, a millisecond later; why the connection ends, if it does.
    ///
    /// # Errors
    /// In words.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<(), String> {
        let Self { session, server, now } = self;
        *now += Duration::from_millis(1);
        let mut change = Ok(());
        let outcome = session.receive(bytes, *now, |event| match event {
            Event::Up => server.begin(),
            Event::Answer(job, answer) => server.heed(job, answer, *now),
            Event::Report(report) => change = server.take_report(&report, *now),
            Event::Unreadable(why) => server.note_unreadable(&why),
        });
        server.flush();
        outcome.map_err(|fault| fault.to_string())?;
        change
    }

    /// The bytes to send now.
    pub fn take_output(&mut self) -> Vec<u8> {
        for _ in 0..MAX_REQUESTS {
            if !self.session.has_room() {
                break;
            }
            let next = self.server.next_request(self.now, self.session.max_message());
            let Some((job, request)) = next else { break };
            if self.session.send(request, job, self.now).is_err() {
                break;
            }
        }
        self.session.take_output()
    }
}
