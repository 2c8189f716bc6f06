//! Test scenes: the paper's substation as one mesh, whole and at levels of detail.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use busbar_commands::OptimizedModel;
use busbar_geometry::Bounds;
use serde_json::json;
use substation::Station;

/// Seed of the equipment's erection tolerance, which is the generator's default.
pub(crate) const SEED: u64 = 1;
/// Shares of the triangles at the compared levels.
pub(crate) const SHARES: [f64; 3] = [1.0, 0.3, 0.15];
/// Optimizer of the levels of detail.
const OPTIMIZER: &str = "quadric_collapse";
/// Number of halvings until a level's share is met to a ten-thousandth.
const HALVINGS: usize = 14;

/// Scene at a level of detail.
pub(crate) struct Level {
    pub(crate) share: f64,
    pub(crate) glb: PathBuf,
    pub(crate) triangles: u64,
}

/// Files of the test scene.
pub(crate) struct Scenes {
    /// Levels for each of [`SHARES`], the whole first.
    pub(crate) levels: Vec<Level>,
    pub(crate) bounds: Bounds,
}

impl Scenes {
    /// Makes the scenes in a folder, with the optimiser of a folder of plugins.
    pub(crate) fn make(folder: &Path, plugins: &Path) -> Result<Self> {
        let flat = Station::generate(SEED)?.flatten()?;
        let mesh = flat.model.meshes.first().context("the scene has no mesh")?;
        let bounds =
            Bounds::from_points(mesh.positions.iter().copied()).context("an empty scene")?;
        let whole = folder.join("paper.glb");
        fs::write(&whole, busbar_gltf_export::write_glb(&flat.model)?)?;
        let (plugins, none) = ([plugins.to_owned()], json!({}));
        let model = OptimizedModel::build(&whole, &plugins, OPTIMIZER, &none, &|_, _| ())?;
        let full = model.stats(0.0).triangles;
        let mut levels = vec![Level { share: 1.0, glb: whole, triangles: full }];
        for &share in &SHARES[1..] {
            let theta = theta_of(&model, (full as f64 * share) as u64);
            let glb = folder.join(format!("paper_{:.0}.glb", share * 100.0));
            fs::write(&glb, model.write(theta)?)?;
            levels.push(Level { share, glb, triangles: model.stats(theta).triangles });
        }
        Ok(Self { levels, bounds })
    }
}

/// Writes the station's models where its configuration looks for them.
pub(crate) fn write_models(folder: &Path) -> Result<()> {
    let models = folder.join("station");
    fs::create_dir_all(&models)?;
    for (name, entry) in Station::generate(SEED)?.catalogue.iter() {
        fs::write(
            models.join(format!("{name}.glb")),
            busbar_gltf_export::write_glb(&entry.model)?,
        )?;
    }
    Ok(())
}

/// Returns the theta at which no more than so many triangles are left.
fn theta_of(model: &OptimizedModel, triangles: u64) -> f64 {
    let (mut fine, mut coarse) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = (fine + coarse) * 0.5;
        if model.stats(middle).triangles > triangles {
            fine = middle;
        } else {
            coarse = middle;
        }
    }
    coarse
}
