//! Test that the configuration in the repository is the generated one.

use std::path::Path;

use substation::Station;

#[test]
fn the_committed_configuration_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../config/dga.json");
    let made = fleet::text(&Station::generate(1).expect("it is made"), false);
    if std::env::var_os("BUSBAR_BLESS").is_some() {
        std::fs::write(&path, &made).expect("it can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == made, "run again with BUSBAR_BLESS=1, or `cargo xtask stage`");
}
