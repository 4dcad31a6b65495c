//! The words of the command line, where a program says them.

use std::path::{Path, PathBuf};

use clap::Parser;

use super::Trouble;
use crate::args::{Cli, Command, RenderArgs};
use crate::overrides;

/// What a command line for `steradian render` asks for, for a driver that renders elsewhere.
pub struct Asked {
    /// The scene; none for the one that is built in.
    pub scene: Option<PathBuf>,
    /// How to read it.
    pub reading: Vec<String>,
    /// Words for parts.
    pub words: Vec<String>,
    /// Words for `merge`, without parts: files and how to write them.
    pub writing: Vec<String>,
    /// Samples per pixel, if they were said.
    pub spp: Option<u32>,
    /// Whether `--error` ends it.
    pub error: bool,
    /// Where the engine is.
    pub address: Option<String>,
    /// In how many parts.
    pub parts: Option<u32>,
    /// Where to keep them.
    pub spill: Option<PathBuf>,
    /// Threads for each part.
    pub threads: Option<u16>,
    /// Whether nothing is to be printed but errors.
    pub quiet: bool,
    /// The file that is refreshed while rendering.
    pub preview: Option<PathBuf>,
}

/// Takes the command line of a render apart that is to happen on several machines.
///
/// # Errors
/// Words that make no sense, or not there.
pub fn asked(words: &[String]) -> Result<Asked, Trouble> {
    let args = parse_all(words)?;
    let refuse = |what: &str| Err(Trouble::Input(format!("{what} does not go with --engine")));
    match () {
        () if args.like.is_some() => return refuse("--like"),
        () if args.denoise => return refuse("--denoise"),
        () if args.turntable.is_some() => return refuse("--turntable"),
        () if args.keep.shard.is_some() || args.keep.checkpoint.is_some() => return refuse("--shard or --checkpoint"),
        () if args.run.tev.is_some() || args.run.counters.is_some() => return refuse("--tev or --counters"),
        () if args.stop.time.is_some() => return refuse("--time"),
        () if args.stop.adaptive.is_some() => return refuse("--adaptive"),
        () if args.output.variance.is_some() => return refuse("--variance"),
        () if args.scene.as_deref() == Some(Path::new("-")) => return refuse("standard input"),
        () => {}
    }
    let typed = |text: String| crate::model_args::words(&text);
    let mut words = typed(overrides::as_typed(&args.picture) + &args.stop.as_typed());
    let mut reading = Vec::new();
    args.picture.model.as_typed(|name, value| {
        reading.push(format!("--{name}"));
        reading.extend(value.filter(|v| !v.is_empty()));
    });
    let mut writing = Vec::new();
    for path in &args.output.output {
        writing.extend(["-o".to_owned(), path.display().to_string()]);
    }
    writing.extend(typed(args.output.as_typed()));
    if !args.aov.is_empty() {
        let names: Vec<String> = args.aov.iter().map(|a| a.name()).collect();
        words.extend(["--aov".to_owned(), names.join(",")]);
    }
    Ok(Asked {
        scene: args.scene,
        reading,
        words,
        writing,
        spp: args.picture.spp,
        error: args.stop.error.is_some(),
        address: args.engine.address,
        parts: args.engine.parts,
        spill: args.engine.spill,
        threads: args.run.threads,
        quiet: args.run.quiet,
        preview: args.run.preview,
    })
}

pub(super) fn parse_all(words: &[String]) -> Result<RenderArgs, Trouble> {
    let line = ["steradian", "render"].into_iter().map(String::from).chain(words.iter().cloned());
    let line = crate::with_criterion(line.map(Into::into).collect());
    match Cli::try_parse_from(line) {
        Ok(Cli { command: Command::Render(args) }) => Ok(*args),
        Ok(_) => Err(Trouble::Input("this is no render".into())),
        Err(e) => Err(Trouble::Input(e.to_string().trim().trim_start_matches("error: ").to_owned())),
    }
}

/// Words of the command line that say how to render; those that name files are refused.
pub(super) fn parse(words: &[String]) -> Result<RenderArgs, Trouble> {
    let args = parse_all(words)?;
    let refuse = |what: &str| Err(Trouble::Input(format!("{what} has no place here")));
    match () {
        () if args.scene.is_some() || args.like.is_some() => refuse("another scene"),
        () if !args.output.output.is_empty() || args.output.variance.is_some() => refuse("a file to write"),
        () if args.turntable.is_some() => refuse("--turntable"),
        () if args.keep.checkpoint.is_some() => refuse("--checkpoint"),
        () if args.engine.engine.is_some() => refuse("--engine"),
        () if args.run.preview.is_some() || args.run.tev.is_some() || args.run.counters.is_some() => {
            refuse("--preview, --tev or --counters")
        }
        () if args.run.max_memory.is_some() => refuse("--max-memory"),
        () => Ok(args),
    }
}
