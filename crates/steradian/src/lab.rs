//! `steradian lab`: the lecture's experiments, measured, and their report.

use std::path::PathBuf;

use steradian_lab::{Effort, Error, Experiment, Options, Progress, Topic, run_cli_like};

use crate::args::LabArgs;
use crate::console::Console;
use crate::failure::{DIFFERS, DONE, Failure, INTERRUPTED};
use crate::{interrupt, numbers};

/// Tells of each experiment as it is done, and as JSON of each claim.
struct Teller<'a> {
    console: &'a Console,
    json: bool,
}

impl Progress for Teller<'_> {
    fn started(&self, topic: Topic, index: usize, count: usize) {
        self.console.say(format_args!("{:2} of {count}  {topic} ...", index + 1));
    }
    fn finished(&self, experiment: &Experiment, seconds: f64) {
        let claims = &experiment.claims;
        let held = claims.iter().filter(|c| c.holds()).count();
        if self.json {
            claims.iter().for_each(|c| self.console.out(c.to_json()));
        }
        self.console.say(format_args!(
            "          {held} of {} hold, {}",
            numbers::counted(claims.len() as u64, "claim"),
            numbers::duration(std::time::Duration::from_secs_f64(seconds))
        ));
    }
    fn cancelled(&self) -> bool {
        interrupt::flag().load(std::sync::atomic::Ordering::Relaxed)
    }
}

/// Runs the experiments, writes the report, prints the claims. The exit code is 1 if one does not hold.
pub(crate) fn run(args: &LabArgs, console: &Console) -> Result<u8, Failure> {
    let talk = console.quiet(args.quiet);
    interrupt::listen();
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from("steradian-lab"));
    let options = Options {
        topics: args.topics.clone(),
        folder: Some(folder.clone()),
        effort: if args.full { Effort::Full } else { Effort::Quick },
        seed: args.seed,
        threads: args.threads.map_or_else(crate::render::default_threads, usize::from),
        brute_force: args.brute_force,
        insist: args.yes,
    };
    let working = interrupt::Working::begin();
    let report = run_cli_like(&options, &Teller { console: &talk, json: args.json }).map_err(|e| match e {
        Error::UnknownTopic { .. } | Error::Absurd { .. } | Error::NotCost => Failure::Input(e.to_string()),
        _ => Failure::Environment(e.to_string()),
    })?;
    drop(working);
    for claim in report.claims().filter(|c| !c.holds()) {
        talk.warning(format_args!(
            "{}: {}: predicted {}, measured {}",
            claim.topic, claim.claim, claim.predicted, claim.measured
        ));
    }
    talk.say(format_args!("the report is {}", folder.join("report.html").display()));
    if interrupt::flag().load(std::sync::atomic::Ordering::Relaxed) {
        return Ok(INTERRUPTED);
    }
    Ok(if report.holds() { DONE } else { DIFFERS })
}
