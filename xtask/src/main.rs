//! Chores of the repository.

mod sheet;
mod tables;
mod tidy;

fn main() -> anyhow::Result<()> {
    match std::env::args().nth(1).as_deref() {
        Some("tables") => tables::run(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/spectrum/data").as_ref()),
        Some("tidy") => {
            tell(&tidy::run(concat!(env!("CARGO_MANIFEST_DIR"), "/..").as_ref())?);
            Ok(())
        }
        Some("sheet") => {
            let rest: Vec<String> = std::env::args().skip(2).collect();
            let (folder, out, program) = match rest.as_slice() {
                [folder, out] => (folder, out, "steradian"),
                [folder, out, program] => (folder, out, program.as_str()),
                _ => anyhow::bail!("usage: cargo run -p xtask -- sheet FOLDER OUT.png [STERADIAN]"),
            };
            tell(sheet::run(folder.as_ref(), out.as_ref(), program.as_ref())?.trim_end());
            Ok(())
        }
        _ => anyhow::bail!("usage: cargo run -p xtask -- tables|tidy|sheet"),
    }
}

#[expect(clippy::print_stdout, reason = "this is a program's answer")]
fn tell(words: &str) {
    println!("{words}");
}
