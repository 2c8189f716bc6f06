//! Report section of levels as tables and pictures.

use report_writer::number_format::{grouped, percent, theta};
use report_writer::{CaptionedPicture, Document};

use crate::levels::verdicts::new_non_manifold;
use crate::levels::{Levels, MethodResult, SubjectResult, THETAS};

const COST_HEAD: [&str; 6] = [
    "method",
    "one level, s",
    "three levels, s",
    "million triangles a second",
    "peak memory, MiB",
    "bytes a triangle",
];
const LEVEL_HEAD: [&str; 14] = [
    "method",
    "vertices",
    "triangles",
    "mean distance",
    "RMS",
    "greatest",
    "claimed",
    "normals, degrees",
    "SSIM",
    "silhouette",
    "components",
    "border loops",
    "duplicates",
    "new non-manifold",
];

/// Writes the results on each mesh.
pub(crate) fn write(document: &mut Document, levels: &Levels) {
    document.heading("Levels of detail, ours and the field's");
    document.text(
        "Each method runs on one core in a process of its own. Seconds are processor time \
         of the call alone; ours makes the whole sequence once and takes every level from it, others make a \
         call a level, whose target was searched beforehand. Memory is by how much the process's \
         resident memory grew at most in the first call, whoever allocated it (VmHWM). Theta \
         counts welded positions; a peer's level is the one whose vertices in use are nearest to \
         as many.",
    );
    document.text(
        "Distances are shares of the diagonal, over 100,000 points drawn by area on each of both \
         surfaces by one seed: mean and RMS of both ways, the greatest of both; claimed is the error that the \
         plugin gives the level. Normals are those \
         of faces, at the sampled and the nearest point. SSIM and silhouette (pixels that only \
         one covers, over those that the original covers) are means over 8 parallel views of \
         512 x 512 pixels, with normals made from faces alike for original and levels (crease at \
         40 degrees).",
    );
    for remark in &levels.remarks {
        document.text(remark.clone());
    }
    for subject in &levels.subjects {
        write_subject(document, subject);
    }
}

fn write_subject(document: &mut Document, subject: &SubjectResult) {
    let counts = subject.counts;
    document.heading(&format!("Levels: {}", subject.name));
    document.text(format!(
        "{} vertices, {} triangles, {} components, {} border loops, {} non-manifold edges, {} \
         duplicates; diagonal {:.2} m.",
        grouped(counts.vertices as u64),
        grouped(counts.triangles as u64),
        grouped(counts.components.into()),
        grouped(counts.border_loops),
        grouped(counts.non_manifold),
        percent(counts.duplicates),
        subject.diagonal
    ));
    let costs = subject.methods.iter().map(|method| cost_row(subject, method)).collect();
    document.table(&format!("{}: cost on one core", subject.name), &COST_HEAD, costs);
    for (level, at) in THETAS.into_iter().enumerate() {
        let rows = subject.methods.iter().map(|method| level_row(subject, method, level)).collect();
        let wanted = grouped(subject.wanted[level] as u64);
        let title = format!("{}: theta {}, {wanted} vertices wanted", subject.name, theta(at));
        document.table(&title, &LEVEL_HEAD, rows);
    }
    if let Some(file) = &subject.sheet {
        let picture = CaptionedPicture { file: file.clone(), caption: subject.name.clone() };
        document.sheet(&format!("{} at each theta", subject.name), 1, vec![picture]);
    }
}

fn cost_row(subject: &SubjectResult, method: &MethodResult) -> Vec<String> {
    let (cost, triangles) = (&method.cost, subject.counts.triangles as f64);
    vec![
        method.id.to_owned(),
        format!("{:.3}", cost.one_seconds),
        format!("{:.3}", cost.all_seconds),
        format!("{:.2}", triangles / cost.one_seconds / 1e6),
        format!("{:.1}", cost.peak_bytes as f64 / f64::from(1 << 20)),
        format!("{:.0}", cost.peak_bytes as f64 / triangles),
    ]
}

fn level_row(subject: &SubjectResult, method: &MethodResult, level: usize) -> Vec<String> {
    let figures = method.levels[level];
    let (counts, picture) = (figures.counts, figures.picture);
    let share = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2e}"));
    vec![
        method.id.to_owned(),
        grouped(counts.vertices as u64),
        grouped(counts.triangles as u64),
        share(figures.error.map(|error| error.mean_of_both())),
        share(figures.error.map(|error| error.rms_of_both())),
        share(figures.error.map(|error| error.max())),
        share(method.cost.claimed.get(level).map(|&error| f64::from(error) / subject.diagonal)),
        figures.error.map_or_else(|| "-".to_owned(), |e| format!("{:.2}", e.degrees_of_both())),
        format!("{:.4}", picture.ssim),
        percent(picture.silhouette),
        grouped(counts.components.into()),
        grouped(counts.border_loops),
        percent(counts.duplicates),
        grouped(new_non_manifold(subject, method, level)),
    ]
}
