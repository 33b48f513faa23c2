//! Command line of Osculate.
fn main() {}
