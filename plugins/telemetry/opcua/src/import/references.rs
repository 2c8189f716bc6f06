//! The references of many nodes, within the limits of a server (OPC 10000-4, 5.8.2 and
//! 5.8.3).

use std::collections::BTreeMap;
use std::slice;

use async_opcua::types::{
    BrowseDescription, BrowseDirection, BrowseNextRequest, BrowseRequest, BrowseResult,
    BrowseResultMask, ByteString, NodeClass, NodeId, ReferenceDescription, ReferenceTypeId,
    StatusCode, ViewDescription,
};

use crate::client::{Client, answer};
use crate::fault::Fault;

/// References of all nodes that are asked for together.
const MAX_REFERENCES: usize = 400_000;
/// Nodes of one request, where the server allows that.
const MAX_BATCH: usize = 100;
/// References of one node in one answer, which the server is asked for at most.
const PAGE: u32 = 1000;
/// Answers that one request is continued by.
const MAX_PAGES: usize = 10_000;

/// References of a node, or the reason for which there are none.
pub(super) type References = Result<Vec<ReferenceDescription>, StatusCode>;

/// Direction in which a node's references are browsed.
#[derive(Clone, Copy)]
pub(super) enum Direction {
    Down,
    Properties,
    Supertype,
}

/// Browser of one server's references.
pub(super) struct Browser<'a> {
    client: &'a Client,
    pub(super) namespaces: &'a [String],
    /// Most nodes of one request.
    batch: usize,
}

impl<'a> Browser<'a> {
    /// `limit` is the server's MaxNodesPerBrowse, where it has one.
    pub(super) fn new(client: &'a Client, namespaces: &'a [String], limit: Option<usize>) -> Self {
        let batch = limit.map_or(MAX_BATCH, |limit| limit.clamp(1, MAX_BATCH));
        Self { client, namespaces, batch }
    }

    /// Returns the properties of one node, by browse name.
    pub(super) async fn properties_of(
        &mut self,
        node: &NodeId,
    ) -> Result<BTreeMap<String, NodeId>, Fault> {
        let (mut results, _) =
            self.references(slice::from_ref(node), Direction::Properties).await?;
        let references = results.pop().and_then(Result::ok).unwrap_or_default();
        let named = references.iter().filter_map(|reference| {
            Some((reference.browse_name.name.to_string(), self.here(reference)?))
        });
        Ok(named.collect())
    }

    /// Returns the supertype of a data type.
    pub(super) async fn supertype(&mut self, node: &NodeId) -> Result<Option<NodeId>, Fault> {
        let (mut results, _) = self.references(slice::from_ref(node), Direction::Supertype).await?;
        let references = results.pop().and_then(Result::ok).unwrap_or_default();
        Ok(references.first().and_then(|reference| self.here(reference)))
    }

    /// Returns a reference's target on this server; none for one of another server.
    pub(super) fn here(&self, reference: &ReferenceDescription) -> Option<NodeId> {
        let id = &reference.node_id;
        if id.server_index != 0 {
            return None;
        }
        if id.namespace_uri.is_empty() {
            return Some(id.node_id.clone());
        }
        let uri = id.namespace_uri.as_ref();
        let index = self.namespaces.iter().position(|known| known == uri)?;
        let namespace = u16::try_from(index).ok()?;
        Some(NodeId { namespace, identifier: id.node_id.identifier.clone() })
    }

    /// The references of each node, or why there are none; and whether some were left out,
    /// of so many.
    pub(super) async fn references(
        &mut self,
        nodes: &[NodeId],
        direction: Direction,
    ) -> Result<(Vec<References>, bool), Fault> {
        let mut all: Vec<References> = Vec::with_capacity(nodes.len());
        let mut count = 0;
        while all.len() < nodes.len() {
            if count > MAX_REFERENCES {
                all.resize_with(nodes.len(), || Ok(Vec::new()));
                return Ok((all, true));
            }
            let rest = &nodes[all.len()..];
            let batch = &rest[..rest.len().min(self.batch)];
            let mut results = match self.batch_of(batch, direction).await {
                Err(fault) if self.may_ask_for_less(&fault) => continue,
                results => results?,
            };
            // A server has few places to go on from: those that found none are asked alone.
            for (node, result) in batch.iter().zip(&mut results) {
                let has_no_place =
                    matches!(result, Err(status) if *status == StatusCode::BadNoContinuationPoints);
                if has_no_place && batch.len() > 1 {
                    let alone = self.batch_of(slice::from_ref(node), direction).await?;
                    *result = alone.into_iter().next().unwrap_or_else(|| Ok(Vec::new()));
                }
            }
            count += results.iter().flatten().map(Vec::len).sum::<usize>();
            all.extend(results);
        }
        Ok((all, false))
    }

    /// Halves the batch size after a request that was too large; reports whether a smaller one may
    /// be tried.
    fn may_ask_for_less(&mut self, fault: &Fault) -> bool {
        let may = self.batch > 1 && fault.is_too_much();
        if may {
            self.batch /= 2;
        }
        may
    }

    /// Sends one browse request and reads all of its continuation points.
    async fn batch_of(
        &self,
        nodes: &[NodeId],
        direction: Direction,
    ) -> Result<Vec<References>, Fault> {
        let client = self.client;
        let request = BrowseRequest {
            request_header: client.header(client.limit()),
            view: ViewDescription::default(),
            requested_max_references_per_node: PAGE,
            nodes_to_browse: Some(
                nodes.iter().map(|node| direction.browse_description(node)).collect(),
            ),
        };
        let answer = answer!(client, "browsing", Browse, request)?;
        let mut all: Vec<References> = Vec::with_capacity(nodes.len());
        let mut open: Vec<(usize, ByteString)> = Vec::new();
        let results = answer.results.unwrap_or_default();
        if results.len() != nodes.len() {
            return Err(Fault::Server("browsing has not as many results as were asked for"));
        }
        for (index, result) in results.into_iter().enumerate() {
            all.push(Ok(Vec::new()));
            take(index, result, &mut all, &mut open);
        }
        for _ in 0..MAX_PAGES {
            if open.is_empty() {
                return Ok(all);
            }
            let now: Vec<_> = open.drain(..open.len().min(self.batch)).collect();
            let request = BrowseNextRequest {
                request_header: client.header(client.limit()),
                release_continuation_points: false,
                continuation_points: Some(now.iter().map(|(_, point)| point.clone()).collect()),
            };
            let answer = answer!(client, "browsing on", BrowseNext, request)?;
            let results = answer.results.unwrap_or_default();
            if results.len() != now.len() {
                return Err(Fault::Server("browsing on has not as many results as were asked for"));
            }
            for ((index, _), result) in now.into_iter().zip(results) {
                take(index, result, &mut all, &mut open);
            }
            let count: usize = all.iter().flatten().map(Vec::len).sum();
            if count > MAX_REFERENCES {
                break;
            }
        }
        Err(Fault::Server("its nodes have references without end"))
    }
}

/// Adds a result to that of its node.
fn take(
    index: usize,
    result: BrowseResult,
    all: &mut [References],
    open: &mut Vec<(usize, ByteString)>,
) {
    if result.status_code.is_bad() {
        all[index] = Err(result.status_code);
        return;
    }
    if let Ok(references) = &mut all[index] {
        references.extend(result.references.unwrap_or_default());
    }
    if !result.continuation_point.as_ref().is_empty() {
        open.push((index, result.continuation_point));
    }
}

impl Direction {
    fn browse_description(self, node: &NodeId) -> BrowseDescription {
        let (browse_direction, kind, classes) = match self {
            Self::Down => (
                BrowseDirection::Forward,
                ReferenceTypeId::HierarchicalReferences,
                NodeClass::Object as u32 | NodeClass::Variable as u32,
            ),
            Self::Properties => (BrowseDirection::Forward, ReferenceTypeId::HasProperty, 0),
            Self::Supertype => (BrowseDirection::Inverse, ReferenceTypeId::HasSubtype, 0),
        };
        BrowseDescription {
            node_id: node.clone(),
            browse_direction,
            reference_type_id: kind.into(),
            include_subtypes: true,
            node_class_mask: classes,
            result_mask: BrowseResultMask::All as u32,
        }
    }
}
