//! Optimisers in a process of their own: the same results, and cancellation.

use std::time::{Duration, Instant};

use busbar_geometry::{Mesh, Section, Wedges};
use busbar_plugin_host::{LoadRules, OptimizedMesh, PluginError};
use busbar_plugin_process::{Isolation, Optimizer, PluginCatalog, PluginOptions};
use e2e::Scene;
use glam::{Vec2, Vec3};
use serde_json::json;

/// Longest time of a cancellation, far below the optimisation of the large grid.
const MAX_TO_CANCEL: Duration = Duration::from_secs(5);

/// Builds a bumpy sheet of `side` by `side` positions.
fn sheet(side: u32) -> Mesh {
    let at = |x: u32, y: u32| {
        let [fx, fy] = [x, y].map(|c| c as f32 * 0.1);
        Vec3::new(fx, fy, (fx * 1.7).sin() * (fy * 2.3).cos())
    };
    let positions: Vec<Vec3> =
        (0..side * side).map(|index| at(index % side, index / side)).collect();
    let count = positions.len();
    let cells = (0..(side - 1) * (side - 1)).map(|i| i % (side - 1) + i / (side - 1) * side);
    let triangles: Vec<[u32; 3]> =
        cells.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]).collect();
    Mesh {
        wedges: Wedges {
            position: (0..count as u32).collect(),
            normal: vec![Vec3::Z; count],
            uv: vec![Vec2::ZERO; count],
            section: vec![0; count],
        },
        positions,
        sections: vec![Section {
            material: None,
            first_triangle: 0,
            triangle_count: triangles.len() as u32,
        }],
        triangles,
        features: Vec::new(),
    }
}

fn optimizer(scene: &Scene, plugin: &str, isolation: Isolation) -> Optimizer {
    let rules = LoadRules::default();
    let catalog = PluginCatalog::discover(&[scene.path("plugins")], &rules, isolation);
    let options = PluginOptions { isolation, ..PluginOptions::default() };
    let plugin = catalog.create("optimizer", plugin, &json!({}), &options).expect("it is there");
    Optimizer::from_plugin(&plugin).expect("it optimises")
}

#[test]
fn results_are_the_same_either_way() {
    let (scene, mesh) = (Scene::demo(1), sheet(60));
    for plugin in ["quadric_collapse", "weighted_collapse"] {
        let [apart, here] = [Isolation::Process, Isolation::None].map(|isolation| {
            let optimised = optimizer(&scene, plugin, isolation).optimize(&mesh, |_| true);
            let OptimizedMesh { sequence, stages } = optimised.expect("it can be done");
            (sequence, stages.into_iter().map(|(name, _)| name).collect::<Vec<_>>())
        });
        assert!(apart.0.len() > 1000, "{} collapses", apart.0.len());
        assert!(apart == here, "{plugin}");
    }
}

#[test]
fn who_reads_no_wedges_says_so() {
    let scene = Scene::demo(1);
    for (plugin, reads) in [("quadric_collapse", true), ("weighted_collapse", false)] {
        let optimizer = optimizer(&scene, plugin, Isolation::None);
        let Optimizer::InProcess(optimizer) = optimizer else { panic!("it is in this process") };
        assert_eq!(optimizer.reads_wedges(), reads, "{plugin}");
    }
}

#[test]
fn work_can_be_cancelled_and_the_next_is_done() {
    let scene = Scene::demo(1);
    let optimizer = optimizer(&scene, "quadric_collapse", Isolation::Process);
    let mesh = sheet(1000);
    let start = Instant::now();
    let mut asked = 0;
    let outcome = optimizer.optimize(&mesh, |fraction| {
        assert!((0.0..=1.0).contains(&fraction));
        asked += 1;
        asked < 3
    });
    assert!(matches!(outcome, Err(PluginError::Cancelled)), "{:?}", outcome.map(|o| o.stages));
    assert!(start.elapsed() < MAX_TO_CANCEL, "{:?}", start.elapsed());
    assert!(optimizer.optimize(&sheet(20), |_| true).is_ok());
}
