//! A Modbus TCP device for demos and tests

fn main() {}
