//! Size of an IED's model with its types expanded, computed before the expansion. Types of types
//! multiply, and a short file may claim more than memory holds.

use std::collections::HashMap;

use roxmltree::{Document, Node};

/// Data objects and attributes of one IED. Large ones have some 100,000.
const MAX_PARTS: u64 = 2_000_000;
/// Types in each other, as deep as IEC 61850-7-3 goes several times over.
const MAX_LEVELS: usize = 24;

/// Checks the types that an IED uses; of the first one, if none is named.
///
/// # Errors
/// In words: it is no XML, or a type is within itself, or there is too much of it.
pub(super) fn check(text: &str, ied: Option<&str>) -> Result<(), String> {
    let document = Document::parse(text).map_err(|error| format!("it is no SCL file: {error}"))?;
    let root = document.root_element();
    let Some(ied) =
        named(root, "IED").find(|node| ied.is_none_or(|name| node.attribute("name") == Some(name)))
    else {
        return Ok(());
    };
    let mut types = Types::from_root(root);
    let mut total = 0_u64;
    for node in ied.descendants().filter(|node| matches!(node.tag_name().name(), "LN" | "LN0")) {
        let parts = node.attribute("lnType").map(|id| types.parts("LNodeType", id, 0));
        total = total.saturating_add(parts.transpose()?.unwrap_or_default());
    }
    if total > MAX_PARTS {
        return Err(format!("the IED has {total} data; at most {MAX_PARTS} are read"));
    }
    Ok(())
}

/// The types of a file, and how many parts each has.
struct Types<'a> {
    nodes: HashMap<(&'a str, &'a str), Node<'a, 'a>>,
    /// Nothing while it is being counted.
    parts: HashMap<(&'a str, &'a str), Option<u64>>,
}

impl<'a> Types<'a> {
    fn from_root(root: Node<'a, 'a>) -> Self {
        let all = named(root, "DataTypeTemplates").flat_map(|templates| templates.children());
        let keyed =
            all.filter_map(|node| Some(((node.tag_name().name(), node.attribute("id")?), node)));
        Self { nodes: keyed.collect(), parts: HashMap::new() }
    }

    fn parts(&mut self, kind: &'static str, id: &'a str, level: usize) -> Result<u64, String> {
        let key = (kind, id);
        match self.parts.get(&key) {
            Some(Some(parts)) => return Ok(*parts),
            Some(None) => return Err(format!("{kind} '{id}' is within itself")),
            None if level > MAX_LEVELS => {
                return Err(format!("{kind} '{id}': types are more than {MAX_LEVELS} levels deep"));
            }
            None => {}
        }
        // One that is not there is told when the model is read.
        let Some(node) = self.nodes.get(&key).copied() else { return Ok(0) };
        self.parts.insert(key, None);
        let mut parts = 1_u64;
        for child in node.children() {
            let of = match child.tag_name().name() {
                "DO" | "SDO" => "DOType",
                "DA" | "BDA" => "DAType",
                _ => continue,
            };
            let below = child.attribute("type").map(|id| self.parts(of, id, level + 1));
            parts = parts.saturating_add(below.transpose()?.unwrap_or_default().max(1));
        }
        self.parts.insert(key, Some(parts));
        Ok(parts)
    }
}

fn named<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}
