//! A physically based Monte Carlo renderer: the command line as a library, and the small public face.
//!
//! Programs use [`load`] and [`render()`]; the binary uses [`run`]. All that lies beneath is in crates of its own.

mod again;
mod aov;
mod args;
mod camera_args;
mod check;
mod compare;
mod console;
mod convert;
mod counting;
mod cryptomatte;
mod denoise;
pub mod embed;
mod engine;
mod face;
mod failure;
mod gbuffer;
mod hashing;
mod info;
mod interrupt;
mod keep;
mod lab;
mod merge;
mod model_args;
mod numbers;
mod oidn;
mod opened;
mod output;
mod overrides;
mod progress;
mod render;
mod sampler_error;
mod selftest;
mod stop;
mod submit;
mod technique_args;
mod tev;
mod trace;
mod view;
mod watch;

use std::ffi::OsString;

use clap::{CommandFactory, Parser};

use args::{Cli, Command};
use console::Console;
use failure::Failure;

pub use face::{LoadError, RenderError, load, load_text, render};
pub use steradian_image::Image;
pub use steradian_scene::{FilmSettings, RenderSettings, Scene};

/// The code in the README is compiled and run like any other example.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Does what a command line says, printing as it goes; `args` starts with the program's name. Returns the exit code: 0 done, 1
/// compared images differ, 2 the input is at fault, 3 the environment is, 130 interrupted.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let console = Console::new();
    let words = with_criterion(with_command(args.into_iter().collect()));
    let cli = match Cli::try_parse_from(words.iter().cloned()) {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version are answers, not errors, and go to standard output. A closed pipe has read enough.
            let _ = e.print();
            return if e.use_stderr() { failure::INPUT } else { failure::DONE };
        }
    };
    let result = match &cli.command {
        Command::Render(args) if args.engine.engine.is_some() => engine::run(words.get(2..).unwrap_or_default()),
        Command::Render(args) => render::run(args, &console),
        Command::Submit(args) => submit::run(args, &console),
        Command::Selftest(args) => selftest::run_all(args, &console),
        Command::Merge(args) => merge::run(args, &console),
        Command::Check(args) => check::run(args, &console),
        Command::Convert(args) => convert::run(args, &console),
        Command::Info(args) => info::run(args, &console),
        Command::Compare(args) => compare::run(args, &console),
        Command::Trace(args) => trace::run(args, &console),
        Command::View(args) => view::run(args, &console),
        Command::Lab(args) => lab::run(args, &console),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "steradian", &mut script);
            console.raw(&script);
            Ok(failure::DONE)
        }
    };
    result.unwrap_or_else(|failure| {
        if !matches!(failure, Failure::Reported) {
            for line in failure.to_string().lines() {
                console.error(line);
            }
        }
        failure.code()
    })
}

/// Puts in `render` where it was left out, as pbrt's users are used to: `steradian scene.pbrt`, `steradian --spp 16 scene.pbrt`.
fn with_command(mut args: Vec<OsString>) -> Vec<OsString> {
    let is_scene = |a: &OsString| {
        let pbrt = |a: &str| a.ends_with(".pbrt") || a.ends_with(".pbrt.gz");
        a.to_str().is_some_and(pbrt) || steradian_load::is_model(a.as_ref())
    };
    let starts_with_flag = args.get(1).and_then(|a| a.to_str()).is_some_and(|a| a.starts_with('-'));
    if args.get(1).is_some_and(is_scene) || starts_with_flag && args.iter().any(is_scene) {
        args.insert(1, "render".into());
    }
    args
}

/// Lets the word of `--adaptive` stand apart, as in `--adaptive contrast`; any other word after it is not its own.
fn with_criterion(args: Vec<OsString>) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::with_capacity(args.len());
    for arg in args {
        match out.last_mut() {
            Some(last) if last == "--adaptive" && (arg == "contrast" || arg == "error") => {
                last.push("=");
                last.push(arg);
            }
            _ => out.push(arg),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_criterion_may_stand_apart() {
        let full = |line: &str| with_criterion(line.split(' ').map(OsString::from).collect()).join(" ".as_ref());
        assert_eq!(full("s render --adaptive contrast a.pbrt"), "s render --adaptive=contrast a.pbrt");
        for line in ["s render --adaptive a.pbrt", "s render a.pbrt --adaptive", "s lab --adaptive=error contrast"] {
            assert_eq!(full(line), line);
        }
    }

    #[test]
    fn the_word_render_may_be_left_out() {
        let full = |line: &str| with_command(line.split(' ').map(OsString::from).collect()).join(" ".as_ref());
        assert_eq!(full("steradian a.pbrt --spp 4"), "steradian render a.pbrt --spp 4");
        assert_eq!(full("steradian --spp 4 a.pbrt.gz"), "steradian render --spp 4 a.pbrt.gz");
        for line in ["steradian --help", "steradian check a.pbrt", "steradian rendr a.pbrt", "steradian"] {
            assert_eq!(full(line), line);
        }
    }
}
