//! Chapters of the SDK's crate documentation as chapters of the book.
//!
//! Rustdoc resolves links to items and hides lines of examples; mdBook does neither for links.

/// Start of a link to another chapter.
const CHAPTER: &str = "super::";
/// Start of a link to an item of the SDK.
const ITEM: &str = "crate::";

/// Returns a chapter whose first line is its heading, whose links to items are plain text, and
/// whose examples are marked as Rust.
pub(super) fn page(chapter: &str) -> String {
    let mut page = String::from("# ");
    let mut in_code = false;
    for (index, line) in chapter.lines().enumerate() {
        if line.starts_with("```") {
            let names_rust =
                ["```", "```no_run", "```ignore", "```compile_fail", "```should_panic"];
            page += if !in_code && names_rust.contains(&line.trim()) { "```rust" } else { line };
            in_code = !in_code;
        } else if in_code {
            page += line;
        } else if index == 0 {
            page += without_item_links(line).trim_end_matches('.');
        } else {
            page += &without_item_links(line);
        }
        page.push('\n');
    }
    page
}

/// Returns a line in which links to items are their text, and links to chapters lead to pages.
fn without_item_links(line: &str) -> String {
    let mut result = String::new();
    let mut rest = line;
    while let Some((before, text, target, after)) = next_link(rest) {
        result += before;
        if let Some(chapter) = target.strip_prefix(CHAPTER) {
            result += &format!("[{text}]({chapter}.md)");
        } else if target.starts_with(ITEM) {
            result += text;
        } else {
            result += &format!("[{text}]({target})");
        }
        rest = after;
    }
    result + rest
}

/// Returns what is before the first link of a line, its text and target, and what is after it.
fn next_link(line: &str) -> Option<(&str, &str, &str, &str)> {
    let middle = line.find("](")?;
    let start = line[..middle].rfind('[')?;
    let target = &line[middle + 2..];
    let end = target.find(')')?;
    Some((&line[..start], &line[start + 1..middle], &target[..end], &target[end + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_become_text_and_chapters_pages() {
        let chapter = "Start: five commands.\n\nSee [`Plugin`](crate::Plugin), [belief](super::belief) \
                       and [the web](https://example.com).\n\n```\n# use x;\nlet a = b[0](c);\n```\n";
        assert_eq!(
            page(chapter),
            "# Start: five commands\n\nSee `Plugin`, [belief](belief.md) and \
             [the web](https://example.com).\n\n```rust\n# use x;\nlet a = b[0](c);\n```\n"
        );
    }

    #[test]
    fn other_languages_keep_their_names() {
        assert_eq!(page("C.\n```c\nint a;\n```\n"), "# C\n```c\nint a;\n```\n");
    }
}
