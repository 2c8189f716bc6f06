//! Collapse sequences of small meshes.

use busbar_plugin_sdk::testing::{Grid, check_sequence, host, stopping_after};

use super::*;

fn optimizer(longest: f32) -> MyPlugin {
    MyPlugin::create(Settings { longest }, host()).unwrap()
}

#[test]
fn a_grid_gives_a_valid_sequence() {
    let grid = Grid::new(20, 10);
    let list = optimizer(f32::MAX).optimize(grid.mesh(), &mut Progress::detached()).unwrap();
    assert_eq!(check_sequence(&grid.mesh(), &list.collapses), Ok(()));
    assert!(list.collapses.len() > 100, "{} collapses", list.collapses.len());
    let none = optimizer(0.5).optimize(grid.mesh(), &mut Progress::detached()).unwrap();
    assert!(none.collapses.is_empty(), "its edges are longer than half a metre");
}

#[test]
fn it_stops_when_asked() {
    let grid = Grid::new(20, 10);
    let result = stopping_after(1, |progress| optimizer(1.0).optimize(grid.mesh(), progress));
    assert_eq!(result.unwrap_err(), Error::cancelled());
}
