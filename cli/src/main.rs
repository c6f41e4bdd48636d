//! The `dust3d` command.
fn main() {}
