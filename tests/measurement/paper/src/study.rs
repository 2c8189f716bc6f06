//! Study of variants to simplify one model, each with its error and pictures.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use busbar_geometry::{CollapseSequence, CollapseStacks, Mesh, Topology};
use serde::Serialize;

use crate::progress::Progress;
use crate::scene::SingleMesh;
use crate::studio::{Studio, Subject, save};
use crate::topology::{Shells, TopologyCounts, live};
use crate::variants::{self, CLOSED, ORDERS, READINGS, SPLIT, Variant, VariantOutput};
use measure::{Reference, SurfaceError};

/// Thetas at which variants are compared.
pub const THETAS: [f64; 3] = [0.7, 0.85, 0.95];
/// Number of points drawn on a surface; the seed is the same for all.
const SAMPLE_SEED: u64 = 773;
/// Size of a picture, pixels.
const PICTURE: [u32; 2] = [960, 720];

/// Study of the model that Figures 6 to 8 show.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Study of the welded mesh, as imported: edges are those of the surface.
    pub welded: SubjectStudy,
    /// Study of the welded mesh without undersides: shells have borders.
    pub open: SubjectStudy,
    /// Study of the mesh with every vertex of the file on its own: seams of normals are borders.
    pub split: SubjectStudy,
}

/// Results of all variants on one mesh.
#[derive(Clone, Debug, Serialize)]
pub struct SubjectStudy {
    /// Counts of the mesh at theta 0.
    pub full: TopologyCounts,
    /// File of the picture at theta 0.
    pub picture: String,
    /// File of the wireframe picture.
    pub wireframe: String,
    /// Shares of the four factors in the variance of W, as Busbar reads the paper: length, flag,
    /// area, curvature.
    pub variance_shares: [f64; 4],
    /// Variants, the reference reading first.
    pub variants: Vec<VariantResult>,
}

/// Results of one variant at each theta.
#[derive(Clone, Debug, Serialize)]
pub struct VariantResult {
    /// Short name, in file names too.
    pub id: &'static str,
    /// Name of the variant for readers.
    pub name: &'static str,
    /// Milliseconds to make the sequence, or all levels of the peer.
    pub millis: f64,
    /// Levels in the order of [`THETAS`].
    pub levels: Vec<Level>,
}

/// Level of a variant at one theta.
#[derive(Clone, Debug, Serialize)]
pub struct Level {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Counts of the simplified mesh.
    pub counts: TopologyCounts,
    /// Distances to the original; none without a surface.
    pub error: Option<SurfaceError>,
    /// Area as a share of the original's.
    pub area_share: f64,
    /// Enclosed volume, as a share of the original's; none where the original
    /// has borders, and so encloses nothing.
    pub volume_share: Option<f64>,
    /// File of the picture, beside the report.
    pub picture: String,
    /// File of the wireframe at the greatest theta.
    pub wireframe: Option<String>,
}

impl Study {
    /// Treats a model in all ways, with so many points drawn on each surface;
    /// pictures go to `folder`.
    ///
    /// # Errors
    /// The device's, the plugin's, or the file system's.
    pub fn make(
        model: &SingleMesh,
        samples: usize,
        folder: &Path,
        progress: &Progress,
    ) -> Result<Self> {
        let closed = [&CLOSED[..], &ORDERS].concat();
        progress.stage("orders of collapse", closed.len() + READINGS.len() + SPLIT.len());
        let mut studio = Studio::new(&model.mesh.positions, PICTURE)?;
        let mut make = |model: &SingleMesh, prefix, variants: &[Variant]| {
            StudyContext::new(model, prefix, samples, folder, &mut studio)?
                .study(variants, progress)
        };
        Ok(Self {
            welded: make(model, "welded", &closed)?,
            open: make(&model.without_undersides()?, "open", &READINGS)?,
            split: make(&model.split(), "split", &SPLIT)?,
        })
    }
}

impl SubjectStudy {
    /// Returns the variant with this id.
    pub fn variant(&self, id: &str) -> Option<&VariantResult> {
        self.variants.iter().find(|variant| variant.id == id)
    }

    /// Returns a variant at a theta.
    pub fn level(&self, id: &str, theta: f64) -> Option<&Level> {
        self.variant(id)?.levels.iter().find(|level| level.theta == theta)
    }
}

/// Mesh with the instruments that its variants are measured with.
struct StudyContext<'a> {
    model: &'a SingleMesh,
    topology: Topology,
    reference: Reference,
    shells: Shells,
    full: TopologyCounts,
    prefix: &'static str,
    folder: &'a Path,
    studio: &'a mut Studio,
}

impl<'a> StudyContext<'a> {
    fn new(
        model: &'a SingleMesh,
        prefix: &'static str,
        samples: usize,
        folder: &'a Path,
        studio: &'a mut Studio,
    ) -> Result<Self> {
        let topology = model.mesh.topology();
        let reference = Reference::new(&topology, samples, SAMPLE_SEED)?;
        let shells = Shells::new(&topology);
        let full = shells.count(&topology, topology.positions.len() as u32);
        Ok(Self { model, topology, reference, shells, full, prefix, folder, studio })
    }

    fn study(mut self, variants: &[Variant], progress: &Progress) -> Result<SubjectStudy> {
        let full = uncollapsed(&self.model.mesh);
        let picture = self.render(&full, 0, "00", false)?;
        let wireframe = self.render(&full, 0, "00", true)?;
        let mut results = Vec::with_capacity(variants.len());
        for variant in variants {
            results.push(self.run(variant)?);
            progress.step();
        }
        Ok(SubjectStudy {
            full: self.full,
            picture,
            wireframe,
            variance_shares: variants::variance_shares(&self.topology)?,
            variants: results,
        })
    }

    fn run(&mut self, variant: &Variant) -> Result<VariantResult> {
        let started = Instant::now();
        let made = variant.make(&self.topology, THETAS)?;
        let millis = started.elapsed().as_secs_f64() * 1e3;
        let meshes = match made {
            VariantOutput::Sequence(sequence) => {
                let stacks = CollapseStacks::build(self.model.mesh.clone(), &sequence);
                let stacks = Arc::new(stacks);
                THETAS.map(|theta| (stacks.clone(), stacks.cursor_for_theta(theta)))
            }
            VariantOutput::Levels(levels) => levels.map(|mesh| (uncollapsed(&mesh), 0)),
        };
        let mut levels = Vec::with_capacity(THETAS.len());
        for (theta, (stacks, cursor)) in THETAS.into_iter().zip(meshes) {
            levels.push(self.level(variant, theta, &stacks, cursor)?);
        }
        Ok(VariantResult { id: variant.id, name: variant.name, millis, levels })
    }

    fn level(
        &mut self,
        variant: &Variant,
        theta: f64,
        stacks: &Arc<CollapseStacks>,
        cursor: u32,
    ) -> Result<Level> {
        let live = live(stacks, cursor);
        let counts = self.shells.count(&live, stacks.surviving(cursor));
        let file = format!("{}-{:.0}", variant.id, theta * 100.0);
        let last = theta == THETAS[THETAS.len() - 1];
        Ok(Level {
            theta,
            counts,
            error: self.reference.compare(&live),
            area_share: area(&live) / area(&self.topology),
            volume_share: (self.full.border_edges == 0)
                .then(|| volume(&live) / volume(&self.topology)),
            picture: self.render(stacks, cursor, &file, false)?,
            wireframe: last.then(|| self.render(stacks, cursor, &file, true)).transpose()?,
        })
    }

    fn render(
        &mut self,
        stacks: &Arc<CollapseStacks>,
        cursor: u32,
        name: &str,
        wireframe: bool,
    ) -> Result<String> {
        let subject = Subject { stacks, materials: &self.model.materials };
        let picture = self.studio.render(subject, cursor, wireframe)?;
        let kind = if wireframe { "-wire" } else { "" };
        let file = format!("{}-{name}{kind}.png", self.prefix);
        save(&picture, &self.folder.join(&file))?;
        Ok(file)
    }
}

/// Creates stacks without any collapse.
fn uncollapsed(mesh: &Mesh) -> Arc<CollapseStacks> {
    let sequence = CollapseSequence::empty(mesh.positions.len() as u32);
    Arc::new(CollapseStacks::build(mesh.clone(), &sequence))
}

fn area(mesh: &Topology) -> f64 {
    let product = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
        (b - a).cross(c - a).length() / 2.0
    };
    mesh.triangles.iter().map(product).sum()
}

/// Computes the volume that closed shells enclose, each counted by itself: a sixth of the sum of
/// triple products. The value has no meaning for open shells.
fn volume(mesh: &Topology) -> f64 {
    let product = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(product).sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_tetrahedron_has_its_volume_and_area() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let moved = positions.iter().map(|&p| p + Vec3::splat(7.0)).collect();
        for positions in [positions, moved] {
            let tetrahedron = Topology { positions, triangles: triangles.clone() };
            let found = volume(&tetrahedron);
            assert!((found - 1.0 / 6.0).abs() < 1e-5, "{found}");
            let found = area(&tetrahedron);
            assert!((found - (1.5 + 0.75_f64.sqrt())).abs() < 1e-5, "{found}");
        }
    }
}
