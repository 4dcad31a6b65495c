//! Chores of the repository.

mod tables;

fn main() -> anyhow::Result<()> {
    match std::env::args().nth(1).as_deref() {
        Some("tables") => tables::run(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/spectrum/data").as_ref()),
        _ => anyhow::bail!("usage: cargo run -p xtask -- tables"),
    }
}
