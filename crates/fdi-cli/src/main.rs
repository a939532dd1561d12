//! The command `fdi`.

fn main() {}
