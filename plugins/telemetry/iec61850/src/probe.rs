//! The client in memory, its clock in the caller's hands: for fuzzing.

use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, SampleSink, TagSpec};
use iec61850_rs::proto::mms::association::{Association, AssociationConfig, AssociationEvent};
use iec61850_rs::proto::mms::{ConfirmedRequest, Mms, ObjectName, VariableAccess};

use crate::points::Points;
use crate::server::{Job, Server};
use crate::service::LIMITS;
use crate::session::{Event, Parameters, Session};
use crate::settings::Settings;

/// Requests that are sent between two pieces of input.
const MAX_REQUESTS: usize = 16;
/// Messages of the association until it stands.
const MAX_HANDSHAKE: usize = 8;

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
        let server = Server::new(&config, Points::parse(tags)?, sink, host());
        let now = Instant::now();
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
            Event::Answer(job, answer) => server.handle_answer(job, answer, *now),
            Event::Report(report) => {
                let found = server.take_report(&report, *now);
                if change.is_ok() {
                    change = found;
                }
            }
            Event::Unusable(unusable) => server.note_unusable(&unusable, *now),
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

/// A client with an association: what its server says is in the caller's hands, without
/// the layers around it.
pub struct AssociatedProbe {
    client: ClientProbe,
    end: Association,
    writes: Vec<String>,
}

impl AssociatedProbe {
    /// An association that was just made.
    ///
    /// # Errors
    /// Those of [`ClientProbe`].
    pub fn new(client: ClientProbe) -> Result<Self, String> {
        let end = Association::server(AssociationConfig::default());
        let mut probe = Self { client, end, writes: Vec::new() };
        for _ in 0..MAX_HANDSHAKE {
            probe.exchange()?;
        }
        Ok(probe)
    }

    /// Takes a message of the server's, and sends what there is to send.
    ///
    /// # Errors
    /// Why the connection ends.
    pub fn receive(&mut self, pdu: &[u8]) -> Result<(), String> {
        // One that is too long for the association is none that could come.
        let _ = self.end.send_encoded(pdu);
        self.exchange()
    }

    /// Names of the attributes that the client asked to write.
    pub fn writes(&self) -> &[String] {
        &self.writes
    }

    fn exchange(&mut self) -> Result<(), String> {
        self.end.on_bytes(iec61850_rs::Instant::ZERO, &self.client.take_output());
        while let Some(event) = self.end.poll_event() {
            if let AssociationEvent::Request { pdu, .. } = event {
                self.writes.extend(writes_of(&pdu));
            }
        }
        while let Some(bytes) = self.end.poll_transmit() {
            self.client.receive(bytes)?;
        }
        Ok(())
    }
}

/// Returns the names that a request writes to; anything but a write of named variables is a fault.
fn writes_of(pdu: &[u8]) -> Vec<String> {
    let Ok(Mms::ConfirmedRequest { service, .. }) = Mms::parse(pdu, &LIMITS) else {
        return vec!["what is no request".into()];
    };
    match service {
        ConfirmedRequest::Write { access: VariableAccess::ListOfVariable(list), .. } => list
            .iter()
            .map(|variable| match variable.name() {
                Some(ObjectName::DomainSpecific { domain, item }) => format!("{domain}/{item}"),
                _ => "a variable without a logical device".into(),
            })
            .collect(),
        ConfirmedRequest::Read { .. }
        | ConfirmedRequest::Identify
        | ConfirmedRequest::GetNameList { .. }
        | ConfirmedRequest::GetVariableAccessAttributes(_)
        | ConfirmedRequest::GetNamedVariableListAttributes(_) => Vec::new(),
        other => vec![format!("{other:?}")],
    }
}
