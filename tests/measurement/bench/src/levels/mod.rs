//! Levels of detail: Busbar's and those of the field, at equal numbers of vertices.
//!
//! Each method runs in a process of its own on one core ([`worker`]), where its
//! time and memory are measured; its levels come back as files and are measured
//! here, all by one ruler ([`figures`]).

mod contact_sheet;
mod exchange;
mod figures;
mod method;
mod ply;
mod report;
mod subject;
mod verdicts;
pub(crate) mod worker;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use indicatif::ProgressBar;
use serde::Serialize;

use crate::levels::contact_sheet::ContactSheet;
use crate::levels::figures::{Counts, Figures, Original};
use crate::levels::method::{METHODS, OURS};
use crate::levels::subject::Subject;
use crate::levels::worker::{Cost, Peers, Target};
use crate::scene::Scene;

pub(crate) use report::write;
pub(crate) use verdicts::{bars, write_worse};

/// Proportions of simplified vertices at which methods are compared.
const THETAS: [f64; 3] = [0.70, 0.85, 0.95];

/// Scope of the comparison: peers, meshes and output.
pub(crate) struct Plan {
    pub(crate) peers: Option<Peers>,
    /// Additional meshes to compare on.
    pub(crate) files: Vec<PathBuf>,
    /// Scan that the bars are judged on.
    pub(crate) scan: Option<PathBuf>,
    /// Flag for fewer meshes.
    pub(crate) quick: bool,
    /// Output folder of contact sheets.
    pub(crate) out: PathBuf,
}

/// Results of the comparison.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Levels {
    pub(crate) subjects: Vec<SubjectResult>,
    /// Omissions, with their reasons.
    pub(crate) remarks: Vec<String>,
}

/// Results on one mesh.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SubjectResult {
    pub(crate) name: String,
    pub(crate) is_judged: bool,
    /// Diagonal of the mesh's bounding box, metres.
    pub(crate) diagonal: f64,
    pub(crate) counts: Counts,
    /// Target numbers of vertices at each of the thetas.
    pub(crate) wanted: Vec<usize>,
    pub(crate) methods: Vec<MethodResult>,
    /// File of the contact sheet, beside the report.
    pub(crate) sheet: Option<String>,
}

/// Results of one method on one mesh.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MethodResult {
    pub(crate) id: &'static str,
    pub(crate) is_peer: bool,
    pub(crate) cost: Cost,
    /// Figures of each level, one a theta.
    pub(crate) levels: Vec<Figures>,
}

/// Compares all methods on all meshes.
pub(crate) fn run(scene: &Scene, plan: &Plan, progress: &ProgressBar) -> Result<Levels> {
    let mut subjects = subject::all(scene, &plan.files, plan.quick)?;
    let mut levels = Levels { subjects: Vec::new(), remarks: Vec::new() };
    match &plan.scan {
        Some(file) => subjects.push(subject::scan(file)?),
        None => levels.remarks.push("No scan from elsewhere: none was fetched.".to_owned()),
    }
    if plan.peers.is_none() {
        levels.remarks.push("No Python peers: no interpreter with them was given.".to_owned());
    }
    progress.set_length((subjects.len() * METHODS.len()) as u64);
    for subject in &subjects {
        let result = compare(subject, plan, &mut levels.remarks, progress)
            .with_context(|| format!("on {}", subject.name))?;
        levels.subjects.push(result);
    }
    Ok(levels)
}

fn compare(
    subject: &Subject,
    plan: &Plan,
    remarks: &mut Vec<String>,
    progress: &ProgressBar,
) -> Result<SubjectResult> {
    let topology = subject.mesh.topology();
    let folder = tempfile::tempdir().context("no folder for meshes")?;
    let file = folder.path().join("subject.mesh");
    exchange::write_mesh(&file, &subject.mesh)?;
    let original = Original::new(&topology)?;
    let count = topology.positions.len();
    let wanted = THETAS.map(|theta| count - (theta * count as f64).round() as usize);
    let share = topology.triangles.len() as f64 / count as f64;
    let mut targets =
        wanted.map(|vertices| Target { vertices, triangles: (vertices as f64 * share) as usize });
    let mut sheet = subject
        .sheet
        .map(|(name, bounds, towards_eye)| ContactSheet::new(name, &topology, bounds, towards_eye));
    let mut methods = Vec::new();
    for method in METHODS {
        progress.set_message(format!("{}: {}", subject.name, method.id));
        if matches!(method.work, method::Implementation::Script(_)) && plan.peers.is_none() {
            progress.inc(1);
            continue;
        }
        let peers = plan.peers.as_ref();
        match worker::levels(method, peers, &file, &targets) {
            Ok((cost, levels)) => {
                if let Some(sheet) = &mut sheet {
                    sheet.add(method, &levels);
                }
                let levels = levels.iter().map(|level| original.figures(level));
                let levels = levels.collect::<Result<Vec<_>>>()?;
                if method.id == OURS {
                    for (target, Figures { counts, .. }) in targets.iter_mut().zip(&levels) {
                        let share = counts.triangles as f64 / counts.vertices.max(1) as f64;
                        target.triangles = (target.vertices as f64 * share) as usize;
                    }
                }
                methods.push(MethodResult {
                    id: method.id,
                    is_peer: method.is_peer(),
                    cost,
                    levels,
                });
            }
            Err(error) if method.is_peer() => {
                remarks.push(format!("{} on {}: {error:#}.", method.id, subject.name));
            }
            Err(error) => return Err(error.context(method.id)),
        }
        progress.inc(1);
    }
    let sheet = sheet.map(|sheet| sheet.save(&plan.out)).transpose()?;
    Ok(SubjectResult {
        name: subject.name.clone(),
        is_judged: subject.is_judged,
        diagonal: original.diagonal(),
        counts: original.counts,
        wanted: wanted.to_vec(),
        methods,
        sheet,
    })
}

impl SubjectResult {
    fn method(&self, id: &str) -> Option<&MethodResult> {
        self.methods.iter().find(|method| method.id == id)
    }
}

/// Returns interpreter and scripts, if there is an interpreter.
pub(crate) fn peers(python: Option<&Path>, scripts: &Path) -> Option<Peers> {
    python.map(|python| Peers { python: python.to_owned(), scripts: scripts.to_owned() })
}
