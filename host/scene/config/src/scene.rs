//! The nodes of the scene, one after the other, those of templates at each place.

use std::collections::BTreeMap;
use std::rc::Rc;

use crate::item_names::item_pointer;
use crate::join_pointer;
use crate::raw::{RawNode, RawScale, RawTransform};
use crate::theta::ThetaConfig;

/// Equipment shown. Its nodes are generated on demand, since templates may stand for very many.
#[derive(Clone, Debug, Default)]
pub struct SceneConfig {
    nodes: Vec<RawNode>,
    templates: BTreeMap<String, Vec<RawNode>>,
}

impl SceneConfig {
    /// The rules have been checked.
    pub(crate) fn new(nodes: Vec<RawNode>, templates: BTreeMap<String, Vec<RawNode>>) -> Self {
        Self { nodes, templates }
    }

    /// Iterates over all nodes, parents before children, instances as nodes of their own.
    pub fn iter(&self) -> SceneNodes<'_> {
        let list = NodeList { nodes: &self.nodes, next: 0, parent: None, pointer: "/scene".into() };
        let empty = Rc::from("");
        SceneNodes {
            templates: &self.templates,
            count: 0,
            open: vec![(PendingStep::Nodes(list), empty)],
        }
    }
}

impl<'a> IntoIterator for &'a SceneConfig {
    type Item = NodeConfig;
    type IntoIter = SceneNodes<'a>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Iterator over the nodes of a scene.
#[derive(Clone, Debug)]
pub struct SceneNodes<'a> {
    templates: &'a BTreeMap<String, Vec<RawNode>>,
    /// Nodes given so far.
    count: usize,
    /// Stack of pending steps, the next one last, each with the prefix of its ids. Its depth is
    /// bounded by the rules for nested templates and text.
    open: Vec<(PendingStep<'a>, Rc<str>)>,
}

#[derive(Clone, Debug)]
enum PendingStep<'a> {
    /// The rest of a list of nodes.
    Nodes(NodeList<'a>),
    /// The rest of a node's copies.
    Copies(NodeCopies<'a>),
    /// The template of a node, under it and its copies, from a copy on.
    Templates(NodeCopies<'a>),
}

#[derive(Clone, Debug)]
struct NodeList<'a> {
    nodes: &'a [RawNode],
    next: usize,
    parent: Option<usize>,
    pointer: Rc<str>,
}

/// A node with its instances; copy 0 is itself.
#[derive(Clone, Debug)]
struct NodeCopies<'a> {
    node: &'a RawNode,
    next: usize,
    /// Index of the node in the scene.
    index: usize,
    parent: Option<usize>,
    pointer: Rc<str>,
}

impl<'a> NodeCopies<'a> {
    fn next_copy(&mut self) -> Option<usize> {
        (self.next <= self.node.instances.len()).then(|| {
            self.next += 1;
            self.next - 1
        })
    }

    fn config(&self, copy: usize, prefix: &str) -> NodeConfig {
        let RawNode { model, theta, transform: own, .. } = self.node;
        let instance = copy.checked_sub(1).map(|index| (index, &self.node.instances[index]));
        let (transform_of, pointer, own_theta) = match instance {
            None => (own, self.pointer.to_string(), None),
            Some((index, instance)) => {
                let instances = join_pointer(&self.pointer, "instances");
                let pointer = join_pointer(&instances, index);
                (&instance.transform, pointer, instance.theta.as_ref())
            }
        };
        NodeConfig {
            id: format!("{prefix}{}", self.id(copy)),
            parent: self.parent,
            transform: transform(transform_of),
            model: model.clone(),
            theta: own_theta.or(theta.as_ref()).map(|theta| theta.clone().resolve()),
            pointer,
        }
    }

    fn id(&self, copy: usize) -> &'a str {
        match copy.checked_sub(1) {
            None => &self.node.id,
            Some(index) => &self.node.instances[index].id,
        }
    }
}

impl Iterator for SceneNodes<'_> {
    type Item = NodeConfig;

    fn next(&mut self) -> Option<NodeConfig> {
        loop {
            let (step, prefix) = self.open.last_mut()?;
            let prefix = Rc::clone(prefix);
            match step {
                PendingStep::Nodes(list) => match list.nodes.get(list.next) {
                    Some(node) => {
                        let pointer = Rc::from(join_pointer(&list.pointer, list.next));
                        list.next += 1;
                        let parent = list.parent;
                        self.begin(node, parent, pointer, prefix);
                    }
                    None => drop(self.open.pop()),
                },
                PendingStep::Copies(copies) => match copies.next_copy() {
                    Some(copy) => {
                        self.count += 1;
                        return Some(copies.config(copy, &prefix));
                    }
                    None => drop(self.open.pop()),
                },
                PendingStep::Templates(copies) => match copies.next_copy() {
                    Some(copy) => {
                        let prefix = Rc::from(format!("{prefix}{}", copies.id(copy)));
                        let (node, under) = (copies.node, copies.index + copy);
                        self.begin_template(node, under, prefix);
                    }
                    None => drop(self.open.pop()),
                },
            }
        }
    }
}

impl<'a> SceneNodes<'a> {
    /// A node, its instances, its template under each, then its children.
    fn begin(
        &mut self,
        node: &'a RawNode,
        parent: Option<usize>,
        pointer: Rc<str>,
        prefix: Rc<str>,
    ) {
        let index = self.count;
        let children = NodeList {
            nodes: &node.children,
            next: 0,
            parent: Some(index),
            pointer: join_pointer(&pointer, "children").into(),
        };
        let copies = NodeCopies { node, next: 0, index, parent, pointer };
        self.open.push((PendingStep::Nodes(children), Rc::clone(&prefix)));
        if node.template.is_some() {
            self.open.push((PendingStep::Templates(copies.clone()), Rc::clone(&prefix)));
        }
        self.open.push((PendingStep::Copies(copies), prefix));
    }

    fn begin_template(&mut self, node: &'a RawNode, under: usize, prefix: Rc<str>) {
        let name = node.template.as_deref().unwrap_or_default();
        let Some(nodes) = self.templates.get(name) else { return };
        let pointer = item_pointer("templates", name).into();
        let list = NodeList { nodes, next: 0, parent: Some(under), pointer };
        self.open.push((PendingStep::Nodes(list), prefix));
    }
}

fn transform(raw: &RawTransform) -> TransformConfig {
    TransformConfig {
        translation: raw.translation,
        rotation_degrees: raw.rotation_degrees,
        scale: match raw.scale {
            RawScale::Uniform(factor) => [factor; 3],
            RawScale::PerAxis(factors) => factors,
        },
    }
}

/// A piece of equipment in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeConfig {
    /// Equipment id, used once in the scene.
    pub id: String,
    /// Index of the node it hangs under, an earlier one.
    pub parent: Option<usize>,
    /// Transform to the parent's space.
    pub transform: TransformConfig,
    /// Name of the model shown here.
    pub model: Option<String>,
    /// Theta of the node; none where the model's applies.
    pub theta: Option<ThetaConfig>,
    /// JSON pointer of the node.
    pub pointer: String,
}

/// Scale, then rotate about x, y and z in turn, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformConfig {
    /// Translation of the node, metres.
    pub translation: [f64; 3],
    /// Degrees about x, y and z.
    pub rotation_degrees: [f32; 3],
    /// Factors along x, y and z; none is zero.
    pub scale: [f32; 3],
}

impl Default for TransformConfig {
    fn default() -> Self {
        Self { translation: [0.0; 3], rotation_degrees: [0.0; 3], scale: [1.0; 3] }
    }
}
