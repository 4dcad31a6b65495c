//! Parts of a distributed render put together, complete or not, and looked at.

use std::path::PathBuf;

use steradian_image::Image;
use steradian_render::{
    Assessment, ErrorGoal, Film, Rendered, Share, Snapshot, assess, differences, join, join_what_is_there,
};

use super::Trouble;
use super::words::parse;
use crate::{keep, output};

/// Parts put together.
pub struct Joined {
    /// The picture; pixels of missing tiles are black.
    pub image: Image,
    /// The share of the samples that is there.
    pub complete: f64,
    /// The bound for which the statement of `--error` holds at the given look, where one was asked for and nothing is missing.
    pub bound: Option<f64>,
}

/// The error that `words` ask for (`--error` and what belongs to it), or `None`: for drivers that look at joined parts.
///
/// # Errors
/// Words that make no sense.
pub fn error_goal(words: &[String]) -> Result<Option<ErrorGoal>, Trouble> {
    let args = parse(words)?;
    Ok(args.stop.goals(Share::Whole, &args.output).error)
}

/// Samples per pixel at which `--error` looks at the picture, in order.
pub fn looks() -> impl Iterator<Item = (u32, u32)> {
    steradian_render::looks()
}

/// Joins parts from [`super::Held::part`] or from files: those that there are if `partial`; those of one render that was continued again and
/// again if `rounds`.
///
/// # Errors
/// Where they are damaged or not of one render.
pub fn join_parts(
    parts: &[&[u8]],
    (partial, rounds): (bool, bool),
    goal: Option<(ErrorGoal, u32)>,
) -> Result<Joined, Trouble> {
    let decode = |bytes: &&[u8]| Snapshot::decode(bytes).map_err(|e| Trouble::Input(e.to_string()));
    let parts = parts.iter().map(decode).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = parts.first() else { return Err(Trouble::Input("there are no parts".into())) };
    let names: Vec<PathBuf> = (0..parts.len()).map(|i| format!("part {}", i + 1).into()).collect();
    if rounds {
        check_rounds(&parts)?;
    } else {
        crate::merge::check(&names, &parts, partial)?;
    }
    let spp = parts.iter().map(|p| p.spp).max().unwrap_or(0);
    let films: Vec<&Film> = parts.iter().map(|p| &p.film).collect();
    let bounds = first.film.bounds;
    let film = if partial { join_what_is_there(bounds, &films) } else { join(bounds, &films, spp) };
    let film = film.map_err(|e| Trouble::Input(e.to_string()))?;
    let metadata = output::metadata_of_note(&first.note)
        .ok_or_else(|| Trouble::Input("the description of a part cannot be read".into()))?;
    let planned = u64::from(spp) * film.size().map(|n| n as u64).iter().product::<u64>();
    let complete = film.total_samples() as f64 / planned.max(1) as f64;
    let bound = match goal {
        Some((goal, look)) if !partial && film.samples()[0] > 1 => {
            let Assessment { bound, .. } = assess(&film, &goal, look);
            Some(bound)
        }
        _ => None,
    };
    let layers = keep::layer_names(&first.identity);
    let rendered = Rendered::from_parts(film, parts.iter().map(|p| p.elapsed).sum());
    let (mut image, _) = output::images(&rendered, &metadata, None);
    output::add_layers(&mut image, &rendered.film, &layers)
        .map_err(|e| Trouble::Input(format!("the channels cannot be added: {e}")))?;
    Ok(Joined { image, complete, bound })
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
