//! Attributes of many nodes, within the limits of a server (OPC 10000-4, 5.10.2).

use async_opcua::types::{
    AttributeId, DataValue, NodeId, ReadRequest, ReadValueId, StatusCode, TimestampsToReturn,
    Variant,
};

use crate::client::{Client, answer};
use crate::fault::Fault;

/// Attributes of one request, where the server allows that.
const MAX_BATCH: usize = 1000;
/// Node id of Server_ServerCapabilities_OperationLimits_MaxNodesPerRead (OPC 10000-6, Annex A).
const MAX_NODES_PER_READ: u32 = 11_705;
/// Node id of Server_ServerCapabilities_OperationLimits_MaxNodesPerBrowse (OPC 10000-6, Annex A).
const MAX_NODES_PER_BROWSE: u32 = 11_710;

/// Attribute reader that keeps the server's limit on a request.
pub(super) struct Reader<'a> {
    client: &'a Client,
    /// Most attributes of one request.
    batch: usize,
}

impl<'a> Reader<'a> {
    /// Creates a reader that keeps the server's limit. Returns also the limit of nodes that the
    /// server browses at once, where it has one.
    pub(super) async fn within_limits(client: &'a Client) -> Result<(Self, Option<usize>), Fault> {
        let mut reader = Self { client, batch: 1 };
        let limits = [MAX_NODES_PER_READ, MAX_NODES_PER_BROWSE]
            .map(|id| (NodeId::new(0, id), AttributeId::Value));
        let values = reader.read(&limits).await?;
        let mut limits = values.into_iter().map(|value| match value.value {
            Some(Variant::UInt32(limit)) if limit > 0 => Some(limit as usize),
            _ => None,
        });
        let of_read = limits.next().flatten();
        reader.batch = of_read.unwrap_or(MAX_BATCH).min(MAX_BATCH);
        Ok((reader, limits.next().flatten()))
    }

    /// Reads the wanted attributes, in as many requests as they need.
    pub(super) async fn read(
        &mut self,
        wanted: &[(NodeId, AttributeId)],
    ) -> Result<Vec<DataValue>, Fault> {
        let mut all = Vec::with_capacity(wanted.len());
        while all.len() < wanted.len() {
            let rest = &wanted[all.len()..];
            let batch = &rest[..rest.len().min(self.batch)];
            match self.batch_of(batch).await {
                Ok(values) => all.extend(values),
                Err(fault) if self.batch > 1 && fault.is_too_much() => self.batch /= 2,
                Err(fault) => return Err(fault),
            }
        }
        Ok(all)
    }

    async fn batch_of(&self, wanted: &[(NodeId, AttributeId)]) -> Result<Vec<DataValue>, Fault> {
        let client = self.client;
        let attribute = |(node_id, attribute): &(NodeId, AttributeId)| ReadValueId {
            node_id: node_id.clone(),
            attribute_id: *attribute as u32,
            ..ReadValueId::default()
        };
        let request = ReadRequest {
            request_header: client.header(client.limit()),
            max_age: 0.0,
            timestamps_to_return: TimestampsToReturn::Neither,
            nodes_to_read: Some(wanted.iter().map(attribute).collect()),
        };
        let values = answer!(client, "reading", Read, request)?.results.unwrap_or_default();
        if values.len() != wanted.len() {
            return Err(Fault::Server("reading has not as many results as were asked for"));
        }
        Ok(values)
    }
}

/// Returns the value, empty where there is none, or its bad status.
pub(super) fn given(value: DataValue) -> Result<Variant, StatusCode> {
    match (value.status.filter(|status| status.is_bad()), value.value) {
        (Some(status), _) => Err(status),
        (None, Some(value)) => Ok(value),
        (None, None) => Ok(Variant::Empty),
    }
}
