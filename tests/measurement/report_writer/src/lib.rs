//! Reports as blocks, written as Markdown and as HTML.
//!
//! Words and figures come from the author of the report; this crate knows none.

pub mod chart;
mod html;
mod machine;
mod markdown;
pub mod number_format;
mod series;
mod writer;

pub use html::html;
pub use machine::machine;
pub use markdown::markdown;
pub use series::Series;
pub use writer::write;

/// Report as a sequence of blocks.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// Title of the report.
    pub title: String,
    /// Blocks in reading order.
    pub blocks: Vec<Block>,
}

/// Block of a report. All text is plain.
#[derive(Clone, Debug)]
pub enum Block {
    /// Heading of a section.
    Heading(String),
    /// Paragraph of plain text.
    Text(String),
    /// Table with a caption.
    Table(Table),
    /// Contact sheet of pictures side by side.
    ContactSheet(ContactSheet),
    /// Claims with their verdicts.
    Claims(Vec<Claim>),
    /// Chart with a caption.
    Chart(Chart),
}

/// Table of rows under a head; the first column holds names, others figures.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Caption that names the table's subject.
    pub caption: String,
    /// Headings of the columns.
    pub head: Vec<String>,
    /// Rows, each with as many cells as the head.
    pub rows: Vec<Vec<String>>,
    /// Flag for cells of text, which are aligned left; figures are aligned right.
    pub is_words: bool,
}

/// Contact sheet of pictures in rows.
#[derive(Clone, Debug)]
pub struct ContactSheet {
    /// Caption of the whole sheet.
    pub caption: String,
    /// Number of pictures in a row.
    pub columns: usize,
    /// Pictures, row by row.
    pub pictures: Vec<CaptionedPicture>,
}

/// Picture with its caption.
#[derive(Clone, Debug)]
pub struct CaptionedPicture {
    /// File name beside the report.
    pub file: String,
    /// Caption below the picture.
    pub caption: String,
}

/// Claim with its verdict.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Text of the claim.
    pub claim: String,
    /// Verdict on the claim.
    pub verdict: Verdict,
    /// Figure that decides the verdict.
    pub figure: String,
}

/// Verdict on a claim or bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Claim that the figures support.
    Confirmed,
    /// Claim that the figures contradict.
    Refuted,
    /// Bar of this project that the figures reach.
    Met,
    /// Bar of this project that they do not reach.
    Missed,
}

impl Verdict {
    /// Returns `Confirmed` if the claim holds, else `Refuted`.
    pub fn of_claim(holds: bool) -> Self {
        if holds { Self::Confirmed } else { Self::Refuted }
    }

    /// Returns `Met` if the bar was reached, else `Missed`.
    pub fn of_bar(reached: bool) -> Self {
        if reached { Self::Met } else { Self::Missed }
    }

    /// Returns the verdict as one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Refuted => "refuted",
            Self::Met => "met",
            Self::Missed => "missed",
        }
    }
}

/// Chart as an SVG drawing.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Caption of the chart.
    pub caption: String,
    /// File name of the drawing, beside the report.
    pub file: String,
    /// Drawing as SVG text.
    pub svg: String,
}

impl Document {
    /// Adds a section heading.
    pub fn heading(&mut self, text: &str) {
        self.blocks.push(Block::Heading(text.to_owned()));
    }

    /// Adds a paragraph of text.
    pub fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a table of figures.
    pub fn table(&mut self, caption: &str, head: &[&str], rows: Vec<Vec<String>>) {
        let head = head.iter().map(|&name| name.to_owned()).collect();
        self.blocks.push(Block::Table(Table {
            caption: caption.to_owned(),
            head,
            rows,
            is_words: false,
        }));
    }

    /// Adds a contact sheet with a number of pictures in a row.
    pub fn sheet(&mut self, caption: &str, columns: usize, pictures: Vec<CaptionedPicture>) {
        let caption = caption.to_owned();
        self.blocks.push(Block::ContactSheet(ContactSheet { caption, columns, pictures }));
    }

    /// Iterates over the files that the report shows and does not write itself.
    pub fn pictures(&self) -> impl Iterator<Item = &str> {
        let sheets = self.blocks.iter().filter_map(|block| match block {
            Block::ContactSheet(sheet) => Some(&sheet.pictures),
            _ => None,
        });
        sheets.flatten().map(|picture| picture.file.as_str())
    }
}
