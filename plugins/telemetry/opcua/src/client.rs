//! A secure channel to a server, and services called over it.

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use async_opcua::client::transport::{
    Connector, RequestRecv, SecureChannelEventLoop, SecureChannelState, StreamConnection,
    StreamConnector, StreamTransport, TransportConfiguration, TransportPollResult,
};
use async_opcua::client::{AsyncSecureChannel, SessionRetryPolicy};
use async_opcua::core::comms::tcp_codec::TcpCodec;
use async_opcua::core::sync::RwLock;
use async_opcua::core::{RequestMessage, ResponseMessage};
use async_opcua::crypto::CertificateStore;
use async_opcua::types::{
    ChannelSecurityToken, ContextOwned, DateTime, DecodingOptions, EndpointDescription,
    Error as LibraryError, NamespaceMap, NodeId, RequestHeader, StatusCode,
};
use busbar_link::{ByteStream, Dial};
use tokio::io::{ReadHalf, WriteHalf};
use tokio::time::timeout;
use tokio_util::codec::FramedRead;

use crate::fault::Fault;
use crate::guard::{Guarded, LastWords, MAX_CHUNK_BYTES};
use crate::security::Own;
use crate::url::Url;

/// Most chunks of one message.
const MAX_CHUNKS: usize = 256;
/// Size limits: bytes of one message, elements of one array, bytes of one text.
const MAX_MESSAGE_BYTES: usize = 16 * 1024 * 1024;
const MAX_ARRAY: usize = 200_000;
const MAX_STRING_BYTES: usize = 1024 * 1024;

type Stream = Guarded<Box<dyn ByteStream>>;
type Wire = StreamTransport<ReadHalf<Stream>, WriteHalf<Stream>>;

/// Client of one secure channel, which calls the server's services.
pub(crate) struct Client {
    channel: AsyncSecureChannel,
    state: Arc<SecureChannelState>,
    /// Deadline of a service.
    limit: Duration,
    /// Authentication token of the session, once there is one.
    token: RefCell<NodeId>,
    /// Id of the security token whose lifetime is counted from our own clock.
    anchored: Cell<u32>,
}

/// Moves the bytes of a channel; without it nothing happens.
pub(crate) struct Driver {
    events: SecureChannelEventLoop<Wire>,
    words: LastWords,
}

impl Driver {
    /// Runs the channel until the work is done; the end of the channel ends the work.
    pub(crate) async fn during<T>(
        &mut self,
        work: impl Future<Output = Result<T, Fault>>,
    ) -> Result<T, Fault> {
        tokio::select! {
            biased;
            done = work => done,
            fault = self.run() => Err(fault),
        }
    }

    /// Runs until the channel ends.
    pub(crate) async fn run(&mut self) -> Fault {
        loop {
            if let TransportPollResult::Closed(status) = self.events.poll().await {
                let words = self.words.take();
                return Fault::Lost(words.unwrap_or_else(|| crate::fault::in_words(status)));
            }
        }
    }
}

/// Parameters of a secure channel that is to be opened.
pub(crate) struct Opening<'a> {
    pub(crate) dial: &'a dyn Dial,
    pub(crate) server: &'a Url,
    pub(crate) endpoint: EndpointDescription,
    pub(crate) own: Option<&'a Own>,
    /// Deadline of the connection attempt.
    pub(crate) connect: Duration,
    /// Deadline of each service call.
    pub(crate) service: Duration,
    /// Lifetime of the channel's keys that the server is asked for.
    pub(crate) lifetime: Duration,
}

impl Opening<'_> {
    /// Connects and opens a secure channel.
    pub(crate) async fn open(self) -> Result<(Client, Driver), Fault> {
        let stream = self.dial.dial(&self.server.endpoint, self.connect).await?;
        let words = LastWords::default();
        let connector = Prepared {
            stream: Mutex::new(Some(Guarded::new(stream, words.clone()))),
            url: self.server.text.clone(),
            own: self.own.cloned(),
            state: Mutex::new(None),
        };
        // It has no files: certificates are checked and kept by us.
        let store = Arc::new(RwLock::new(CertificateStore::new(Path::new("/dev/null"))));
        let channel = AsyncSecureChannel::new(
            store,
            self.endpoint.into(),
            SessionRetryPolicy::never(),
            false,
            Arc::default(),
            TransportConfiguration {
                send_buffer_size: MAX_CHUNK_BYTES as usize,
                recv_buffer_size: MAX_CHUNK_BYTES as usize,
                max_message_size: MAX_MESSAGE_BYTES,
                max_chunk_count: MAX_CHUNKS,
            },
            u32::try_from(self.lifetime.as_millis()).unwrap_or(u32::MAX),
            Arc::new(RwLock::new(ContextOwned::new_default(NamespaceMap::new(), decoding()))),
        );
        let opened = timeout(self.connect, channel.connect_no_retry(&connector)).await;
        let events = match opened {
            Err(_) => return Err(Fault::NoAnswer(self.connect)),
            Ok(Ok(events)) => events,
            Ok(Err(error)) => {
                let of_library =
                    || Fault::from_library("opening a secure channel", &error, self.connect);
                return Err(words.take().map_or_else(of_library, Fault::Lost));
            }
        };
        let state = connector.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let state = state.ok_or(Fault::Lost("the channel was not made".into()))?;
        let client = Client {
            channel,
            state,
            limit: self.service,
            token: RefCell::new(NodeId::null()),
            anchored: Cell::new(0),
        };
        client.anchor();
        Ok((client, Driver { events, words }))
    }
}

/// Returns the decoding limits for messages from a server.
pub(crate) fn decoding() -> DecodingOptions {
    DecodingOptions {
        max_message_size: MAX_MESSAGE_BYTES,
        max_chunk_count: MAX_CHUNKS,
        max_string_length: MAX_STRING_BYTES,
        max_byte_string_length: MAX_STRING_BYTES,
        max_array_length: MAX_ARRAY,
        ..DecodingOptions::default()
    }
}

impl Client {
    /// Returns a request header with a deadline.
    pub(crate) fn header(&self, limit: Duration) -> RequestHeader {
        RequestHeader {
            authentication_token: self.token.borrow().clone(),
            timestamp: DateTime::now(),
            request_handle: self.channel.request_handle(),
            timeout_hint: u32::try_from(limit.as_millis()).unwrap_or(u32::MAX),
            ..RequestHeader::default()
        }
    }

    /// Deadline of a service.
    pub(crate) fn limit(&self) -> Duration {
        self.limit
    }

    /// Further requests belong to this session.
    pub(crate) fn set_session(&self, token: &NodeId) {
        self.token.replace(token.clone());
    }

    /// Calls a service. A fault of the service is an error.
    pub(crate) async fn call(
        &self,
        what: &'static str,
        request: impl Into<RequestMessage>,
        limit: Duration,
    ) -> Result<ResponseMessage, Fault> {
        let answer = self.channel.send(request, limit).await;
        self.anchor();
        let answer = answer.map_err(|error| Fault::from_library(what, &error, limit))?;
        let status = answer.response_header().service_result;
        if status.is_bad() || matches!(answer, ResponseMessage::ServiceFault(_)) {
            let error = LibraryError::new(status, "the server refused");
            return Err(match Fault::from_library(what, &error, limit) {
                Fault::Library(what, _) => Fault::Refused { what, status },
                fault => fault,
            });
        }
        Ok(answer)
    }

    /// Counts the time of new keys from our own clock: the library counts it from the
    /// server's, and renews them at each request or never where the two differ.
    fn anchor(&self) {
        let secure = self.state.secure_channel();
        let (token_id, channel_id, lifetime) = {
            let secure = secure.read();
            (secure.token_id(), secure.secure_channel_id(), secure.token_lifetime())
        };
        if self.anchored.replace(token_id) != token_id {
            secure.write().set_security_token(ChannelSecurityToken {
                channel_id,
                token_id,
                created_at: DateTime::now(),
                revised_lifetime: lifetime,
            });
        }
    }
}

/// Calls a service and returns its answer in the expected type.
macro_rules! answer {
    ($client:expr, $what:literal, $variant:ident, $request:expr) => {
        answer!($client, $what, $variant, $request, $client.limit())
    };
    ($client:expr, $what:literal, $variant:ident, $request:expr, $limit:expr) => {
        match $client.call($what, $request, $limit).await {
            Ok(async_opcua::core::ResponseMessage::$variant(answer)) => Ok(*answer),
            Ok(_) => Err($crate::fault::Fault::Server(concat!($what, " had another answer"))),
            Err(fault) => Err(fault),
        }
    };
}
pub(crate) use answer;

/// A connector for one connection, which was made before.
struct Prepared {
    stream: Mutex<Option<Stream>>,
    url: String,
    own: Option<Own>,
    state: Mutex<Option<Arc<SecureChannelState>>>,
}

impl Connector for Prepared {
    type Transport = Wire;

    async fn connect(
        &self,
        channel: Arc<SecureChannelState>,
        outgoing: RequestRecv,
        config: TransportConfiguration,
    ) -> Result<Wire, LibraryError> {
        {
            // The library would read them from files of fixed names.
            let mut secure = channel.secure_channel().write();
            secure.set_cert(self.own.as_ref().map(|own| own.certificate.clone()));
            secure.set_private_key(self.own.as_ref().map(|own| own.key.clone()));
        }
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&channel));
        let connect = |url: String, options: DecodingOptions| {
            let stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner).take();
            std::future::ready(match stream {
                Some(stream) => {
                    let (reader, writer) = tokio::io::split(stream);
                    let reader = FramedRead::new(reader, TcpCodec::new(options));
                    Ok(StreamConnection::new(reader, writer, url))
                }
                None => Err(LibraryError::new(StatusCode::BadInvalidState, "used before")),
            })
        };
        let inner = StreamConnector::new(connect, self.url.clone());
        inner.connect(channel, outgoing, config).await
    }

    fn default_endpoint(&self) -> EndpointDescription {
        EndpointDescription::from(self.url.as_str())
    }
}
