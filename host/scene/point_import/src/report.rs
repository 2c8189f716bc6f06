//! Import report for people: the result of each tag, as CSV and as Markdown.

use std::fmt::Write;

use crate::matching::{MIN_CONFIDENCE, MIN_MARGIN, Proposal};
use crate::point::Point;

/// Doubtful tags that the Markdown lists; the CSV has all.
const MAX_TOLD: usize = 1_000;

/// Every tag in one line: bound or in doubt, the best nodes, how sure, and why.
pub fn csv(points: &[Point], proposals: &[Proposal]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = [
        "tag",
        "result",
        "node",
        "confidence",
        "reason",
        "second",
        "second_confidence",
        "second_reason",
        "third",
        "third_confidence",
        "third_reason",
    ];
    // Writing to memory does not fail.
    let _ = writer.write_record(header);
    for (point, proposal) in points.iter().zip(proposals) {
        let result = if proposal.node.is_some() { "bound" } else { "doubtful" };
        let mut fields = vec![point.tag.clone(), result.to_owned()];
        for rank in 0..3 {
            let candidate = proposal.candidates.get(rank);
            fields.push(candidate.map(|c| c.node.clone()).unwrap_or_default());
            fields.push(candidate.map(|c| format!("{:.2}", c.confidence)).unwrap_or_default());
            let own = candidate.map(|c| c.reason.clone()).unwrap_or_default();
            fields.push(if rank == 0 { proposal.reason.clone() } else { own });
        }
        let _ = writer.write_record(&fields);
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

/// Writes the number of bound tags and the doubtful ones as Markdown.
pub fn markdown(points: &[Point], proposals: &[Proposal]) -> String {
    let bound = proposals.iter().filter(|proposal| proposal.node.is_some()).count();
    let doubtful = proposals.len() - bound;
    let mut text = format!(
        "# Import\n\n{bound} of {} tags are bound to nodes, {doubtful} are in doubt and are not \
         bound.\n\nA tag is bound where the best node has a confidence of at least \
         {MIN_CONFIDENCE}, {MIN_MARGIN} more than the second, and nothing speaks against it. To \
         bind another, fill in the column `node` of the list and import again.\n",
        proposals.len(),
    );
    if doubtful == 0 {
        return text;
    }
    text += "\n## In doubt\n\n| tag | why | nearest nodes |\n|---|---|---|\n";
    let open = points.iter().zip(proposals).filter(|(_, proposal)| proposal.node.is_none());
    for (point, proposal) in open.take(MAX_TOLD) {
        let near = proposal.candidates.iter().map(|candidate| {
            format!("{} ({:.2}: {})", candidate.node, candidate.confidence, candidate.reason)
        });
        let near = cell(&near.collect::<Vec<_>>().join("; "));
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {} | {} | {near} |", cell(&point.tag), cell(&proposal.reason));
    }
    if doubtful > MAX_TOLD {
        let _ = writeln!(text, "\nThe CSV beside this has the other {}.", doubtful - MAX_TOLD);
    }
    text
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
