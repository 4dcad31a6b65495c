//! The whole report, or some topics of it: `cargo run --release -p steradian-lab --example report -- FOLDER [--full] [--seed=N] [TOPIC]...`
//! (`steradian lab` does the same).
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_lab::{Effort, Experiment, Options, Progress, Topic, run_cli_like};

struct Lines;

impl Progress for Lines {
    fn started(&self, topic: Topic, index: usize, count: usize) {
        println!("{}/{count} {topic}", index + 1);
    }

    fn finished(&self, e: &Experiment, seconds: f64) {
        println!("    {} claims, {seconds:.1} s: {}", e.claims.len(), e.result);
        e.claims.iter().filter(|c| !c.holds()).for_each(|c| println!("    FAILS {}", c.to_json()));
    }
}

fn main() -> Result<(), steradian_lab::Error> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().map(Into::into);
    let (flags, topics): (Vec<String>, Vec<String>) = words.partition(|w| w.starts_with("--"));
    let has = |flag: &str| flags.iter().any(|f| f == flag);
    let effort = match (has("--full"), has("--least")) {
        (true, _) => Effort::Full,
        (_, true) => Effort::Least,
        _ => Effort::Quick,
    };
    let seed = flags.iter().find_map(|f| f.strip_prefix("--seed=")?.parse().ok()).unwrap_or(1);
    let threads = std::thread::available_parallelism().map_or(1, Into::into);
    let report =
        run_cli_like(&Options { topics, folder, effort, seed, threads, brute_force: None, insist: false }, &Lines)?;
    println!("{} of {} claims hold", report.claims().filter(|c| c.holds()).count(), report.claims().count());
    Ok(())
}
