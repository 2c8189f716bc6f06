//! Circles between the files of a crate: strongly connected components of its module graph.

mod module_graph;
mod tokens;

use std::collections::{BTreeMap, BTreeSet};

use self::module_graph::ModuleGraph;
use crate::packages;

/// Files that may name one another in a circle, at most.
const MAX_FILES: usize = 3;
/// Crates whose circles are still to be opened, and the files in each of them.
const UNOPENED: &[(&str, &[usize])] = &[];

/// Finds the strongly connected components of a graph, by the algorithm of Tarjan.
struct Components<'a> {
    edges: &'a [BTreeSet<usize>],
    /// Order of the first visit to each node.
    visited: BTreeMap<usize, usize>,
    /// Earliest node of the stack that each visited node leads to.
    earliest: BTreeMap<usize, usize>,
    stack: Vec<usize>,
    found: Vec<Vec<usize>>,
}

impl Components<'_> {
    fn find(edges: &[BTreeSet<usize>]) -> Vec<Vec<usize>> {
        let mut search = Components {
            edges,
            visited: BTreeMap::new(),
            earliest: BTreeMap::new(),
            stack: Vec::new(),
            found: Vec::new(),
        };
        for node in 0..edges.len() {
            if !search.visited.contains_key(&node) {
                search.visit(node);
            }
        }
        search.found
    }

    fn visit(&mut self, node: usize) {
        let order = self.visited.len();
        self.visited.insert(node, order);
        self.earliest.insert(node, order);
        self.stack.push(node);
        for &target in &self.edges[node] {
            if !self.visited.contains_key(&target) {
                self.visit(target);
                self.earliest.insert(node, self.earliest[&node].min(self.earliest[&target]));
            } else if self.stack.contains(&target) {
                self.earliest.insert(node, self.earliest[&node].min(self.visited[&target]));
            }
        }
        if self.earliest[&node] == order {
            let begin = self.stack.iter().position(|n| *n == node).expect("it was put there");
            self.found.push(self.stack.split_off(begin));
        }
    }
}

/// Circles of more than [`MAX_FILES`] files, each with their names, the largest first.
fn large_circles(graph: &ModuleGraph) -> Vec<Vec<String>> {
    let names = graph.names();
    let mut circles: Vec<Vec<String>> = Components::find(&graph.edges())
        .into_iter()
        .filter(|component| component.len() > MAX_FILES)
        .map(|component| component.into_iter().map(|node| names[node].clone()).collect())
        .collect();
    circles.iter_mut().for_each(|circle| circle.sort());
    circles.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    circles
}

#[test]
fn files_do_not_name_one_another_in_large_circles() {
    let mut faults = Vec::new();
    let mut seen = 0;
    for (name, package) in packages() {
        let circles: Vec<_> = package
            .roots
            .iter()
            .flat_map(|root| {
                let graph = ModuleGraph::read(root);
                seen += graph.names().len();
                large_circles(&graph)
            })
            .collect();
        let sizes: Vec<_> = circles.iter().map(Vec::len).collect();
        let unopened = UNOPENED.iter().find(|(crate_name, _)| *crate_name == name);
        let allowed = unopened.map_or(&[][..], |(_, sizes)| sizes);
        if sizes != allowed {
            let told: Vec<_> = circles.iter().map(|circle| circle.join(" ")).collect();
            faults.push(format!(
                "{name}: circles of {sizes:?} files, UNOPENED says {allowed:?}\n  {}",
                told.join("\n  ")
            ));
        }
    }
    assert!(seen > 500, "{seen} files looked at");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Files that each file of a crate names, as text.
#[cfg(test)]
fn edges_as_text(sources: &[(&str, &str)]) -> Vec<String> {
    let graph = ModuleGraph::from_sources(sources);
    let names = graph.names();
    let told = |(from, to): (usize, BTreeSet<usize>)| {
        to.into_iter().map(|to| format!("{} {}", names[from], names[to])).collect::<Vec<_>>()
    };
    graph.edges().into_iter().enumerate().flat_map(told).collect()
}

#[test]
fn imports_and_paths_in_code_are_edges() {
    let sources = [
        ("", "mod a; mod b; mod c; fn main() { b::run(); }"),
        ("a", "use crate::{b::B, c::{self, d::{D, E}}}; fn f() { std::fs::read(); c::d::g(); }"),
        ("b", "fn run() -> impl Fn() + use<'_> { super::c::C::new(); }"),
        ("c", "mod d; use std::collections::BTreeMap; const C: u8 = 0;"),
        (
            "c::d",
            "use super::super::a::*; mod inline { use super::super::C; use super::D; } use super::super::b;",
        ),
    ];
    let edges = edges_as_text(&sources);
    assert_eq!(edges, ["lib b", "a b", "a c", "a c::d", "b c", "c::d a", "c::d b", "c::d c"]);
}

#[test]
fn reexports_are_followed_and_are_no_use_themselves() {
    let sources = [
        ("", "mod a; mod b; pub use b::B; pub(crate) use b::*; fn f(x: B) {}"),
        ("a", "use crate::B; fn f() { crate::run(); super::f(); }"),
        ("b", "mod c; pub use c::{C as B}; pub fn run() {}"),
        ("b::c", "pub struct C;"),
    ];
    assert_eq!(edges_as_text(&sources), ["lib b::c", "a lib", "a b", "a b::c"]);
}

#[test]
fn circles_over_the_limit_are_found() {
    let sources = [
        ("", "mod a; mod b; mod c; mod d; mod e;"),
        ("a", "use crate::b::X;"),
        ("b", "use crate::c::X;"),
        ("c", "use crate::a::X; use crate::d::X;"),
        ("d", "use crate::e::X;"),
        ("e", "#[cfg(test)] mod tests { use crate::a::X; }"),
    ];
    assert!(large_circles(&ModuleGraph::from_sources(&sources)).is_empty(), "three are allowed");
    let mut four = sources;
    four[4].1 = "use crate::a::X;";
    let circles = large_circles(&ModuleGraph::from_sources(&four));
    assert_eq!(circles, [["a", "b", "c", "d"]]);
}
