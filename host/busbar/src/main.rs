//! The Busbar program: arguments, window, composition

fn main() {}
