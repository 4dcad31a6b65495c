//! What `steradian lab` does, for whoever reads the command line.

use crate::{ABSURD_TESTS, BruteForce, Effort, Error, Progress, Report, Setting, Topic, run};
use std::path::PathBuf;

/// The command line of the laboratory, as words and numbers.
#[derive(Clone, Debug)]
pub struct Options {
    /// Names of topics; all of them if empty.
    pub topics: Vec<String>,
    /// Where the report goes; nothing is written without it.
    pub folder: Option<PathBuf>,
    /// How hard to work.
    pub effort: Effort,
    /// Where all random numbers start.
    pub seed: u64,
    /// Threads; at least one.
    pub threads: usize,
    /// Parameters of brute force to count too.
    pub brute_force: Option<BruteForce>,
    /// Whether to start even what would take absurdly long.
    pub insist: bool,
}

/// Checks the names and the folder, runs, and writes the report.
///
/// The caller prints: [`crate::Claim::to_json`] of each claim for `--json`, and exits with 1 unless [`Report::holds`].
///
/// # Errors
/// `Error::UnknownTopic`, `Error::Absurd`, `Error::NotCost` and `Error::Write` come before any work is done.
pub fn run_cli_like(options: &Options, progress: &dyn Progress) -> Result<Report, Error> {
    let topics: Vec<Topic> = options.topics.iter().map(|t| Topic::from_name(t)).collect::<Result<_, _>>()?;
    if let Some(parameters) = options.brute_force {
        if !(topics.is_empty() || topics.contains(&Topic::Cost)) {
            return Err(Error::NotCost);
        }
        if parameters.tests() > ABSURD_TESTS && !options.insist {
            return Err(Error::Absurd { parameters });
        }
    }
    if let Some(folder) = &options.folder {
        // The folder is tried first: nobody wants to hear of it after twenty minutes.
        let attempt = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
        attempt.map_err(|source| Error::Write { path: folder.clone(), source })?;
    }
    let setting = Setting {
        effort: options.effort,
        seed: options.seed,
        threads: options.threads.max(1),
        brute_force: options.brute_force,
    };
    let report = run(&topics, &setting, progress)?;
    if let Some(folder) = &options.folder {
        report.write(folder)?;
    }
    Ok(report)
}
