//! Ids of nodes as text (OPC 10000-6, 5.3.1.10), with the namespace by index or URI.

use std::fmt;
use std::str::FromStr;

use async_opcua::types::{Identifier, NodeId};

/// The longest id, bytes.
const MAX_NODE_BYTES: usize = 4096;

/// A node whose namespace may still have to be found.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct NodeAddress {
    namespace: Namespace,
    identifier: Identifier,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Namespace {
    Index(u16),
    Uri(String),
}

impl NodeAddress {
    /// Reads `ns=2;s=Q1.P`, `nsu=urn:station;i=7`, `i=2258`.
    ///
    /// # Errors
    /// The fault of the text, and the right format.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let fault = || {
            format!(
                "'{}' is no node id: write ns=2;s=Name, nsu=URI;s=Name, or i=, g=, b= for a \
                 number, a GUID, base64",
                text.chars().take(80).collect::<String>()
            )
        };
        if text.len() > MAX_NODE_BYTES {
            return Err(format!("a node id has at most {MAX_NODE_BYTES} bytes"));
        }
        let (namespace, identifier) = match text.strip_prefix("nsu=") {
            Some(rest) => {
                let (uri, identifier) = rest.split_once(';').ok_or_else(fault)?;
                // A semicolon in a URI is escaped, and so is what escapes it.
                let uri = uri.replace("%3B", ";").replace("%3b", ";").replace("%25", "%");
                (Namespace::Uri(uri), identifier)
            }
            None => match text.strip_prefix("ns=") {
                Some(rest) => {
                    let (index, identifier) = rest.split_once(';').ok_or_else(fault)?;
                    (Namespace::Index(index.parse().map_err(|_| fault())?), identifier)
                }
                None => (Namespace::Index(0), text),
            },
        };
        // The library cuts after two bytes, wherever that is.
        let parsed = identifier.is_char_boundary(2).then(|| Identifier::from_str(identifier));
        let identifier = parsed.and_then(Result::ok).ok_or_else(fault)?;
        Ok(Self { namespace, identifier })
    }

    /// Resolves the id on a server with these namespaces; none where the server does not know the
    /// URI.
    pub(crate) fn resolve(&self, namespaces: &[String]) -> Option<NodeId> {
        let index = match &self.namespace {
            Namespace::Index(index) => *index,
            Namespace::Uri(uri) => {
                let index = namespaces.iter().position(|known| known == uri)?;
                u16::try_from(index).ok()?
            }
        };
        Some(NodeId { namespace: index, identifier: self.identifier.clone() })
    }

    /// Returns the namespace index of an address without a URI; none for 0, the standard's own.
    pub(crate) fn bare_index(&self) -> Option<u16> {
        match self.namespace {
            Namespace::Index(index) if index > 0 => Some(index),
            _ => None,
        }
    }

    /// Creates the address of a node by its namespace URI, which is stable over restarts of the
    /// server, unlike the index.
    pub(crate) fn lasting(node: &NodeId, namespaces: &[String]) -> Self {
        let uri = namespaces.get(usize::from(node.namespace)).filter(|_| node.namespace > 0);
        let namespace = match uri {
            Some(uri) => Namespace::Uri(uri.clone()),
            None => Namespace::Index(node.namespace),
        };
        Self { namespace, identifier: node.identifier.clone() }
    }
}

impl fmt::Display for NodeAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.namespace {
            Namespace::Index(0) => {}
            Namespace::Index(index) => write!(f, "ns={index};")?,
            Namespace::Uri(uri) => {
                write!(f, "nsu={};", uri.replace('%', "%25").replace(';', "%3B"))?;
            }
        }
        write!(f, "{}", self.identifier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_written_as_they_are_read() {
        for text in [
            "i=2258",
            "ns=2;s=S12D1Q3.P",
            "ns=3;s=a;b=c",
            "nsu=urn:station;i=7",
            "nsu=urn:a%3Bb%25c;s=x",
            "ns=1;g=09087e75-8e5e-499b-954f-f2a9603db28a",
            "ns=1;b=M/RbKBsRVkePCePcx24oRA==",
        ] {
            assert_eq!(NodeAddress::parse(text).unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_no_id_is_told() {
        for text in
            ["", "Q1.P", "ns=2", "ns=x;i=1", "ns=70000;i=1", "i=x", "nsu=urn:a", "g=1", "aé"]
        {
            assert!(NodeAddress::parse(text).unwrap_err().contains("is no node id"), "{text}");
        }
    }

    #[test]
    fn a_namespace_is_found_by_its_uri() {
        let namespaces = ["http://opcfoundation.org/UA/".to_owned(), "urn:a;b".to_owned()];
        let address = NodeAddress::parse("nsu=urn:a%3Bb;s=x").unwrap();
        let node = address.resolve(&namespaces).unwrap();
        assert_eq!(node, NodeId::new(1, "x"));
        assert_eq!(NodeAddress::lasting(&node, &namespaces), address);
        assert_eq!(address.resolve(&namespaces[..1]), None);
    }
}
