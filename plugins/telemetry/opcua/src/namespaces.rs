//! Namespaces of a server over its restarts (OPC 10000-3, 8.2.2). An index may mean another URI
//! afterwards; addresses by that index would then name other nodes.

use std::collections::BTreeMap;

/// Namespaces that are remembered of one server, and servers.
const MAX_REMEMBERED: usize = 10_000;
/// The server's own namespace: its URI differs between servers of a redundant set.
const OWN_INDEX: u16 = 1;

/// An index whose URI changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MovedNamespace {
    pub(crate) index: u16,
    was: String,
    /// Present URI of the index; none where the server no longer has such a namespace.
    is: Option<String>,
}

impl MovedNamespace {
    /// Describes the change and the remedy.
    pub(crate) fn in_words(&self) -> String {
        let Self { index, was, is } = self;
        let now = is.as_ref().map_or("is gone".to_owned(), |is| format!("is now '{is}'"));
        format!(
            "namespace {index} was '{was}' and {now}: write nsu=URI in place of ns={index}, then \
             reload"
        )
    }
}

/// URIs that indices meant first, by which addresses were written.
#[derive(Debug, Default)]
pub(crate) struct NamespaceMemory {
    shared: BTreeMap<u16, String>,
    /// URI of the own namespace (index 1) of each server.
    own: BTreeMap<String, String>,
}

impl NamespaceMemory {
    /// Compares the namespaces of a server with those that it, or another one of its set, had
    /// first; remembers those that are new.
    pub(crate) fn compare(&mut self, server: &str, namespaces: &[String]) -> Vec<MovedNamespace> {
        let mut moved = Vec::new();
        for (index, uri) in (0_u16..).zip(namespaces).skip(1).take(MAX_REMEMBERED) {
            let was = if index == OWN_INDEX {
                self.own.entry(server.to_owned()).or_insert_with(|| uri.clone())
            } else {
                self.shared.entry(index).or_insert_with(|| uri.clone())
            };
            if was != uri {
                moved.push(MovedNamespace { index, was: was.clone(), is: Some(uri.clone()) });
            }
        }
        let own = self.own.get(server).map(|uri| (OWN_INDEX, uri));
        let known = own.into_iter().chain(self.shared.iter().map(|(index, uri)| (*index, uri)));
        for (index, uri) in known.filter(|(index, _)| usize::from(*index) >= namespaces.len()) {
            moved.push(MovedNamespace { index, was: uri.clone(), is: None });
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uris(uris: &[&str]) -> Vec<String> {
        uris.iter().map(|uri| (*uri).to_owned()).collect()
    }

    fn indices(moved: &[MovedNamespace]) -> Vec<u16> {
        moved.iter().map(|moved| moved.index).collect()
    }

    #[test]
    fn indices_that_move_are_found_until_they_are_back() {
        let mut memory = NamespaceMemory::default();
        let first = uris(&["ua", "urn:server", "urn:a", "urn:b"]);
        assert_eq!(memory.compare("x", &first), []);
        assert_eq!(memory.compare("x", &first), []);
        let moved = memory.compare("x", &uris(&["ua", "urn:server", "urn:b", "urn:a", "urn:c"]));
        assert_eq!(indices(&moved), [2, 3]);
        let words = moved[0].in_words();
        assert!(words.contains("namespace 2 was 'urn:a' and is now 'urn:b'"), "{words}");
        let moved = memory.compare("x", &uris(&["ua", "urn:server", "urn:a"]));
        assert_eq!(indices(&moved), [3, 4]);
        assert!(moved[0].in_words().contains("is gone"));
        assert_eq!(memory.compare("x", &first[..3]).len(), 2);
        assert_eq!(indices(&memory.compare("x", &first)), [4]);
    }

    #[test]
    fn servers_of_a_set_differ_in_their_own_namespace_alone() {
        let mut memory = NamespaceMemory::default();
        assert_eq!(memory.compare("x", &uris(&["ua", "urn:x", "urn:a"])), []);
        assert_eq!(memory.compare("y", &uris(&["ua", "urn:y", "urn:a"])), []);
        assert_eq!(indices(&memory.compare("y", &uris(&["ua", "urn:z", "urn:b"]))), [1, 2]);
    }
}
