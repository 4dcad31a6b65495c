//! The lecture, runnable and measured: every idea of Curless, "Anti-aliasing and Monte Carlo Path Tracing" (CSE 557,
//! 2017) as an experiment, every claim as a number with an interval, all in one report.
//!
//! ```no_run
//! use steradian_lab::{Effort, Quiet, Setting, Topic, run};
//!
//! let setting = Setting { effort: Effort::Quick, seed: 1, threads: 2, brute_force: None };
//! let report = run(&[Topic::Quadrature, Topic::Estimator], &setting, &Quiet)?;
//! assert!(report.claims().all(|c| c.holds()));
//! report.write(std::path::Path::new("lab"))?;
//! # Ok::<(), steradian_lab::Error>(())
//! ```
//!
//! A claim is judged at a false-alarm rate of [`FALSE_ALARM`], stated with it. Everything is a function of the seed.

mod brute_force;
pub mod claim;
mod command;
mod error;
mod experiment;
pub mod measure;
mod paint;
mod parallel;
mod report;
pub mod slides;
mod stage;
mod topic;
mod topics;

pub use brute_force::{ABSURD_TESTS, BruteForce, TESTS_PER_SECOND};
pub use claim::{Claim, FALSE_ALARM, Verdict};
pub use command::{Options, run_cli_like};
pub use error::Error;
pub use experiment::{Answer, Axis, Block, Effort, Erratum, Experiment, Figure, Mark, Picture, Series, Setting, Table};
pub use report::{Report, Section};
pub use topic::Topic;

use std::time::Instant;

/// Watches a run.
pub trait Progress {
    /// An experiment begins: number `index` of `count`.
    fn started(&self, _topic: Topic, _index: usize, _count: usize) {}
    /// It is done.
    fn finished(&self, _experiment: &Experiment, _seconds: f64) {}
    /// Asked between experiments: whether to stop here and report what there is.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing.
pub struct Quiet;

impl Progress for Quiet {}

/// Runs the experiments of the given topics (of all, if none is given), each once, in the order of the lecture.
///
/// # Errors
/// `Error::Scene` if a scene cannot be built, which would be a bug.
pub fn run(topics: &[Topic], setting: &Setting, progress: &dyn Progress) -> Result<Report, Error> {
    let wanted: Vec<Topic> = Topic::ALL.into_iter().filter(|t| topics.is_empty() || topics.contains(t)).collect();
    let mut sections = Vec::with_capacity(wanted.len());
    for (i, &topic) in wanted.iter().enumerate() {
        if progress.cancelled() {
            break;
        }
        progress.started(topic, i, wanted.len());
        let start = Instant::now();
        let experiment = topics::run(topic, setting)?;
        let seconds = start.elapsed().as_secs_f64();
        progress.finished(&experiment, seconds);
        sections.push(Section { experiment, seconds });
    }
    Ok(Report { sections, setting: *setting })
}
