//! Results as a document. Figures come from the run, and sentences that judge
//! are chosen by them.

mod comparison;
mod costs;
mod figures;
mod frame_rate;
mod proofs;
mod table_one;

use crate::verdicts;
use report_writer::Block;
use report_writer::Document;
use report_writer::number_format::grouped;

use crate::Results;

/// Composes the report from the results.
pub fn report(results: &Results) -> Document {
    let mut document = Document {
        title: "A fast scene constructing method, reproduced: Table I and Figures 5 to 8"
            .to_owned(),
        blocks: Vec::new(),
    };
    introduce(&mut document, results);
    document.heading("What the paper says, judged");
    document.blocks.push(Block::Claims(verdicts::judge(results)));
    document.heading("What this project asks of itself");
    document.blocks.push(Block::Claims(verdicts::bars(results)));
    table_one::write(&mut document, results);
    frame_rate::write(&mut document, results);
    figures::write(&mut document, results);
    comparison::write(&mut document, results);
    costs::write(&mut document, results);
    proofs::write(&mut document, results);
    document
}

fn introduce(document: &mut Document, results: &Results) {
    let machine = &results.machine;
    let full = results.level(0.0).map(|level| level.counts).unwrap_or_default();
    document.text(format!(
        "Z.-Y. Qu and J.-Y. Huang (Journal of Communications 10 (10), 2015, pp. 773-777) order the \
         edge collapses of a mesh by a weight and keep them on two stacks. This report repeats \
         their measurements with Busbar's optimiser weighted_collapse on a generated 220 kV \
         substation of {} vertices and {} triangles, flattened into one mesh, and judges what the \
         paper says. Vertices are welded positions; theta is the proportion of them that is \
         simplified.",
        grouped(full.vertices),
        grouped(full.triangles)
    ));
    document.text(format!(
        "Measured in one process on {} ({} threads), drawn by {}.{}",
        machine.processor,
        machine.threads,
        machine.device,
        if results.quick { " This is the quick run: it rests on fewer samples." } else { "" }
    ));
}
