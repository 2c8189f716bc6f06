//! Module graph of a crate: files, and which file names items of which other by a path.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::tokens::tokens;

/// Re-exports followed from one to the next, at most.
const MAX_REEXPORTS: usize = 8;

/// Module path below the crate's root, such as `["session", "watch"]`.
type ModulePath = Vec<String>;

/// One file of a crate as its source names it.
#[derive(Default)]
struct Module {
    /// Names that `use` brings in, by the inline module they are in: their paths, public or not.
    imports: Vec<Import>,
    /// Paths in code that have at least two words, and the inline module they are in.
    paths: Vec<(ModulePath, Vec<String>)>,
    /// Words of the code outside imports.
    words: BTreeSet<String>,
    /// Names of the items that the file defines.
    items: BTreeSet<String>,
}

/// One name that a `use` brings in.
struct Import {
    /// Module that it is written in: the file's, or an inline one below it.
    module: ModulePath,
    /// Name that it has there; `*` for all names.
    name: String,
    path: Vec<String>,
    is_public: bool,
}

/// Files of a crate and the names that each takes from others.
pub(super) struct ModuleGraph {
    modules: BTreeMap<ModulePath, Module>,
}

impl ModuleGraph {
    /// Reads the crate whose root file is `root`, with the modules that it declares.
    pub(super) fn read(root: &Path) -> Self {
        let mut modules = BTreeMap::new();
        let folder = root.parent().expect("a file is in a folder");
        read_module(root, folder, &ModulePath::new(), &mut modules);
        Self { modules }
    }

    /// Builds the graph of a crate whose files are given by their module paths.
    #[cfg(test)]
    pub(super) fn from_sources(sources: &[(&str, &str)]) -> Self {
        let path = |name: &str| -> ModulePath {
            name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect()
        };
        let module = |(name, source): &(&str, &str)| {
            let mut children = Vec::new();
            (path(name), parse(&path(name), &tokens(source), &mut children))
        };
        Self { modules: sources.iter().map(module).collect() }
    }

    /// Names of the files; the root is called `lib`.
    pub(super) fn names(&self) -> Vec<String> {
        self.modules.keys().map(|path| display_name(path)).collect()
    }

    /// Indices of the files that each file names, in the order of [`Self::names`].
    pub(super) fn edges(&self) -> Vec<BTreeSet<usize>> {
        let index: BTreeMap<_, _> = self.modules.keys().zip(0..).collect();
        let targets = |(path, module): (&ModulePath, &Module)| {
            let named = self.named_modules(path, module);
            named.into_iter().map(|target| index[&target]).collect()
        };
        self.modules.iter().map(targets).collect()
    }

    /// Other files that a file names in imports and in code.
    fn named_modules(&self, path: &ModulePath, module: &Module) -> BTreeSet<ModulePath> {
        let imports = module.imports.iter().filter(|import| {
            // A parent that passes a name on does not use it.
            !import.is_public || module.words.contains(&import.name)
        });
        let imports = imports.map(|import| (&import.module, &import.path));
        let paths = module.paths.iter().map(|(within, path)| (within, path));
        let targets = imports.chain(paths).filter_map(|(within, named)| {
            let absolute = self.absolute(within, named)?;
            Some(self.resolve(&absolute, MAX_REEXPORTS))
        });
        targets.filter(|target| target != path).collect()
    }

    /// Path from the crate's root, if the path leads into this crate.
    fn absolute(&self, within: &ModulePath, path: &[String]) -> Option<ModulePath> {
        let (first, rest) = path.split_first()?;
        let mut base = within.clone();
        match first.as_str() {
            "crate" => base.clear(),
            "self" => {}
            "super" => {
                base.pop();
                let more = rest.iter().take_while(|word| *word == "super").count();
                base.truncate(base.len().saturating_sub(more));
                base.extend_from_slice(&rest[more..]);
                return Some(base);
            }
            child => {
                let is_child = |path: &ModulePath| {
                    path.starts_with(within) && path.get(within.len()).is_some_and(|c| c == child)
                };
                if self.modules.keys().any(is_child) {
                    base.push(child.to_owned());
                } else {
                    // A module that the file has imported.
                    let file = self.file(within);
                    let import = self.modules[&file].imports.iter().find(|import| {
                        import.module == *within && import.name == child && import.path != path
                    })?;
                    if import.path.first().is_some_and(|word| word == child) {
                        return None;
                    }
                    base = self.absolute(within, &import.path)?;
                }
            }
        }
        base.extend_from_slice(rest);
        Some(base)
    }

    /// File that a path from the root leads to, re-exports followed.
    fn resolve(&self, absolute: &ModulePath, left: usize) -> ModulePath {
        let file = self.file(absolute);
        let Some(name) = absolute.get(file.len()) else { return file };
        if left == 0 {
            return file;
        }
        let module = &self.modules[&file];
        let mut reexports = module.imports.iter().filter(|i| i.is_public && i.module == file);
        if let Some(import) = reexports.clone().find(|import| import.name == *name) {
            if let Some(mut target) = self.absolute(&file, &import.path) {
                target.extend_from_slice(&absolute[file.len() + 1..]);
                if target != *absolute {
                    return self.resolve(&target, left - 1);
                }
            }
            return file;
        }
        let in_all = reexports.find_map(|import| {
            let target = self.absolute(&file, import.path.as_slice())?;
            let all = self.resolve(&target, left - 1);
            let has_it = import.name == "*" && self.modules[&all].items.contains(name);
            has_it.then_some(all)
        });
        in_all.unwrap_or(file)
    }

    /// File that holds a module or an item of this path.
    fn file(&self, path: &[String]) -> ModulePath {
        let prefixes = (0..=path.len()).rev().map(|length| path[..length].to_vec());
        prefixes.into_iter().find(|prefix| self.modules.contains_key(prefix)).unwrap_or_default()
    }
}

fn display_name(path: &[String]) -> String {
    if path.is_empty() { "lib".to_owned() } else { path.join("::") }
}

/// Reads a file, then the files of the modules that it declares below `folder`.
fn read_module(
    file: &Path,
    folder: &Path,
    path: &ModulePath,
    modules: &mut BTreeMap<ModulePath, Module>,
) {
    let source = fs::read_to_string(file).expect("sources are text");
    let mut children = Vec::new();
    let module = parse(path, &tokens(&source), &mut children);
    modules.insert(path.clone(), module);
    for child in children {
        let below: PathBuf = child[path.len()..].iter().collect();
        let child_folder = folder.join(below);
        let beside = child_folder.with_extension("rs");
        let inside = child_folder.join("mod.rs");
        let child_file = if beside.exists() { beside } else { inside };
        // Generated sources lie elsewhere.
        if child_file.exists() {
            read_module(&child_file, &child_folder, &child, modules);
        }
    }
}

/// Reads the tokens of a file; modules that it declares without a body go to `children`.
fn parse(file: &ModulePath, tokens: &[String], children: &mut Vec<ModulePath>) -> Module {
    let mut module = Module::default();
    // Inline modules around the token, each with the depth of braces that it begins at.
    let mut inline: Vec<(String, usize)> = Vec::new();
    let mut depth = 0;
    let mut index = 0;
    let mut is_public = false;
    while let Some(token) = tokens.get(index) {
        let within = || -> ModulePath {
            file.iter().cloned().chain(inline.iter().map(|(name, _)| name.clone())).collect()
        };
        let next = tokens.get(index + 1).map(String::as_str);
        match token.as_str() {
            "{" => depth += 1,
            "}" => {
                depth = usize::saturating_sub(depth, 1);
                inline.retain(|(_, begin)| *begin < depth);
            }
            "pub" => {
                is_public = true;
                if next == Some("(") {
                    index += tokens[index..].iter().position(|t| t == ")").unwrap_or_default();
                }
                index += 1;
                continue;
            }
            "mod" if next.is_some() => {
                let name = tokens[index + 1].clone();
                match tokens.get(index + 2).map(String::as_str) {
                    Some("{") => inline.push((name, depth)),
                    Some(";") => {
                        let mut child = within();
                        child.push(name);
                        children.push(child);
                    }
                    _ => {}
                }
                index += 1;
            }
            "use" => {
                let end = tokens[index..].iter().position(|t| t == ";").unwrap_or_default();
                let tree = &tokens[index + 1..index + end.max(1)];
                // `use<'a>` of a return type is no import.
                if tree.first().is_some_and(|first| first != "<") {
                    read_use_tree(&mut module.imports, &within(), is_public, &[], tree);
                    index += end;
                }
            }
            "struct" | "enum" | "union" | "trait" | "type" | "fn" | "const" | "static" => {
                module.items.extend(next.map(str::to_owned));
            }
            word if word.starts_with(|c: char| c.is_alphanumeric() || c == '_') => {
                let is_root = index == 0 || tokens[index - 1] != "::";
                let mut path = vec![token.clone()];
                while tokens.get(index + 1).is_some_and(|t| t == "::") {
                    let Some(name) = tokens.get(index + 2) else { break };
                    if !name.starts_with(|c: char| c.is_alphanumeric() || c == '_') {
                        break;
                    }
                    path.push(name.clone());
                    index += 2;
                }
                module.words.insert(path[0].clone());
                if is_root && path.len() > 1 {
                    module.paths.push((within(), path));
                }
            }
            _ => {}
        }
        is_public = false;
        index += 1;
    }
    module
}

/// Adds the names of a use tree whose paths begin with `prefix`.
fn read_use_tree(
    imports: &mut Vec<Import>,
    module: &ModulePath,
    is_public: bool,
    prefix: &[String],
    tree: &[String],
) {
    let mut path = prefix.to_vec();
    let mut name = None;
    let mut index = 0;
    while let Some(token) = tree.get(index) {
        match token.as_str() {
            "::" => {}
            "as" => {
                name = tree.get(index + 1).cloned();
                break;
            }
            "*" => {
                name = Some(token.clone());
                break;
            }
            "{" => {
                let inner = &tree[index + 1..];
                let mut depth = 1_usize;
                let mut begin = 0;
                for (end, token) in inner.iter().enumerate() {
                    match token.as_str() {
                        "{" => depth += 1,
                        "}" => depth -= 1,
                        _ => {}
                    }
                    if depth == 0 || (depth == 1 && token == ",") {
                        if begin < end {
                            read_use_tree(imports, module, is_public, &path, &inner[begin..end]);
                        }
                        begin = end + 1;
                    }
                    if depth == 0 {
                        break;
                    }
                }
                return;
            }
            "self" if !path.is_empty() => {}
            word => path.push(word.to_owned()),
        }
        index += 1;
    }
    let name = name.or_else(|| path.last().cloned()).unwrap_or_default();
    imports.push(Import { module: module.clone(), name, path, is_public });
}
