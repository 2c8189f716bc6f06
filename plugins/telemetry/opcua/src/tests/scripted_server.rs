//! Scripted OPC UA server in the test's process, for faults that real servers do not produce on
//! demand.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use async_opcua::core::{Message, RequestMessage, ResponseMessage};
use async_opcua::crypto::SecurityPolicy;
use async_opcua::types::{
    ActivateSessionResponse, BinaryDecodable, BinaryEncodable, ByteString, ChannelSecurityToken,
    CloseSessionResponse, ContextOwned, CreateMonitoredItemsResponse, CreateSessionResponse,
    CreateSubscriptionResponse, DataChangeNotification, DataValue, DateTime, EndpointDescription,
    ExtensionObject, GetEndpointsResponse, Identifier, MessageSecurityMode,
    MonitoredItemCreateResult, MonitoredItemNotification, NamespaceMap, NodeId,
    NotificationMessage, OpenSecureChannelResponse, PublishResponse, ReadResponse,
    RepublishResponse, RequestHeader, ResponseHeader, ServiceFault, StatusCode, UAString,
    UserTokenPolicy, Variant,
};

use crate::client::decoding;

/// Time for which the server waits for bytes before it checks for messages to publish.
const TURN: Duration = Duration::from_millis(3);
/// Longest wait of a test for the server.
const PATIENCE: Duration = Duration::from_secs(20);
const NAMESPACE_ARRAY: u32 = 2255;
const SERVER_STATE: u32 = 2259;

/// Orders of a test to the server, and the requests that came.
#[derive(Default)]
pub(crate) struct Script {
    /// Values of the nodes, by node as text.
    pub(crate) values: HashMap<String, DataValue>,
    pub(crate) namespaces: Vec<String>,
    pub(crate) state: i32,
    /// Publishing interval, milliseconds, and intervals without a change before a keep-alive.
    pub(crate) interval_millis: f64,
    pub(crate) keep_alive_count: u32,
    /// Notifications that Republish returns, by sequence number.
    pub(crate) kept: BTreeMap<u32, NotificationMessage>,
    /// True where Republish is not answered.
    pub(crate) holds_republish: bool,
    /// Most publish requests that wait at the server; it refuses those beyond.
    pub(crate) max_publishes: usize,
    /// True once the connection is to be closed.
    pub(crate) is_closing: bool,
    /// Names of the requests that came, in order.
    pub(crate) requests: Vec<&'static str>,
    /// Handles of monitored items, by node as text.
    handles: HashMap<String, Vec<u32>>,
    subscription: u32,
    published: VecDeque<PublishResponse>,
}

/// The server, on a port of its own.
pub(crate) struct ScriptedServer {
    pub(crate) port: u16,
    script: Arc<Mutex<Script>>,
}

fn lock(script: &Mutex<Script>) -> MutexGuard<'_, Script> {
    script.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Creates a value as a server reports it.
pub(crate) fn value(variant: impl Into<Variant>) -> DataValue {
    DataValue {
        value: Some(variant.into()),
        source_timestamp: Some(DateTime::now()),
        ..DataValue::default()
    }
}

impl ScriptedServer {
    /// Starts it with these namespaces beyond the standard's.
    pub(crate) fn start(namespaces: &[&str]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let script = Arc::new(Mutex::new(Script {
            interval_millis: 50.0,
            keep_alive_count: 4,
            max_publishes: 100,
            ..Script::default()
        }));
        let server = Self { port, script: Arc::clone(&script) };
        server.set_namespaces(namespaces);
        thread::spawn(move || {
            for stream in listener.incoming() {
                let Ok(stream) = stream else { return };
                Connection::new(stream, Arc::clone(&script), port).serve();
                if Arc::strong_count(&script) == 1 {
                    return;
                }
            }
        });
        server
    }

    pub(crate) fn script(&self) -> MutexGuard<'_, Script> {
        lock(&self.script)
    }

    pub(crate) fn set_namespaces(&self, namespaces: &[&str]) {
        let standard = ["http://opcfoundation.org/UA/"];
        let all = standard.iter().chain(namespaces).map(|uri| (*uri).to_owned());
        self.script().namespaces = all.collect();
    }

    /// Sets the value that reading a node returns.
    pub(crate) fn set(&self, node: &str, value: DataValue) {
        self.script().values.insert(node.to_owned(), value);
    }

    /// Closes the connection, as a restart of the server does.
    pub(crate) fn restart(&self) {
        self.script().is_closing = true;
        self.wait("the end", |script| !script.is_closing);
    }

    /// Waits until nodes are monitored.
    pub(crate) fn wait_monitored(&self, nodes: &[&str]) {
        self.wait("monitored items", |script| {
            nodes.iter().all(|node| script.handles.contains_key(*node))
        });
    }

    #[track_caller]
    pub(crate) fn wait(&self, what: &str, is_so: impl Fn(&Script) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !is_so(&self.script()) {
            assert!(Instant::now() < deadline, "{what}: {:?}", self.script().requests);
            thread::sleep(TURN);
        }
    }

    /// Waits until all has been published.
    pub(crate) fn wait_published(&self) {
        self.wait("publishing", |script| script.published.is_empty());
    }

    /// Number of requests of a name.
    pub(crate) fn count(&self, request: &str) -> usize {
        self.script().requests.iter().filter(|name| **name == request).count()
    }

    /// Creates a notification with values of nodes.
    pub(crate) fn notification(
        &self,
        number: u32,
        values: &[(&str, DataValue)],
    ) -> NotificationMessage {
        let script = self.script();
        let changes = values.iter().flat_map(|(node, value)| {
            script.handles[*node].iter().map(|handle| MonitoredItemNotification {
                client_handle: *handle,
                value: value.clone(),
            })
        });
        message(number, Some(vec![changes_of(changes.collect())]))
    }

    /// Publishes values of nodes.
    pub(crate) fn data(&self, number: u32, values: &[(&str, DataValue)]) {
        let message = self.notification(number, values);
        self.publish(message);
    }

    pub(crate) fn keep_alive(&self, number: u32) {
        self.publish(message(number, None));
    }

    pub(crate) fn publish(&self, message: NotificationMessage) {
        let mut script = self.script();
        let answer = PublishResponse {
            subscription_id: script.subscription,
            notification_message: message,
            ..PublishResponse::default()
        };
        script.published.push_back(answer);
    }
}

/// Creates a message with these parts, or a keep-alive.
pub(crate) fn message(number: u32, data: Option<Vec<ExtensionObject>>) -> NotificationMessage {
    NotificationMessage {
        sequence_number: number,
        publish_time: DateTime::now(),
        notification_data: data,
    }
}

/// Creates a data change notification of these items.
pub(crate) fn changes_of(items: Vec<MonitoredItemNotification>) -> ExtensionObject {
    ExtensionObject::from_message(DataChangeNotification {
        monitored_items: Some(items),
        diagnostic_infos: None,
    })
}

struct Connection {
    stream: TcpStream,
    script: Arc<Mutex<Script>>,
    port: u16,
    bytes: Vec<u8>,
    sequence: u32,
    /// Publish requests that wait.
    waiting: VecDeque<(u32, RequestHeader)>,
}

impl Connection {
    fn new(stream: TcpStream, script: Arc<Mutex<Script>>, port: u16) -> Self {
        stream.set_read_timeout(Some(TURN)).unwrap();
        Self { stream, script, port, bytes: Vec::new(), sequence: 0, waiting: VecDeque::new() }
    }

    fn serve(&mut self) {
        let mut bytes = [0; 4096];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => self.bytes.extend(&bytes[..count]),
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => break,
            }
            while let Some(frame) = self.take_frame() {
                self.answer(&frame);
            }
            if std::mem::take(&mut lock(&self.script).is_closing) {
                let mut script = lock(&self.script);
                script.handles.clear();
                script.published.clear();
                break;
            }
            self.publish();
        }
    }

    fn take_frame(&mut self) -> Option<Vec<u8>> {
        let size = u32::from_le_bytes(self.bytes.get(4..8)?.try_into().unwrap()) as usize;
        (self.bytes.len() >= size).then(|| self.bytes.drain(..size).collect())
    }

    fn publish(&mut self) {
        loop {
            let answer = {
                let mut script = lock(&self.script);
                if self.waiting.is_empty() {
                    return;
                }
                match script.published.pop_front() {
                    Some(answer) => answer,
                    None => return,
                }
            };
            let Some((id, header)) = self.waiting.pop_front() else { return };
            let answer =
                PublishResponse { response_header: ResponseHeader::new_good(&header), ..answer };
            self.send(b"MSG", id, answer.into());
        }
    }

    fn answer(&mut self, frame: &[u8]) {
        if frame.starts_with(b"HEL") {
            let mut answer = [b"ACKF".as_slice(), &28_u32.to_le_bytes()].concat();
            for field in [0_u32, 65_536, 65_536, 0, 0] {
                answer.extend(field.to_le_bytes());
            }
            let _ = self.stream.write_all(&answer);
            return;
        }
        let is_opening = frame.starts_with(b"OPN");
        let context = ContextOwned::new_default(NamespaceMap::new(), decoding());
        let context = context.context();
        let mut rest = &frame[12..];
        if is_opening {
            UAString::decode(&mut rest, &context).unwrap();
            ByteString::decode(&mut rest, &context).unwrap();
            ByteString::decode(&mut rest, &context).unwrap();
        } else {
            rest = &rest[4..];
        }
        let id = u32::from_le_bytes(rest[4..8].try_into().unwrap());
        rest = &rest[8..];
        let kind = NodeId::decode(&mut rest, &context).unwrap();
        let Ok(kind) = kind.as_object_id() else { return };
        let request = RequestMessage::decode_by_object_id(&mut rest, kind, &context).unwrap();
        lock(&self.script).requests.push(request.type_name());
        if let Some(answer) = self.answer_of(id, request) {
            self.send(if is_opening { b"OPN" } else { b"MSG" }, id, answer);
        }
    }

    fn answer_of(&mut self, id: u32, request: RequestMessage) -> Option<ResponseMessage> {
        let header = request.request_header().clone();
        let response_header = ResponseHeader::new_good(&header);
        let mut script = lock(&self.script);
        Some(match request {
            RequestMessage::OpenSecureChannel(_) => OpenSecureChannelResponse {
                response_header,
                server_protocol_version: 0,
                security_token: ChannelSecurityToken {
                    channel_id: 1,
                    token_id: 1,
                    created_at: DateTime::now(),
                    revised_lifetime: 3_600_000,
                },
                server_nonce: ByteString::null(),
            }
            .into(),
            RequestMessage::GetEndpoints(_) => {
                let mut endpoint = EndpointDescription::from((
                    format!("opc.tcp://127.0.0.1:{}/test", self.port).as_str(),
                    SecurityPolicy::None.to_uri(),
                    MessageSecurityMode::None,
                    UserTokenPolicy::anonymous(),
                ));
                endpoint.user_identity_tokens = Some(vec![UserTokenPolicy::anonymous()]);
                GetEndpointsResponse { response_header, endpoints: Some(vec![endpoint]) }.into()
            }
            RequestMessage::CreateSession(_) => CreateSessionResponse {
                response_header,
                session_id: NodeId::new(0, 1_u32),
                authentication_token: NodeId::new(0, 2_u32),
                revised_session_timeout: 60_000.0,
                ..CreateSessionResponse::default()
            }
            .into(),
            RequestMessage::ActivateSession(_) => {
                ActivateSessionResponse { response_header, ..ActivateSessionResponse::default() }
                    .into()
            }
            RequestMessage::CloseSession(_) => CloseSessionResponse { response_header }.into(),
            RequestMessage::Read(request) => {
                let nodes = request.nodes_to_read.unwrap_or_default();
                let results = nodes.iter().map(|node| script.read(&node.node_id)).collect();
                ReadResponse { response_header, results: Some(results), diagnostic_infos: None }
                    .into()
            }
            RequestMessage::CreateSubscription(_) => {
                script.subscription += 1;
                CreateSubscriptionResponse {
                    response_header,
                    subscription_id: script.subscription,
                    revised_publishing_interval: script.interval_millis,
                    revised_lifetime_count: 10_000,
                    revised_max_keep_alive_count: script.keep_alive_count,
                }
                .into()
            }
            RequestMessage::CreateMonitoredItems(request) => {
                let items = request.items_to_create.unwrap_or_default();
                for item in &items {
                    let node = item.item_to_monitor.node_id.to_string();
                    let handle = item.requested_parameters.client_handle;
                    script.handles.entry(node).or_default().push(handle);
                }
                let good = MonitoredItemCreateResult::default();
                CreateMonitoredItemsResponse {
                    response_header,
                    results: Some(vec![good; items.len()]),
                    diagnostic_infos: None,
                }
                .into()
            }
            RequestMessage::Publish(_) if self.waiting.len() >= script.max_publishes => {
                fault(&header, StatusCode::BadTooManyPublishRequests)
            }
            RequestMessage::Publish(_) => {
                self.waiting.push_back((id, header));
                return None;
            }
            RequestMessage::Republish(_) if script.holds_republish => return None,
            RequestMessage::Republish(request) => {
                match script.kept.get(&request.retransmit_sequence_number) {
                    Some(message) => {
                        RepublishResponse { response_header, notification_message: message.clone() }
                            .into()
                    }
                    None => fault(&header, StatusCode::BadMessageNotAvailable),
                }
            }
            RequestMessage::CloseSecureChannel(_) => return None,
            _ => fault(&header, StatusCode::BadServiceUnsupported),
        })
    }

    fn send(&mut self, kind: &[u8; 3], id: u32, answer: ResponseMessage) {
        let context = ContextOwned::new_default(NamespaceMap::new(), decoding());
        let context = context.context();
        let mut body = Vec::new();
        if kind == b"OPN" {
            UAString::from(SecurityPolicy::None.to_uri()).encode(&mut body, &context).unwrap();
            ByteString::null().encode(&mut body, &context).unwrap();
            ByteString::null().encode(&mut body, &context).unwrap();
        } else {
            body.extend(1_u32.to_le_bytes());
        }
        self.sequence += 1;
        body.extend(self.sequence.to_le_bytes());
        body.extend(id.to_le_bytes());
        answer.type_id().encode(&mut body, &context).unwrap();
        answer.encode(&mut body, &context).unwrap();
        let size = u32::try_from(12 + body.len()).unwrap();
        let head = [kind.as_slice(), b"F", &size.to_le_bytes(), &1_u32.to_le_bytes()].concat();
        let _ = self.stream.write_all(&[head, body].concat());
    }
}

fn fault(header: &RequestHeader, status: StatusCode) -> ResponseMessage {
    let response_header = ResponseHeader::new_service_result(header, status);
    ResponseMessage::ServiceFault(Box::new(ServiceFault { response_header }))
}

impl Script {
    fn read(&self, node: &NodeId) -> DataValue {
        match node.identifier {
            Identifier::Numeric(NAMESPACE_ARRAY) if node.namespace == 0 => {
                let uris: Vec<_> =
                    self.namespaces.iter().map(|uri| UAString::from(uri.as_str())).collect();
                value(uris)
            }
            Identifier::Numeric(SERVER_STATE) if node.namespace == 0 => value(self.state),
            _ => self.values.get(&node.to_string()).cloned().unwrap_or(DataValue {
                status: Some(StatusCode::BadNodeIdUnknown),
                ..DataValue::default()
            }),
        }
    }
}
