//! Point lists to tags, and tags to the nodes of a model.
//!
//! [`PointList::parse`] reads a list as CSV of any encoding (`list_text`) and layout
//! (`list_layout`), with every fault of it at once. The kind of a row is what its tool means
//! by the type name (`type_names`), decided by unit, scale and address (`type_decision`).
//! [`propose`] says which node of a model ([`Catalogue`]) each tag is of, by the words
//! that the field uses, with a confidence and a reason; what is in doubt it leaves
//! open. [`scene()`] and [`report`] word what came of it.
//!
//! A name is cut into words (`tokenizer`), read as facts (`fact_extraction`, by `designation`,
//! `phases` and the words of `lexicon`), and compared with each likely node (`node_comparison`).
//!
//! Invariant: text and names in, proposals out. No file is opened, and no protocol is
//! known: addresses pass through as they are.
#![doc = include_str!("../DESIGN.md")]

mod address;
mod catalogue;
mod column;
mod designation;
mod fact_extraction;
mod facts;
mod fault;
mod lexicon;
mod list;
mod list_layout;
mod list_text;
mod matching;
mod node_comparison;
mod number_style;
mod phases;
mod point;
pub mod report;
mod row;
mod scene;
mod tokenizer;
mod type_decision;
mod type_evidence;
mod type_name_table;
mod type_names;
mod unit_words;

pub use address::cell_value;
pub use catalogue::{Catalogue, MAX_NODES, NodeName, TooManyNodes};
pub use fault::{ListFault, MAX_FAULTS};
pub use list::{MAX_LIST_BYTES, MAX_POINTS, PointList};
pub use list_text::ListEncoding;
pub use matching::{
    Candidate, MAX_CANDIDATES, MAX_LISTED, MIN_CONFIDENCE, MIN_MARGIN, Proposal, TagName, propose,
};
pub use point::Point;
pub use scene::{FOV_DEGREES, PluginInstance, SceneParts, assign_plugins, place, scene, tags};
