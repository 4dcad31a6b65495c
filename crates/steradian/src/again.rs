//! `render --like image.exr`: what an image says of how it was made, as options.

use std::path::{Path, PathBuf};

use clap::{CommandFactory, FromArgMatches};

use crate::args::{Cli, Command, RenderArgs};
use crate::failure::{Failure, reason};
use crate::opened::SHOWCASE_NAME;
use crate::overrides;

/// The options of `args`, completed by those that made the image of `--like`; and the hash of its scene.
pub(crate) fn complete(args: &RenderArgs) -> Result<(RenderArgs, Option<String>), Failure> {
    let Some(path) = &args.like else { return Ok((args.clone(), None)) };
    let name = path.display();
    let bytes = std::fs::read(path).map_err(|e| Failure::Input(format!("{name}: {}", reason(&e))))?;
    let image = steradian_image::read(&bytes, &name.to_string()).map_err(|e| Failure::Input(e.to_string()))?;
    let meta = &image.metadata;
    let (Some(scene), Some(options)) = (meta.text("steradian.scene"), meta.text("steradian.options")) else {
        return Err(Failure::Input(format!("{name}: it does not say how it was made; Steradian's .exr files do")));
    };
    let number = |name: &str| meta.number(name).map(|v| v as u32).filter(|&n| n > 0);
    let mut words = options.to_owned();
    if let (Some(nominal), Some(planned)) = (number("steradian.nominalSpp"), number("steradian.plannedSpp"))
        && (nominal != planned || meta.text("steradian.outcome") != Some("finished"))
    {
        words += &format!(" --spp {nominal} --sampler-spp {planned}");
    }
    let like = parse(&(words + &overrides::as_typed(&args.picture)))
        .ok_or_else(|| Failure::Input(format!("{name}: its options are none of this version: {options}")))?;
    let mut out = RenderArgs { picture: like.picture, ..args.clone() };
    if out.scene.is_none() && scene != SHOWCASE_NAME {
        out.scene = Some(found(path, scene));
    }
    if !args.stop.is_open_ended() && args.stop.adaptive.is_none() && !args.stop.no_adaptive {
        out.stop = like.stop;
    }
    Ok((out, meta.text("steradian.sceneHash").map(str::to_owned)))
}

/// Where an option is given twice, the last one counts.
fn parse(options: &str) -> Option<RenderArgs> {
    let words = ["steradian", "render"].map(String::from).into_iter().chain(crate::model_args::words(options));
    let matches = Cli::command().args_override_self(true).try_get_matches_from(words).ok()?;
    match Cli::from_arg_matches(&matches).ok()?.command {
        Command::Render(args) => Some(*args),
        _ => None,
    }
}

/// The scene where the image says it is, or else beside the image.
fn found(image: &Path, scene: &str) -> PathBuf {
    let beside = image.with_file_name(scene);
    if !Path::new(scene).exists() && beside.exists() { beside } else { scene.into() }
}
