//! The `steradian` binary.
fn main() {}
