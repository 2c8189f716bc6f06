//! The project's commands: demo, test, bench, soak

fn main() {}
