//! Search for the names beside a data object that the server lacks, for a message to the
//! integrator.

use std::collections::BTreeSet;

use busbar_plugin_sdk::LogLevel;

use super::{Job, Server};
use crate::service::{Answer, Name, Request};

/// Answers that are asked for; each has as many names as a message holds.
const MAX_PAGES: usize = 200;
/// Names that are kept, and that are told.
const MAX_KEPT: usize = 1000;
const MAX_TOLD: usize = 30;

/// A search for what stands beside a name.
#[derive(Debug)]
pub(super) struct Search {
    /// Name of the object that is missing, `LD` and `LN$FC$DO`.
    wanted: Name,
    /// Reports whether the server has the logical device.
    has_device: bool,
    /// The last name that came.
    after: Option<String>,
    pages: usize,
    /// Logical nodes of the device.
    nodes: BTreeSet<String>,
    /// Data objects of the node under the constraint.
    objects: BTreeSet<String>,
}

impl Server {
    /// Looks what there is instead of a data object, for the first of them.
    pub(super) fn search(&mut self, wanted: &Name) {
        if self.search.is_none() {
            self.search = Some(Search {
                wanted: wanted.clone(),
                has_device: false,
                after: None,
                pages: 0,
                nodes: BTreeSet::new(),
                objects: BTreeSet::new(),
            });
            self.queue.push_back(Job::Browse);
        }
    }

    pub(super) fn browse_request(&self) -> Option<Request> {
        let search = self.search.as_ref()?;
        let device = search.has_device.then(|| search.wanted.domain.clone());
        Some(Request::Names { device, after: search.after.clone() })
    }

    pub(super) fn take_names(&mut self, answer: Answer) {
        let Some(search) = &mut self.search else { return };
        // A server that does not tell is no news.
        let Answer::Names { names, more_follow } = answer else { return };
        search.pages += 1;
        let goes_on = more_follow && !names.is_empty() && search.pages < MAX_PAGES;
        search.after = names.last().cloned().filter(|_| goes_on);
        if search.has_device {
            search.sort(names);
        } else if names.contains(&search.wanted.domain) {
            (search.has_device, search.after) = (true, None);
            return self.queue.push_back(Job::Browse);
        } else {
            search.nodes.extend(names.into_iter().take(MAX_KEPT));
        }
        if goes_on {
            return self.queue.push_back(Job::Browse);
        }
        let text = search.in_words();
        self.point_states.log(LogLevel::Warning, &text);
    }
}

impl Search {
    /// `LN` is a node, `LN$FC$DO` a data object.
    fn sort(&mut self, names: Vec<String>) {
        let (start, _) = self.wanted.item.rsplit_once('$').unwrap_or_default();
        for name in names {
            let below = name.strip_prefix(start).and_then(|rest| rest.strip_prefix('$'));
            match below {
                _ if self.nodes.len() + self.objects.len() >= MAX_KEPT => return,
                Some(object) if !object.contains('$') => {
                    self.objects.insert(object.to_owned());
                }
                None if !name.contains('$') => {
                    self.nodes.insert(name);
                }
                _ => {}
            }
        }
    }

    fn in_words(&self) -> String {
        let Name { domain, item } = &self.wanted;
        let mut parts = item.split('$');
        let (node, constraint) =
            (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        if !self.has_device {
            format!("its logical devices are {}", listed(&self.nodes))
        } else if self.objects.is_empty() && self.nodes.contains(node) {
            format!("{domain}/{node} has nothing under {constraint}: is that the constraint?")
        } else if self.objects.is_empty() {
            format!("the logical nodes of {domain} are {}", listed(&self.nodes))
        } else {
            format!("{domain}/{node} has under {constraint}: {}", listed(&self.objects))
        }
    }
}

fn listed(names: &BTreeSet<String>) -> String {
    let told: Vec<_> = names.iter().take(MAX_TOLD).map(String::as_str).collect();
    let more = names.len() - told.len();
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{rest}", told.join(", "))
}
