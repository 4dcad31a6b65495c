//! Chores of the repository.

mod tables;
mod tidy;

fn main() -> anyhow::Result<()> {
    match std::env::args().nth(1).as_deref() {
        Some("tables") => tables::run(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/spectrum/data").as_ref()),
        Some("tidy") => {
            let words = tidy::run(concat!(env!("CARGO_MANIFEST_DIR"), "/..").as_ref())?;
            #[expect(clippy::print_stdout, reason = "this is a program's answer")]
            {
                println!("{words}");
            }
            Ok(())
        }
        _ => anyhow::bail!("usage: cargo run -p xtask -- tables|tidy"),
    }
}
