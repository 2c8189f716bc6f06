//! The nodes of a scene, packed: a site of a hundred stations has half a million.

use std::borrow::Cow;
use std::hash::{BuildHasher, RandomState};

use busbar_geometry::Bounds;
use glam::Mat4;
use hashbrown::HashTable;

use crate::EquipmentId;
use crate::graph::NodeIndex;

/// In place of an index: there is none.
const NONE: u32 = u32::MAX;

/// Texts one behind the other, by their number.
#[derive(Clone, Debug, Default)]
struct Texts {
    all: String,
    ends: Vec<u32>,
}

impl Texts {
    fn add(&mut self, text: &str) -> TextIndex {
        self.all.push_str(text);
        self.ends.push(self.all.len() as u32);
        TextIndex(self.ends.len() as u32 - 1)
    }

    fn get(&self, TextIndex(index): TextIndex) -> &str {
        let index = index as usize;
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.all[start as usize..self.ends[index] as usize]
    }
}

/// Index of a text that ids have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextIndex(u32);

/// What a node is called.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NodeName<'a> {
    /// By its own id.
    Placement(&'a str),
    /// By that of its placement, a slash, and the text.
    Part(NodeIndex, TextIndex),
}

#[derive(Clone, Copy, Debug)]
struct Record {
    parent: u32,
    /// The placement whose id goes before the text; none of a placement.
    placement: u32,
    text: TextIndex,
    transform: u32,
}

/// All nodes, parents before children.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nodes {
    records: Vec<Record>,
    bounds: Vec<Option<Bounds>>,
    /// Many nodes of a model stand where their parent does, and share its own.
    world_from_nodes: Vec<Mat4>,
    texts: Texts,
    /// Indices by the hash of their ids.
    by_id: HashTable<u32>,
    hasher: RandomState,
}

impl Nodes {
    /// With room for so many, of which some stand elsewhere than their parents, so that
    /// none is moved while they are added.
    pub(crate) fn with_capacity(count: usize, moved: usize) -> Self {
        Self {
            world_from_nodes: Vec::with_capacity(moved),
            records: Vec::with_capacity(count),
            bounds: Vec::with_capacity(count),
            by_id: HashTable::with_capacity(count),
            ..Self::default()
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.records.len()
    }

    /// A text for the names of parts.
    pub(crate) fn add_text(&mut self, text: &str) -> TextIndex {
        self.texts.add(text)
    }

    /// Adds a node.
    ///
    /// # Errors
    /// The first node that has its id.
    pub(crate) fn add(
        &mut self,
        name: NodeName<'_>,
        parent: Option<NodeIndex>,
        parent_from_node: &Mat4,
    ) -> Result<NodeIndex, NodeIndex> {
        let hash = self.hasher.hash_one(&*self.text_of(name));
        if let Some(&first) = self.by_id.find(hash, |&other| self.is_called(other, name)) {
            return Err(NodeIndex(first));
        }
        let index = self.records.len() as u32;
        let (placement, text) = match name {
            NodeName::Placement(id) => (NONE, self.texts.add(id)),
            NodeName::Part(NodeIndex(placement), text) => (placement, text),
        };
        let transform = self.transform_under(parent, parent_from_node);
        let parent = parent.map_or(NONE, |NodeIndex(parent)| parent);
        self.records.push(Record { parent, placement, text, transform });
        self.bounds.push(None);
        let Self { by_id, records, texts, hasher, .. } = self;
        by_id.insert_unique(hash, index, |&other| {
            hasher.hash_one(&*id_of(records, texts, other as usize))
        });
        Ok(NodeIndex(index))
    }

    fn transform_under(&mut self, parent: Option<NodeIndex>, parent_from_node: &Mat4) -> u32 {
        let of_parent = parent.map(|parent| self.records[parent.0 as usize].transform);
        if let (Some(shared), true) = (of_parent, *parent_from_node == Mat4::IDENTITY) {
            return shared;
        }
        let world_from_parent =
            of_parent.map_or(Mat4::IDENTITY, |transform| self.world_from_nodes[transform as usize]);
        self.world_from_nodes.push(world_from_parent * *parent_from_node);
        self.world_from_nodes.len() as u32 - 1
    }

    pub(crate) fn parent(&self, node: usize) -> Option<NodeIndex> {
        let parent = self.records[node].parent;
        (parent != NONE).then_some(NodeIndex(parent))
    }

    pub(crate) fn world_from_node(&self, node: usize) -> &Mat4 {
        &self.world_from_nodes[self.records[node].transform as usize]
    }

    pub(crate) fn bounds(&self, node: usize) -> Option<Bounds> {
        self.bounds[node]
    }

    pub(crate) fn bounds_mut(&mut self, node: usize) -> &mut Option<Bounds> {
        &mut self.bounds[node]
    }

    pub(crate) fn id(&self, node: usize) -> EquipmentId {
        id_of(&self.records, &self.texts, node).into_owned()
    }

    pub(crate) fn find(&self, id: &str) -> Option<NodeIndex> {
        let hash = self.hasher.hash_one(id);
        let name = NodeName::Placement(id);
        self.by_id.find(hash, |&node| self.is_called(node, name)).copied().map(NodeIndex)
    }

    /// The id that a name comes to.
    fn text_of<'a>(&'a self, name: NodeName<'a>) -> Cow<'a, str> {
        match name {
            NodeName::Placement(id) => Cow::Borrowed(id),
            NodeName::Part(NodeIndex(placement), text) => {
                let placement = self.texts.get(self.records[placement as usize].text);
                Cow::Owned(part_id(placement, self.texts.get(text)))
            }
        }
    }

    fn is_called(&self, node: u32, name: NodeName<'_>) -> bool {
        id_of(&self.records, &self.texts, node as usize) == self.text_of(name)
    }
}

/// The id of a node.
fn id_of<'a>(records: &[Record], texts: &'a Texts, node: usize) -> Cow<'a, str> {
    let Record { placement, text, .. } = records[node];
    let text = texts.get(text);
    if placement == NONE {
        return Cow::Borrowed(text);
    }
    Cow::Owned(part_id(texts.get(records[placement as usize].text), text))
}

fn part_id(placement: &str, part: &str) -> EquipmentId {
    format!("{placement}/{part}")
}
