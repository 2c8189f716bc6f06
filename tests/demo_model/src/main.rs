//! Makes the demo models: a power transformer and a breaker

fn main() {}
