//! Markdown documents of the repository: links, code spans and code blocks.

use std::fs;
use std::path::{Path, PathBuf};

use e2e::workspace_path;
use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

use crate::commands::CommandLine;

/// Folders without documents of ours.
const PASSED_OVER: [&str; 6] =
    ["target", "templates", "generated", "node_modules", "models", "corpus"];

/// Code block with its info string, such as `sh` or `json`.
pub(crate) struct CodeBlock {
    pub(crate) info: String,
    pub(crate) text: String,
}

impl CodeBlock {
    /// Reports whether the block has commands: marked `sh`, or without a mark.
    pub(crate) fn is_shell(&self) -> bool {
        let language = self.info.split([',', ' ']).next().unwrap_or_default();
        ["sh", "text", ""].contains(&language)
    }
}

/// Document with the parts that tests look at.
pub(crate) struct Document {
    /// Path from the repository's root.
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) links: Vec<String>,
    pub(crate) code: Vec<String>,
    pub(crate) blocks: Vec<CodeBlock>,
}

impl Document {
    /// Returns every document of the repository, but for templates and generated ones.
    pub(crate) fn all() -> Vec<Self> {
        let mut names = Vec::new();
        collect(&workspace_path(""), Path::new(""), &mut names);
        names.sort();
        names.iter().map(|name| Self::read(&name.to_string_lossy())).collect()
    }

    /// Returns every document but the changelog, which tells of former states.
    pub(crate) fn current() -> Vec<Self> {
        Self::all().into_iter().filter(|document| document.name != "CHANGELOG.md").collect()
    }

    /// Reads one document of the repository.
    ///
    /// # Panics
    /// When it is not there or not UTF-8.
    pub(crate) fn read(name: &str) -> Self {
        let text = fs::read_to_string(workspace_path(name));
        let text = text.unwrap_or_else(|error| panic!("{name}: {error}"));
        Self::parse(name, text)
    }

    fn parse(name: &str, text: String) -> Self {
        let (mut links, mut code, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        let mut block: Option<CodeBlock> = None;
        for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    links.push(dest_url.into_string());
                }
                Event::Start(Tag::CodeBlock(kind)) => {
                    let info = match kind {
                        CodeBlockKind::Fenced(info) => info.into_string(),
                        CodeBlockKind::Indented => String::new(),
                    };
                    block = Some(CodeBlock { info, text: String::new() });
                }
                Event::End(TagEnd::CodeBlock) => blocks.extend(block.take()),
                Event::Text(text) => {
                    if let Some(block) = &mut block {
                        block.text += &text;
                    }
                }
                Event::Code(text) => code.push(text.into_string()),
                _ => {}
            }
        }
        Self { name: name.to_owned(), text, links, code, blocks }
    }

    /// Returns the document's folder, from the repository's root.
    pub(crate) fn folder(&self) -> &Path {
        Path::new(&self.name).parent().unwrap_or(Path::new(""))
    }

    /// Returns the commands of shell blocks and of code spans.
    pub(crate) fn command_lines(&self) -> Vec<CommandLine> {
        let blocks = self.blocks.iter().filter(|block| block.is_shell());
        let texts = blocks.map(|block| block.text.as_str());
        let spans = self.code.iter().map(String::as_str);
        texts.chain(spans).flat_map(CommandLine::of_shell).collect()
    }
}

fn collect(folder: &Path, relative: &Path, names: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let entry = entry.expect("it can be read");
        let name = entry.file_name();
        let hidden = name.to_string_lossy().starts_with('.');
        let kind = entry.file_type().expect("it has a type");
        if hidden || PASSED_OVER.iter().any(|passed| name == *passed) {
            continue;
        }
        let relative = relative.join(&name);
        if kind.is_dir() {
            collect(&entry.path(), &relative, names);
        } else if relative.extension().is_some_and(|extension| extension == "md") {
            names.push(relative);
        }
    }
}

#[test]
fn parts_are_found() {
    let text = [
        "See [a](b.md#c) and ![d](e.png), `busbar view`.\n",
        "```sh,no_run\nbusbar check x\n```\n",
        "    cargo xtask demo\n",
    ];
    let text = text.join("\n");
    let document = Document::parse("x/y.md", text);
    assert_eq!(document.links, ["b.md#c", "e.png"]);
    assert_eq!(document.code, ["busbar view"]);
    let infos: Vec<_> = document.blocks.iter().map(|b| (b.info.as_str(), b.is_shell())).collect();
    assert_eq!(infos, [("sh,no_run", true), ("", true)]);
    assert_eq!(document.command_lines().len(), 3, "of both blocks and a code span");
    assert_eq!(document.folder(), Path::new("x"));
}
