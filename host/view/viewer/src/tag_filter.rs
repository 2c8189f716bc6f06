//! Tag filter: the tags whose id, name or equipment contains all words of the query.

use std::sync::OnceLock;

use crate::search_index::SearchIndex;
use busbar_scene_loader::LoadedScene;

/// The tags that are listed.
#[derive(Debug, Default)]
pub(crate) struct TagFilter {
    /// Search index, built at the first query.
    text: OnceLock<SearchIndex>,
    /// Tags found; none without a query, when all are listed.
    found: Option<(Vec<u32>, bool)>,
    query: String,
}

impl TagFilter {
    /// Filters by the words of a query; an empty query lists all tags.
    pub(crate) fn filter(&mut self, query: &str, scene: &LoadedScene) {
        query.clone_into(&mut self.query);
        let asks = !query.trim().is_empty();
        let text = self.text.get_or_init(|| text_of(scene));
        self.found = asks.then(|| text.find(query));
    }

    /// The same list of another scene.
    pub(crate) fn for_scene(&self, scene: &LoadedScene) -> Self {
        let mut list = Self::default();
        if self.found.is_some() {
            list.filter(&self.query, scene);
        }
        list
    }

    pub(crate) fn len(&self, all: usize) -> usize {
        self.found.as_ref().map_or(all, |(found, _)| found.len())
    }

    /// The number of the tag in a row.
    pub(crate) fn tag(&self, row: usize) -> u32 {
        let found = self.found.as_ref().map(|(found, _)| found.get(row).copied());
        found.map_or(row as u32, |tag| tag.unwrap_or(u32::MAX))
    }

    pub(crate) fn is_truncated(&self) -> bool {
        self.found.as_ref().is_some_and(|(_, is_truncated)| *is_truncated)
    }
}

fn text_of(scene: &LoadedScene) -> SearchIndex {
    let mut text = SearchIndex::default();
    for (spec, tag) in scene.tags.specs().iter().zip(0..) {
        let node = scene.node_of(busbar_tags::TagHandle(tag));
        text.add([spec.id.as_str(), spec.name.as_str()].into_iter().chain(node.as_deref()));
    }
    text
}
