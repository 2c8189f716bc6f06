//! Rules for placed nodes, those of templates at each place: unique ids, positions within bounds,
//! limits of nodes, and no recursive template.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashMap};

use serde_json::Value;

use crate::item_names::item_pointer;
use crate::report::Report;
use crate::world_transform::WorldTransform;
use crate::{MAX_NAME_BYTES, MAX_NODES, MAX_TEMPLATE_DEPTH, join_pointer, suggestions};

/// Equipment ids, each with the value that names it or its last part.
pub(crate) type Equipment<'d> = BTreeMap<Cow<'d, str>, &'d Value>;

/// Reports the faults of the scene as a whole and gives the ids in it.
pub(crate) fn check<'d>(document: &'d Value, report: &mut Report<'_>) -> Equipment<'d> {
    let mut walk = PlacementWalk {
        document,
        equipment: BTreeMap::new(),
        nodes: 0,
        open: Vec::new(),
        ids: OnceCell::new(),
        report,
    };
    walk.place_nodes(&document["scene"], "/scene", Some(WorldTransform::ROOT), "");
    if walk.nodes > MAX_NODES {
        // What is beyond in templates is not even counted: they may multiply.
        let more = if walk.is_cut() { "more than " } else { "" };
        let count = if walk.is_cut() { MAX_NODES } else { walk.nodes };
        walk.report.error(
            "/scene",
            format!("the scene has {more}{count} nodes; at most {MAX_NODES}"),
            "split the plant over several scenes",
        );
    }
    walk.equipment
}

struct PlacementWalk<'d, 'r, 'p> {
    document: &'d Value,
    equipment: Equipment<'d>,
    nodes: usize,
    /// Templates that are being placed, one within another.
    open: Vec<&'d str>,
    /// [`id_pointers`] of the document, as soon as a fault asked for it.
    ids: OnceCell<HashMap<*const Value, String>>,
    report: &'r mut Report<'p>,
}

impl<'d> PlacementWalk<'d, '_, '_> {
    /// Places nodes with their children. `parent` is `None` where it is unknown, for a fault
    /// above; `prefix` goes before the ids.
    fn place_nodes(
        &mut self,
        nodes: &'d Value,
        pointer: &str,
        parent: Option<WorldTransform>,
        prefix: &str,
    ) {
        for (index, node) in nodes.as_array().into_iter().flatten().enumerate() {
            if self.is_full() {
                return;
            }
            let pointer = join_pointer(pointer, index);
            let world = self.place(node, &pointer, parent, prefix);
            self.place_template(node, node, &pointer, world, prefix);
            let copies = node["instances"].as_array().into_iter().flatten();
            for (index, copy) in copies.enumerate() {
                let copy_pointer = join_pointer(&join_pointer(&pointer, "instances"), index);
                let world = self.place(copy, &copy_pointer, parent, prefix);
                self.place_template(node, copy, &pointer, world, prefix);
            }
            let children = join_pointer(&pointer, "children");
            self.place_nodes(&node["children"], &children, world, prefix);
        }
    }

    /// Reports whether a template exceeds the limit of nodes and is examined no further.
    fn is_full(&self) -> bool {
        self.nodes > MAX_NODES && !self.open.is_empty()
    }

    /// Reports whether some nodes were not counted.
    fn is_cut(&self) -> bool {
        self.document["templates"].as_object().is_some_and(|templates| !templates.is_empty())
    }

    /// Places the nodes of a node's template, if it has one, under it or a copy of it.
    fn place_template(
        &mut self,
        node: &'d Value,
        under: &'d Value,
        pointer: &str,
        world: Option<WorldTransform>,
        prefix: &str,
    ) {
        let (Some(name), Some(id)) = (node["template"].as_str(), under["id"].as_str()) else {
            return;
        };
        let Some(nodes) = self.document["templates"].get(name) else { return };
        let fault = if self.open.contains(&name) {
            Some(format!("the template '{}' is placed within itself", suggestions::shown(name)))
        } else if self.open.len() >= MAX_TEMPLATE_DEPTH {
            Some(format!("templates are placed more than {MAX_TEMPLATE_DEPTH} within one another"))
        } else {
            None
        };
        if let Some(cause) = fault {
            self.report.error(&join_pointer(pointer, "template"), cause, "name another, or none");
            return;
        }
        self.open.push(name);
        self.place_nodes(nodes, &item_pointer("templates", name), world, &format!("{prefix}{id}"));
        self.open.pop();
    }

    /// Places a node or instance; returns its world transform, unless that is invalid.
    fn place(
        &mut self,
        placement: &'d Value,
        pointer: &str,
        parent: Option<WorldTransform>,
        prefix: &str,
    ) -> Option<WorldTransform> {
        self.nodes += 1;
        self.note_id(&placement["id"], pointer, prefix);
        let world = parent?.place(&placement["transform"])?;
        let Some(fault) = world.fault() else {
            return Some(world);
        };
        // The first on its branch: all below it would be at fault with it.
        self.report.error_with(&join_pointer(pointer, "transform"), || fault.texts());
        None
    }

    fn note_id(&mut self, value: &'d Value, placement_pointer: &str, prefix: &str) {
        let Some(id) = value.as_str() else { return };
        let pointer = || join_pointer(placement_pointer, "id");
        let id = match prefix {
            "" => Cow::Borrowed(id),
            prefix => Cow::Owned(format!("{prefix}{id}")),
        };
        if !prefix.is_empty() && id.len() > MAX_NAME_BYTES {
            self.report.error_with(&pointer(), || {
                let length = id.len();
                let shown = suggestions::shown(&id);
                let cause = format!("placed, the equipment id '{shown}' has {length} bytes");
                (cause, format!("shorten what it is made of: at most {MAX_NAME_BYTES} in all"))
            });
        }
        match self.equipment.entry(id) {
            Entry::Vacant(entry) => {
                entry.insert(value);
            }
            Entry::Occupied(first) => {
                let (positions, document) = (self.report.positions(), self.document);
                self.report.error_with(&pointer(), || {
                    let ids = self.ids.get_or_init(|| id_pointers(document));
                    let at = ids.get(&std::ptr::from_ref(*first.get()));
                    let (line, column) = positions.locate(at.map_or("", String::as_str));
                    let cause = format!(
                        "the equipment id '{}' is used twice, first at line {line}, column {column}",
                        suggestions::shown(first.key())
                    );
                    (cause, "give one of the two another id".to_owned())
                });
            }
        }
    }
}

/// Maps the addresses of ids in a document to their JSON pointers; only error reports need it.
fn id_pointers(document: &Value) -> HashMap<*const Value, String> {
    fn note(value: &Value, pointer: String, pointers: &mut HashMap<*const Value, String>) {
        match value {
            Value::Array(elements) => {
                for (index, element) in elements.iter().enumerate() {
                    note(element, join_pointer(&pointer, index), pointers);
                }
            }
            Value::Object(members) => {
                for (key, member) in members {
                    note(member, join_pointer(&pointer, key), pointers);
                }
            }
            Value::String(_) if pointer.ends_with("/id") => {
                pointers.insert(value, pointer);
            }
            _ => (),
        }
    }
    let mut pointers = HashMap::new();
    note(document, String::new(), &mut pointers);
    pointers
}
