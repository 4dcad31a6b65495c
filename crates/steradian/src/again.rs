//! `render --like image.exr`: what an image says of how it was made, as options.

use std::path::{Path, PathBuf};

use clap::Parser;
use steradian_image::Metadata;

use crate::args::{Cli, Command, RenderArgs};
use crate::failure::{Failure, reason};
use crate::opened::SHOWCASE_NAME;

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
    let like = parse(options)
        .ok_or_else(|| Failure::Input(format!("{name}: its options are none of this version: {options}")))?;
    let mut out = args.clone();
    if out.scene.is_none() && scene != SHOWCASE_NAME {
        out.scene = Some(found(path, scene));
    }
    let (to, from) = (&mut out.picture, like.picture);
    let whole = |name: &str| meta.number(name).map(|v| v as u32).filter(|&n| n > 0);
    to.spp = to.spp.or(whole("steradian.nominalSpp")).or(from.spp);
    to.sampler_spp = to.sampler_spp.or(whole("steradian.plannedSpp")).or(from.sampler_spp);
    to.size = to.size.or(from.size);
    to.crop = to.crop.or(from.crop);
    to.seed = to.seed.or_else(|| seed(meta)).or(from.seed);
    to.integrator = to.integrator.or(from.integrator);
    to.sampler = to.sampler.or(from.sampler);
    to.max_depth = to.max_depth.or(from.max_depth);
    to.color = to.color.or(from.color);
    if out.stop.error.is_none() && !out.stop.adaptive && !out.stop.no_adaptive {
        out.stop = crate::stop::StopArgs { time: out.stop.time, ..like.stop };
    }
    Ok((out, meta.text("steradian.sceneHash").map(str::to_owned)))
}

fn parse(options: &str) -> Option<RenderArgs> {
    let words = ["steradian", "render"].into_iter().chain(options.split_whitespace());
    match Cli::try_parse_from(words).ok()?.command {
        Command::Render(args) => Some(*args),
        _ => None,
    }
}

fn seed(meta: &Metadata) -> Option<u64> {
    meta.text("steradian.seed")?.parse().ok()
}

/// The scene where the image says it is, or else beside the image.
fn found(image: &Path, scene: &str) -> PathBuf {
    let beside = image.with_file_name(scene);
    if !Path::new(scene).exists() && beside.exists() { beside } else { scene.into() }
}
