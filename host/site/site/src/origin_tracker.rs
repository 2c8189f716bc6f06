//! Origins of the values of a site, now and in the last hours: live, or
//! substituted, under test, simulated, recorded, historical.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use busbar_config::Config;
use busbar_history::History;
use busbar_tags::{Moment, Snapshot, TagHandle, TagSet};
use busbar_types::Origin;

use crate::definition::SiteDefinition;

/// Changes of origin that are kept of one tag; older ones are joined.
const MAX_CHANGES: usize = 256;

/// All origins except live, one by one.
const KINDS: [Origin; 5] =
    [Origin::SUBSTITUTED, Origin::TEST, Origin::SIMULATED, Origin::RECORDED, Origin::HISTORICAL];

/// Interval in which a tag's value was not live.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OriginInterval {
    /// Start of the interval.
    pub start: Moment,
    /// End of the interval.
    pub end: Moment,
    /// Origins of the value in the interval.
    pub origin: Origin,
}

/// Origins of all tags. Its cost in a step is that of the tags that changed.
#[derive(Debug, Default)]
pub struct OriginTracker {
    /// Configuration that is tracked; none before the first step.
    config: Option<Arc<Config>>,
    tags: Option<Arc<TagSet>>,
    of_tags: Vec<Origin>,
    /// Tags of each of [`KINDS`].
    counts: [usize; KINDS.len()],
    /// Origins of tags with a history that were not live, each from an instant on.
    past: HashMap<TagHandle, VecDeque<(Moment, Origin)>>,
    /// Instant of the last step.
    last: Option<Moment>,
}

impl OriginTracker {
    /// Follows the tags of a site to the snapshot of a step.
    pub(crate) fn follow(
        &mut self,
        site: &SiteDefinition,
        snapshot: Snapshot<'_>,
        history: &History,
        now: Moment,
    ) {
        // Changes of a step came since the one before; nothing is known of before the first.
        let since = self.last.replace(now).unwrap_or(now);
        let goes_on = self.config.as_ref().is_some_and(|own| Arc::ptr_eq(own, &site.config));
        if goes_on {
            for &tag in snapshot.changed() {
                if let Some(state) = snapshot.state(tag) {
                    self.set(tag, state.origin, history, since);
                }
            }
            return;
        }
        self.take_definition(site);
        let states = snapshot.states().zip(0..);
        states.for_each(|(state, tag)| self.set(TagHandle(tag), state.origin, history, since));
    }

    /// Adopts another configuration; past origins of tags are matched by id.
    fn take_definition(&mut self, site: &SiteDefinition) {
        let before = self.tags.replace(Arc::clone(&site.tags));
        self.config = Some(Arc::clone(&site.config));
        self.of_tags = vec![Origin::LIVE; site.tags.specs().len()];
        self.counts = Default::default();
        let Some(before) = before else { return };
        let past = std::mem::take(&mut self.past);
        let renumbered = past.into_iter().filter_map(|(tag, past)| {
            let index = before.specs().get(tag.0 as usize).map(|spec| &spec.id)?;
            let tag = site.tags.specs().iter().position(|spec| spec.id == *index)?;
            Some((TagHandle(tag as u32), past))
        });
        self.past = renumbered.collect();
        let last = self.past.iter().filter_map(|(tag, past)| Some((*tag, past.back()?.1)));
        // As it was last: then a change to live is noted, too.
        let last: Vec<(TagHandle, Origin)> = last.collect();
        for (tag, origin) in last {
            self.of_tags[tag.0 as usize] = origin;
            self.count(origin, true);
        }
    }

    fn set(&mut self, tag: TagHandle, origin: Origin, history: &History, since: Moment) {
        let Some(own) = self.of_tags.get_mut(tag.0 as usize) else { return };
        let before = std::mem::replace(own, origin);
        if before == origin {
            return;
        }
        self.count(before, false);
        self.count(origin, true);
        if !history.has(tag) {
            return;
        }
        let past = self.past.entry(tag).or_default();
        past.push_back((since, origin));
        if past.len() > MAX_CHANGES
            && let Some((first, oldest)) = past.pop_front()
            && let Some((start, next)) = past.front_mut()
        {
            (*start, *next) = (first, *next | oldest);
        }
    }

    fn count(&mut self, origin: Origin, adds: bool) {
        for (count, kind) in self.counts.iter_mut().zip(KINDS) {
            if origin.contains(kind) {
                *count = if adds { *count + 1 } else { count.saturating_sub(1) };
            }
        }
    }

    /// Origins of any tag's value.
    pub fn shown(&self) -> Origin {
        let found = KINDS.into_iter().zip(self.counts).filter(|(_, count)| *count > 0);
        found.fold(Origin::LIVE, |all, (kind, _)| all | kind)
    }

    /// Times from an instant until now in which a tag's value was not live, in order.
    pub fn between(&self, tag: TagHandle, from: Moment, now: Moment) -> Vec<OriginInterval> {
        let Some(past) = self.past.get(&tag) else { return Vec::new() };
        let ends = past.iter().skip(1).map(|(since, _)| *since).chain([now]);
        let spans =
            past.iter().zip(ends).filter(|((_, origin), end)| !origin.is_live() && *end > from);
        spans
            .map(|(&(since, origin), end)| OriginInterval { start: since.max(from), end, origin })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn history() -> History {
        History::new([TagHandle(0), TagHandle(1)])
    }

    fn watch(tags: usize) -> OriginTracker {
        OriginTracker { of_tags: vec![Origin::LIVE; tags], ..OriginTracker::default() }
    }

    #[test]
    fn origins_are_shown_while_any_tag_has_them() {
        let (mut watch, history, now) = (watch(2), history(), Moment::now());
        watch.set(TagHandle(0), Origin::TEST | Origin::SIMULATED, &history, now);
        watch.set(TagHandle(1), Origin::TEST, &history, now);
        assert_eq!(watch.shown(), Origin::TEST | Origin::SIMULATED);
        watch.set(TagHandle(0), Origin::LIVE, &history, now);
        assert_eq!(watch.shown(), Origin::TEST);
        watch.set(TagHandle(1), Origin::LIVE, &history, now);
        watch.set(TagHandle(9), Origin::RECORDED, &history, now);
        assert_eq!(watch.shown(), Origin::LIVE, "a tag that is not there counts for nothing");
    }

    #[test]
    fn intervals_that_were_not_live_are_remembered() {
        let (mut watch, history, start) = (watch(2), history(), Moment::now());
        let at = |seconds| start.after(Duration::from_secs(seconds));
        let tag = TagHandle(0);
        watch.set(tag, Origin::RECORDED, &history, at(10));
        watch.set(tag, Origin::LIVE, &history, at(20));
        watch.set(tag, Origin::TEST, &history, at(30));
        let spans = watch.between(tag, at(15), at(40));
        let interval = |[start, end]: [u64; 2], origin| OriginInterval {
            start: at(start),
            end: at(end),
            origin,
        };
        let expected = [interval([15, 20], Origin::RECORDED), interval([30, 40], Origin::TEST)];
        assert_eq!(spans, expected);
        assert_eq!(watch.between(TagHandle(1), start, at(40)), []);
    }

    #[test]
    fn an_endlessly_alternating_origin_stays_bounded_and_marked() {
        let (mut watch, history, start) = (watch(1), history(), Moment::now());
        let at = |seconds| start.after(Duration::from_secs(seconds));
        for second in 0..4 * MAX_CHANGES as u64 {
            let origin = if second % 2 == 0 { Origin::TEST } else { Origin::LIVE };
            watch.set(TagHandle(0), origin, &history, at(second));
        }
        assert_eq!(watch.past[&TagHandle(0)].len(), MAX_CHANGES);
        let end = at(4 * MAX_CHANGES as u64);
        let spans = watch.between(TagHandle(0), start, end);
        let first = spans.first().expect("there are some");
        assert_eq!(first.start, start, "never less than it was");
    }
}
