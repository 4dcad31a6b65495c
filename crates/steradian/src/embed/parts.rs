//! Parts of a distributed render put together, complete or not, and looked at.

use std::path::PathBuf;

use steradian_image::{Attribute, Image};
use steradian_render::{
    Assessment, Film, Outcome, Rendered, Seen, Share, Snapshot, assess, differences, join, join_what_is_there,
};

use super::words::{parse, parse_all};
use super::{Picture, Trouble};
use crate::{aov, keep, output, overrides, stop};

/// Parts put together.
pub struct Joined {
    /// The picture; pixels of missing tiles are black.
    pub picture: Picture,
    /// The share of the samples that is there.
    pub complete: f64,
    /// The bound for which the statement of `--error` holds at the given look, and the wanted one, where one was asked for and nothing
    /// is missing.
    pub bound: Option<[f64; 2]>,
}

/// Samples per pixel at which `--error` looks at the picture, in order.
pub fn looks() -> impl Iterator<Item = (u32, u32)> {
    steradian_render::looks()
}

/// How parts are joined.
#[derive(Clone, Copy, Debug, Default)]
pub struct Joining<'a> {
    /// Some are still to come.
    pub partial: bool,
    /// They are of one render that was continued again and again, by these words.
    pub rounds: Option<&'a [String]>,
    /// Which look at the error of those this is; 0 for none.
    pub look: u32,
    /// What [`super::Held::seen`] saw, where the parts themselves have light only.
    pub seen: &'a [&'a [u8]],
}

/// Joins parts from [`super::Held::part`] or from files.
///
/// # Errors
/// Where they are damaged or not of one render.
pub fn join_parts(parts: &[&[u8]], how: Joining) -> Result<Joined, Trouble> {
    let damaged = |e: steradian_render::Error| Trouble::Input(e.to_string());
    let parts = parts.iter().map(|b| Snapshot::decode(b).map_err(damaged)).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = parts.first() else { return Err(Trouble::Input("there are no parts".into())) };
    let names: Vec<PathBuf> = (0..parts.len()).map(|i| format!("part {}", i + 1).into()).collect();
    if how.rounds.is_some() {
        check_rounds(&parts)?;
    } else {
        crate::merge::check(&names, &parts, how.partial)?;
    }
    let spp = parts.iter().map(|p| p.spp).max().unwrap_or(0);
    let films: Vec<&Film> = parts.iter().map(|p| &p.film).collect();
    let bounds = first.film.bounds;
    let film = if how.partial { join_what_is_there(bounds, &films) } else { join(bounds, &films, spp) };
    let film = film.map_err(damaged)?;
    let mut metadata = output::metadata_of_note(&first.note)
        .ok_or_else(|| Trouble::Input("the description of a part cannot be read".into()))?;
    let planned = u64::from(spp) * film.size().map(|n| n as u64).iter().product::<u64>();
    let complete = film.total_samples() as f64 / planned.max(1) as f64;
    let args = how.rounds.map(parse).transpose()?;
    let goal = args.as_ref().and_then(|a| a.stop.goals(Share::Whole, &a.output).error);
    let mut rendered = Rendered::from_parts(film, parts.iter().map(|p| p.elapsed).sum());
    if let Some(args) = &args {
        // A part of a round was told its round's samples; the render as a whole is what these words ask for.
        let typed = overrides::as_typed(&args.picture) + &args.stop.as_typed();
        metadata.set("steradian.options", Attribute::Text(typed.trim().to_owned()));
    }
    let mut found = None;
    if let Some(goal) = goal.filter(|_| how.look > 0 && !how.partial && rendered.spp > 1) {
        let Assessment { bound, .. } = assess(&rendered.film, &goal, how.look);
        rendered.bound = Some(bound);
        found = Some([bound, goal.bound]);
        if bound <= goal.bound {
            rendered.outcome = Outcome::ErrorReached;
        }
    }
    let layers = keep::layer_names(&first.identity);
    let (mut image, _) = output::images(&rendered, &metadata, None);
    output::add_layers(&mut image, &rendered.film, &layers)
        .map_err(|e| Trouble::Input(format!("the channels cannot be added: {e}")))?;
    if !how.partial {
        let apart = how.seen.iter().map(|b| Seen::decode(b, bounds).map_err(damaged)).collect::<Result<Vec<_>, _>>()?;
        let seen: Vec<&Seen> = parts.iter().filter_map(|p| p.seen.as_ref()).chain(&apart).collect();
        let asked = args.map_or(Vec::new(), |a| a.aov);
        let of_film: Vec<_> = asked.into_iter().filter(|a| a.is_of_film()).collect();
        aov::add_of_parts(&mut image, &of_film, &seen, &rendered.film)?;
    }
    let picture = Picture { image, outcome: stop::outcome_name(rendered.outcome), bad_samples: rendered.bad_count };
    Ok(Joined { picture, complete, bound: found })
}

/// Writes a picture where and how words of `steradian render` say it.
///
/// # Errors
/// Where a file cannot be written.
pub fn write(image: &Image, words: &[String]) -> Result<(), Trouble> {
    let args = parse_all(words)?;
    let outputs = output::Outputs::prepare(&args.output, None, false)?;
    let raw = output::is_raw_name(image.metadata.text("steradian.integrator").unwrap_or_default());
    let failed = outputs.write(image, None, raw);
    if failed.is_empty() { Ok(()) } else { Err(Trouble::Environment(failed.join("\n"))) }
}

/// Refuses parts that do not continue each other. Ranges of samples are looked at when they are joined.
fn check_rounds(parts: &[Snapshot]) -> Result<(), Trouble> {
    let of = |s: &Snapshot| {
        let mut id = s.identity.clone();
        id.remove("share");
        id
    };
    let first = of(&parts[0]);
    match parts.iter().find(|p| of(p) != first) {
        Some(other) => {
            let list = differences(&of(other), &first, "one", "another");
            Err(Trouble::Input(format!("the parts are of different renders: {}", list.join("; "))))
        }
        None => Ok(()),
    }
}
