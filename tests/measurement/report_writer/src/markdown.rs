//! Report in Markdown format.

use std::fmt::Write as _;

use crate::{Block, Claim, Document, Table};

/// Writes a document as Markdown.
pub fn markdown(document: &Document) -> String {
    let mut text = format!("# {}\n", escaped(&document.title));
    for block in &document.blocks {
        text.push('\n');
        write_block(&mut text, block);
    }
    text
}

// Writing to a string cannot fail.
fn write_block(text: &mut String, block: &Block) {
    match block {
        Block::Heading(heading) => {
            let _ = writeln!(text, "## {}", escaped(heading));
        }
        Block::Text(paragraph) => {
            let _ = writeln!(text, "{}", escaped(paragraph));
        }
        Block::Table(table) => write_table(text, table),
        Block::Claims(claims) => write_table(text, &table_of(claims)),
        Block::ContactSheet(sheet) => {
            let _ = writeln!(text, "**{}**", escaped(&sheet.caption));
            for picture in &sheet.pictures {
                let caption = escaped(&picture.caption);
                let _ = writeln!(text, "\n![{caption}]({})\n\n*{caption}*", picture.file);
            }
        }
        Block::Chart(chart) => {
            let caption = escaped(&chart.caption);
            let _ = writeln!(text, "![{caption}]({})\n\n*{caption}*", chart.file);
        }
    }
}

fn table_of(claims: &[Claim]) -> Table {
    let row = |claim: &Claim| {
        vec![claim.claim.clone(), claim.verdict.word().to_owned(), claim.figure.clone()]
    };
    Table {
        caption: String::new(),
        head: ["Claim", "Verdict", "Figure"].map(str::to_owned).to_vec(),
        rows: claims.iter().map(row).collect(),
        is_words: true,
    }
}

fn write_table(text: &mut String, table: &Table) {
    if !table.caption.is_empty() {
        let _ = writeln!(text, "**{}**\n", escaped(&table.caption));
    }
    let mut line = |cells: &[String]| {
        let cells: Vec<_> = cells.iter().map(|cell| escaped(cell)).collect();
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    };
    line(&table.head);
    let figures = if table.is_words { "---" } else { "---:" };
    let rule = |index: usize| if index == 0 { "---" } else { figures }.to_owned();
    line(&(0..table.head.len()).map(rule).collect::<Vec<_>>());
    for row in &table.rows {
        line(row);
    }
}

/// Escapes the characters of a text that are markup in Markdown.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '|' | '*' | '_' | '<' | '>' | '[' | ']' | '\\' | '`') {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}
