//! Choice of one of a file's scenes (glTF 2.0, section 3.5.1).

use std::fmt;

use crate::document::{Document, shortened};
use crate::error::{ImportError, ImportFault};
use crate::names::clean_name;
use crate::report::Notes;
use crate::schema::Scene;

/// Scene to import: by name, or by index from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneChoice {
    /// Scene of this name; the first one of several.
    Name(String),
    /// Scene at this place in the file.
    Index(u32),
}

impl fmt::Display for SceneChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "'{}'", shortened(name)),
            Self::Index(index) => write!(f, "{index}"),
        }
    }
}

/// Scenes that a message lists.
const MAX_LISTED: usize = 20;

/// Finds the index of the chosen scene. Scenes that cannot be read have no name.
pub(crate) fn find(
    document: &Document<'_>,
    choice: &SceneChoice,
    notes: &mut Notes,
) -> Result<usize, ImportError> {
    let count = document.scenes.len();
    let name_of = |index: usize| {
        let scene: Option<Scene<'_>> = document.scenes.parse(index, String::new).ok();
        scene.and_then(|scene| scene.name.0)
    };
    match choice {
        SceneChoice::Index(index) if (*index as usize) < count => return Ok(*index as usize),
        SceneChoice::Index(_) => {}
        SceneChoice::Name(wanted) => {
            let is_named = |index: &usize| {
                name_of(*index).is_some_and(|name| name == *wanted || clean_name(&name) == *wanted)
            };
            let mut named = (0..count).filter(is_named);
            if let Some(first) = named.next() {
                if named.next().is_some() {
                    notes.add("scenes of the chosen name: the first one is shown");
                }
                return Ok(first);
            }
        }
    }
    let listed = (0..count.min(MAX_LISTED)).map(|index| {
        let name = name_of(index).map(|name| clean_name(&name)).filter(|name| !name.is_empty());
        name.map_or_else(|| index.to_string(), |name| format!("'{name}'"))
    });
    let mut scenes = listed.collect::<Vec<_>>().join(", ");
    match count {
        0 => scenes.push_str("none"),
        _ if count > MAX_LISTED => scenes += &format!(" and {} more", count - MAX_LISTED),
        _ => {}
    }
    Err(ImportFault::NoScene { choice: choice.to_string(), scenes }.at("/scenes"))
}
