//! Report as one HTML page; its pictures lie beside it.

use std::fmt::Write as _;

use crate::{Block, Claim, ContactSheet, Document, Table};

/// Style sheet for screen and paper.
const STYLE: &str = include_str!("style.css");

/// Writes a document as HTML.
pub fn html(document: &Document) -> String {
    let title = escaped(&document.title);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n"
    );
    for block in &document.blocks {
        write_block(&mut text, block);
    }
    text.push_str("</main>\n</body>\n</html>\n");
    text
}

// Writing to a string cannot fail.
fn write_block(text: &mut String, block: &Block) {
    match block {
        Block::Heading(heading) => {
            let _ = writeln!(text, "<h2>{}</h2>", escaped(heading));
        }
        Block::Text(paragraph) => {
            let _ = writeln!(text, "<p>{}</p>", escaped(paragraph));
        }
        Block::Table(table) => write_table(text, table),
        Block::Claims(claims) => write_claims(text, claims),
        Block::ContactSheet(sheet) => write_sheet(text, sheet),
        Block::Chart(chart) => {
            let (svg, caption) = (&chart.svg, escaped(&chart.caption));
            let _ = writeln!(
                text,
                "<figure class=\"chart\">\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>"
            );
        }
    }
}

fn write_table(text: &mut String, table: &Table) {
    let _ = writeln!(text, "<div class=\"wide\"><table>");
    let _ = writeln!(text, "<caption>{}</caption>", escaped(&table.caption));
    let _ = write!(text, "<thead><tr>");
    for name in &table.head {
        let _ = write!(text, "<th scope=\"col\">{}</th>", escaped(name));
    }
    let _ = writeln!(text, "</tr></thead>\n<tbody>");
    for row in &table.rows {
        let _ = write!(text, "<tr>");
        for (index, cell) in row.iter().enumerate() {
            let cell = escaped(cell);
            let _ = match index {
                0 => write!(text, "<th scope=\"row\">{cell}</th>"),
                _ => write!(text, "<td>{cell}</td>"),
            };
        }
        let _ = writeln!(text, "</tr>");
    }
    let _ = writeln!(text, "</tbody></table></div>");
}

fn write_claims(text: &mut String, claims: &[Claim]) {
    let _ = writeln!(text, "<ul class=\"claims\">");
    for Claim { claim, verdict, figure } in claims {
        let (claim, figure, word) = (escaped(claim), escaped(figure), verdict.word());
        let _ = writeln!(
            text,
            "<li><b class=\"{word}\">{word}</b><span>{claim}</span><span>{figure}</span></li>"
        );
    }
    let _ = writeln!(text, "</ul>");
}

fn write_sheet(text: &mut String, sheet: &ContactSheet) {
    let caption = escaped(&sheet.caption);
    let columns = sheet.columns;
    let _ = writeln!(text, "<section class=\"sheet\" style=\"--columns:{columns}\">");
    let _ = writeln!(text, "<h3>{caption}</h3>");
    for picture in &sheet.pictures {
        let (file, caption) = (escaped(&picture.file), escaped(&picture.caption));
        let _ = writeln!(
            text,
            "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{caption}\" loading=\"lazy\"></a>\
             <figcaption>{caption}</figcaption></figure>"
        );
    }
    let _ = writeln!(text, "</section>");
}

/// Escapes the characters of a text that are markup in HTML.
pub(crate) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c => escaped.push(c),
        }
    }
    escaped
}
