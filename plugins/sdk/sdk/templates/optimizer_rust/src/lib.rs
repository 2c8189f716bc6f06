//! Optimizer plugin `my_plugin`: collapses the shortest edges first.

use busbar_plugin_sdk::{Collapse, CollapseList, Error, Host, Mesh, MeshOptimizer, Plugin};
use busbar_plugin_sdk::{Progress, export_plugin};

/// Edges between two reports of progress.
const REPORT_EVERY: usize = 4096;

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Longest edge that is collapsed, metres.
    #[schemars(range(min = 0.0))]
    longest: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { longest: f32::MAX }
    }
}

struct MyPlugin {
    settings: Settings,
}

impl Plugin for MyPlugin {
    const ID: &'static str = "com.example.my_plugin";
    const NAME: &'static str = "MyPlugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Collapses the shortest edges first.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl MeshOptimizer for MyPlugin {
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error> {
        let mut list = CollapseList::default();
        progress.report(0.0)?;
        let edges = list.stage("edges", || edges_by_length(&mesh));
        let mut removed = vec![false; mesh.positions.len()];
        for (index, &(length, kept, from)) in edges.iter().enumerate() {
            if index % REPORT_EVERY == 0 {
                progress.report(index as f32 / edges.len() as f32)?;
            }
            // Both ends live: the second moves onto the first.
            if length <= self.settings.longest && !removed[kept as usize] && !removed[from as usize]
            {
                removed[from as usize] = true;
                list.collapses.push(Collapse { removed: from, kept, error: length });
            }
        }
        progress.report(1.0)?;
        Ok(list)
    }
}

/// Each edge once: length and ends, the shortest first. Ties go by number, so that the
/// order is the same on every machine.
fn edges_by_length(mesh: &Mesh<'_>) -> Vec<(f32, u32, u32)> {
    let mut edges = Vec::with_capacity(mesh.triangles.len() * 3);
    for &[a, b, c] in mesh.triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let [p, q] = [a, b].map(|end| mesh.positions[end as usize].map(f64::from));
            let squared: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
            edges.push((squared.sqrt() as f32, a.min(b), a.max(b)));
        }
    }
    edges.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    edges.dedup();
    edges
}

export_plugin!(MyPlugin: mesh_optimizer);

#[cfg(test)]
mod tests;
