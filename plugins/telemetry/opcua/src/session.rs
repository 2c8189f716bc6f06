//! From a URL to a session that is activated (OPC 10000-4, 5.5 to 5.7).

use std::time::Duration;

use async_opcua::core::ResponseMessage;
use async_opcua::crypto::{SecurityPolicy, create_signature_data, random, verify_signature_data};
use async_opcua::types::{
    ActivateSessionRequest, ApplicationDescription, ApplicationType, AttributeId,
    CloseSessionRequest, CreateSessionRequest, CreateSessionResponse, DataValue,
    EndpointDescription, GetEndpointsRequest, LocalizedText, MessageSecurityMode, NodeId,
    NotificationMessage, ReadRequest, ReadValueId, RepublishRequest, SignatureData,
    TimestampsToReturn, UAString, UserTokenPolicy, Variant,
};

use crate::client::{Client, Driver, Opening, answer};
use crate::fault::Fault;
use crate::identity;
use crate::namespaces::MovedNamespace;
use crate::node::NodeAddress;
use crate::security::{Own, Protection, check_server, leaf, name_of};
use crate::settings::Config;
use crate::url::Url;
use crate::world::World;

/// Bytes of our nonce (OPC 10000-4, 5.7.2: at least 32).
const NONCE_BYTES: usize = 32;
/// Namespaces of a server.
const MAX_NAMESPACES: usize = 10_000;
/// Endpoints that are named in a message.
const MAX_NAMED: usize = 12;
/// Node id of Server_NamespaceArray (OPC 10000-6, Annex A).
const NAMESPACE_ARRAY: u32 = 2255;
/// Node id of Server_ServerStatus_State (OPC 10000-6, Annex A).
const SERVER_STATE: u32 = 2259;
/// Node id of Server_ServerCapabilities_OperationLimits_MaxMonitoredItemsPerCall.
const MAX_ITEMS_PER_CALL: u32 = 11_714;
/// Node id of Server_ServerCapabilities_OperationLimits_MaxNodesPerRead.
const MAX_NODES_PER_READ: u32 = 11_705;

/// Connects, checks who the server is, and activates a session.
pub(crate) async fn open(
    world: &World,
    config: &Config,
    server: &Url,
) -> Result<(Client, Driver), Fault> {
    let protection = Protection::from_files(config.security.as_ref());
    let own = load_own(config, protection)?;
    let endpoint = discover(world, config, server, protection).await?;
    if let Some(files) = &config.security {
        let certificate = leaf(&endpoint.server_certificate).map_err(Fault::Security)?;
        let application = endpoint.server.application_uri.as_ref();
        check_server(files, protection, &certificate, application).map_err(Fault::Security)?;
    }
    let opening = opening(world, config, server, endpoint.clone(), own.as_ref());
    let (client, mut driver) = opening.open().await?;
    driver.during(activate(&client, config, server, &endpoint, own.as_ref())).await?;
    Ok((client, driver))
}

fn load_own(config: &Config, protection: Protection) -> Result<Option<Own>, Fault> {
    let Some(files) = &config.security else { return Ok(None) };
    let own = Own::load(&files.certificate, &files.key).map_err(Fault::Security)?;
    own.check(protection.policy, &config.application_uri).map_err(Fault::Security)?;
    Ok(Some(own))
}

fn opening<'a>(
    world: &'a World,
    config: &Config,
    server: &'a Url,
    endpoint: EndpointDescription,
    own: Option<&'a Own>,
) -> Opening<'a> {
    Opening {
        dial: &*world.dial,
        server,
        endpoint,
        own,
        connect: config.connect_timeout,
        service: config.silence,
        lifetime: config.channel_lifetime,
    }
}

/// The endpoint that the settings ask for, as the server describes it.
async fn discover(
    world: &World,
    config: &Config,
    server: &Url,
    protection: Protection,
) -> Result<EndpointDescription, Fault> {
    let plain = EndpointDescription::from((
        server.text.as_str(),
        SecurityPolicy::None.to_uri(),
        MessageSecurityMode::None,
        UserTokenPolicy::anonymous(),
    ));
    let (client, mut driver) = opening(world, config, server, plain, None).open().await?;
    let request = GetEndpointsRequest {
        request_header: client.header(client.limit()),
        endpoint_url: server.text.as_str().into(),
        locale_ids: None,
        profile_uris: None,
    };
    let ask = async { answer!(client, "asking for endpoints", GetEndpoints, request) };
    let endpoints = driver.during(ask).await?.endpoints.unwrap_or_default();
    let fits = |endpoint: &&EndpointDescription| is_protected(endpoint, protection);
    let Some(found) = endpoints.iter().find(fits) else {
        return Err(no_endpoint(protection, &endpoints));
    };
    let mut found = found.clone();
    // The library takes one certificate, where a server may send a chain.
    if let Ok(certificate) = leaf(&found.server_certificate) {
        found.server_certificate = certificate.as_byte_string();
    }
    Ok(found)
}

fn is_protected(endpoint: &EndpointDescription, protection: Protection) -> bool {
    endpoint.security_mode == protection.mode
        && SecurityPolicy::from_uri(endpoint.security_policy_uri.as_ref()) == protection.policy
        && (endpoint.transport_profile_uri.is_empty()
            || endpoint.transport_profile_uri.as_ref().ends_with("uatcp-uasc-uabinary"))
}

fn no_endpoint(wanted: Protection, endpoints: &[EndpointDescription]) -> Fault {
    let name = |endpoint: &EndpointDescription| {
        name_of(endpoint.security_policy_uri.as_ref(), endpoint.security_mode)
    };
    let mut offered: Vec<_> = endpoints.iter().map(name).collect();
    offered.dedup();
    offered.truncate(MAX_NAMED);
    let offered = if offered.is_empty() { "nothing".into() } else { offered.join(", ") };
    Fault::NoEndpoint { wanted: wanted.in_words(), offered }
}

async fn activate(
    client: &Client,
    config: &Config,
    server: &Url,
    endpoint: &EndpointDescription,
    own: Option<&Own>,
) -> Result<(), Fault> {
    let nonce = random::byte_string(NONCE_BYTES);
    let request = CreateSessionRequest {
        request_header: client.header(client.limit()),
        client_description: ApplicationDescription {
            application_uri: config.application_uri.as_str().into(),
            product_uri: "urn:busbar".into(),
            application_name: LocalizedText::new("en", "Busbar"),
            application_type: ApplicationType::Client,
            ..ApplicationDescription::default()
        },
        server_uri: UAString::null(),
        endpoint_url: server.text.as_str().into(),
        session_name: "Busbar".into(),
        client_nonce: nonce.clone(),
        client_certificate: own.map(|own| own.certificate.as_byte_string()).unwrap_or_default(),
        requested_session_timeout: config.session_timeout.as_secs_f64() * 1000.0,
        max_response_message_size: 0,
    };
    let created = answer!(client, "creating a session", CreateSession, request)?;
    let protection = Protection::from_files(config.security.as_ref());
    check_created(&created, endpoint, own, protection, nonce.as_ref())?;
    client.set_session(&created.authentication_token);
    let client_signature = match own {
        None => SignatureData::null(),
        Some(own) => create_signature_data(
            &own.key,
            protection.policy,
            &endpoint.server_certificate,
            &created.server_nonce,
        )
        .map_err(|error| Fault::Security(error.to_string()))?,
    };
    let (user_identity_token, user_token_signature) =
        identity::token(&config.user, endpoint, protection, &created.server_nonce)?;
    let request = ActivateSessionRequest {
        request_header: client.header(client.limit()),
        client_signature,
        client_software_certificates: None,
        locale_ids: None,
        user_identity_token,
        user_token_signature,
    };
    answer!(client, "activating the session", ActivateSession, request).map(|_| ())
}

/// Checks that the server has its certificate's key and offers what was discovered without security
/// (OPC 10000-4, 5.7.2).
fn check_created(
    created: &CreateSessionResponse,
    endpoint: &EndpointDescription,
    own: Option<&Own>,
    protection: Protection,
    nonce: &[u8],
) -> Result<(), Fault> {
    let Some(own) = own else { return Ok(()) };
    let fault = |what: &str| Err(Fault::Security(what.to_owned()));
    let certificate = leaf(&created.server_certificate).map_err(Fault::Security)?;
    if certificate.as_byte_string() != endpoint.server_certificate {
        return fault("the server's certificate is another than the one that it showed before");
    }
    let (policy, signature) = (protection.policy, &created.server_signature);
    if verify_signature_data(signature, policy, &certificate, &own.certificate, nonce).is_err() {
        return fault("the server does not have the key of its certificate");
    }
    let mut offered = created.server_endpoints.iter().flatten();
    let is_same = |found: &EndpointDescription| {
        is_protected(found, protection)
            && found.user_identity_tokens == endpoint.user_identity_tokens
    };
    if !offered.any(is_same) {
        return fault(
            "the server offers other users' tokens than were discovered: somebody in between changed them",
        );
    }
    Ok(())
}

/// Properties and limits that the server reports of itself.
pub(crate) struct Server {
    pub(crate) namespaces: Vec<String>,
    /// Namespaces that have other indices than the addresses of tags were written by.
    pub(crate) moved: Vec<MovedNamespace>,
    /// Most monitored items of one request, where the server has a limit.
    pub(crate) items_per_call: Option<usize>,
    /// Most nodes that one request may read, where the server has a limit.
    pub(crate) nodes_per_read: Option<usize>,
    /// State of the server (OPC 10000-5, 12.6), where it tells one.
    pub(crate) state: Option<i32>,
}

impl Server {
    /// The namespace that an address names by its index alone, where that means another one
    /// than before.
    pub(crate) fn moved(&self, address: &NodeAddress) -> Option<&MovedNamespace> {
        let index = address.bare_index()?;
        self.moved.iter().find(|moved| moved.index == index)
    }
}

/// Asks for namespaces, limits, and the state.
pub(crate) async fn describe(client: &Client) -> Result<Server, Fault> {
    let nodes = [NAMESPACE_ARRAY, MAX_ITEMS_PER_CALL, MAX_NODES_PER_READ, SERVER_STATE];
    let values = match read(client, &nodes, client.limit()).await {
        Err(fault) if fault.is_too_much() => {
            // The limit is among what is asked for.
            let mut values = Vec::with_capacity(nodes.len());
            for node in nodes {
                values.extend(read(client, &[node], client.limit()).await?);
            }
            values
        }
        read => read?,
    };
    let mut values = values.into_iter();
    let namespaces = match values.next().and_then(|value| value.value) {
        Some(Variant::Array(array)) => {
            let texts = array.values.iter().take(MAX_NAMESPACES);
            texts.map(|text| text.to_string()).collect()
        }
        _ => return Err(Fault::Server("it does not tell its namespaces")),
    };
    let mut limit = || match values.next().and_then(|value| value.value) {
        Some(Variant::UInt32(limit)) if limit > 0 => Some(limit as usize),
        _ => None,
    };
    let (items_per_call, nodes_per_read) = (limit(), limit());
    let state = values.next().and_then(state_of);
    Ok(Server { namespaces, moved: Vec::new(), items_per_call, nodes_per_read, state })
}

/// The state of the server (OPC 10000-5, 12.6), as a sign of life.
pub(crate) async fn server_state(client: &Client, limit: Duration) -> Result<Option<i32>, Fault> {
    let values = read(client, &[SERVER_STATE], limit).await?;
    Ok(values.into_iter().next().and_then(state_of))
}

fn state_of(value: DataValue) -> Option<i32> {
    match value.value {
        Some(Variant::Int32(state)) => Some(state),
        _ => None,
    }
}

/// Reads the values of nodes anew, with their source times.
pub(crate) async fn read_values(
    client: &Client,
    nodes: &[NodeId],
    nodes_per_read: usize,
) -> Result<Vec<DataValue>, Fault> {
    let mut values = Vec::with_capacity(nodes.len());
    for some in nodes.chunks(nodes_per_read.max(1)) {
        let node = |node: &NodeId| ReadValueId {
            node_id: node.clone(),
            attribute_id: AttributeId::Value as u32,
            ..ReadValueId::default()
        };
        let request = ReadRequest {
            request_header: client.header(client.limit()),
            // As old as can be avoided.
            max_age: 0.0,
            timestamps_to_return: TimestampsToReturn::Source,
            nodes_to_read: Some(some.iter().map(node).collect()),
        };
        let answer = answer!(client, "reading values anew", Read, request)?;
        let results = answer.results.unwrap_or_default();
        if results.len() != some.len() {
            return Err(Fault::Server("another number of values than of nodes that were read"));
        }
        values.extend(results);
    }
    Ok(values)
}

/// Asks for a notification that is missing; none where the server does not have it.
pub(crate) async fn republish(
    client: &Client,
    subscription: u32,
    number: u32,
) -> Result<Option<NotificationMessage>, Fault> {
    let request = RepublishRequest {
        request_header: client.header(client.limit()),
        subscription_id: subscription,
        retransmit_sequence_number: number,
    };
    match answer!(client, "asking for a lost notification", Republish, request) {
        Ok(answer) => Ok(Some(answer.notification_message)),
        Err(Fault::Refused { .. }) => Ok(None),
        Err(fault) => Err(fault),
    }
}

/// Values of nodes of the standard's namespace.
async fn read(client: &Client, ids: &[u32], limit: Duration) -> Result<Vec<DataValue>, Fault> {
    let node = |id: &u32| ReadValueId {
        node_id: NodeId::new(0, *id),
        attribute_id: AttributeId::Value as u32,
        ..ReadValueId::default()
    };
    let request = ReadRequest {
        request_header: client.header(limit),
        max_age: 0.0,
        timestamps_to_return: TimestampsToReturn::Neither,
        nodes_to_read: Some(ids.iter().map(node).collect()),
    };
    let answer = answer!(client, "reading", Read, request, limit)?;
    Ok(answer.results.unwrap_or_default())
}

/// Says goodbye: servers have room for few sessions.
pub(crate) async fn close(client: &Client, limit: Duration) {
    let request =
        CloseSessionRequest { request_header: client.header(limit), delete_subscriptions: true };
    // Whatever the answer: the connection goes in any case.
    let _: Result<ResponseMessage, Fault> = client.call("closing", request, limit).await;
}
