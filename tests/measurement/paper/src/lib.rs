//! Reproduces what the paper measured, and judges what it says: Table I,
//! Figures 5 to 8, and each claim in one line with its figure.
//!
//! [`measure()`] gives [`Results`]; [`report()`] turns them into a [`report_writer::Document`];
//! [`write_report`] writes that as Markdown, as HTML, and the figures as JSON.
//! Every figure comes from the run, and so does every verdict.

pub mod effort;
pub mod frames;
pub mod image_difference;
pub mod lossless;
pub mod machine;
pub mod optimise;
pub mod peer;
pub mod picks;
mod progress;
pub mod reference;
pub mod report;
pub mod results;
pub mod run;
pub mod scene;
pub mod series;
pub mod studio;
pub mod study;
pub mod theta_change;
pub mod topology;
mod variants;
mod verdicts;
mod writer;

pub use effort::Effort;
pub use progress::Progress;
pub use report::report;
pub use results::Results;
pub use run::measure;
pub use writer::write_report;
