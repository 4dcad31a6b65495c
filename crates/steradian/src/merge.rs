//! `steradian merge`: the parts of a distributed render become the picture that one machine would have made, bit for bit.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueHint};
use steradian_render::{Film, Part, Rendered, Seen, Snapshot, differences, join, layer_width};

use crate::aov::{self, Aov};
use crate::args::OutputArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure};
use crate::output::{self, Outputs};
use crate::{keep, numbers, stop};

/// The options.
#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// The parts, in any order, as written by render --shard
    #[arg(value_name = "PART", required = true, value_hint = ValueHint::FilePath)]
    pub parts: Vec<PathBuf>,

    #[command(flatten)]
    pub output: OutputArgs,

    /// Add channels to the .exr that the sums tell: variance, samples, error; what the parts were rendered with is there anyway
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help_heading = "Output")]
    pub aov: Vec<Aov>,

    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// Joins and writes; the exit code.
pub(crate) fn run(args: &MergeArgs, console: &Console) -> Result<u8, Failure> {
    let console = console.quiet(args.quiet);
    if args.output.output.is_empty() {
        return Err(Failure::Input("-o FILE says where the picture goes".into()));
    }
    let outputs = Outputs::prepare(&args.output, None, false)?;
    let parts = args.parts.iter().map(|p| keep::read(p)).collect::<Result<Vec<_>, _>>()?;
    check(&args.parts, &parts, false)?;
    let films: Vec<&Film> = parts.iter().map(|p| &p.film).collect();
    let film = join(films[0].bounds, &films, parts[0].spp).map_err(|e| Failure::Input(e.to_string()))?;
    let elapsed: Duration = parts.iter().map(|p| p.elapsed).sum();
    let rendered = Rendered::from_parts(film, elapsed);
    let metadata = output::metadata_of_note(&parts[0].note)
        .ok_or_else(|| Failure::Input(format!("{}: its description cannot be read", args.parts[0].display())))?;
    let raw = output::is_raw_name(metadata.text("steradian.integrator").unwrap_or_default());
    let (mut picture, variance) = output::images(&rendered, &metadata, None);
    let of_us = |e: steradian_image::Error| Failure::Input(format!("the channels cannot be added: {e}"));
    let names = keep::layer_names(&parts[0].identity);
    if layer_width(&names) != rendered.film.layers() {
        return Err(Failure::Input(format!("{}: it does not say what it keeps", args.parts[0].display())));
    }
    let taken = output::add_layers(&mut picture, &rendered.film, &names).map_err(of_us)?;
    let seen: Vec<&Seen> = parts.iter().filter_map(|p| p.seen.as_ref()).collect();
    aov::add_of_parts(&mut picture, &args.aov, &seen, &rendered.film)?;
    let failed = outputs.write(&picture, Some(&variance), raw);
    if !failed.is_empty() {
        return Err(Failure::Environment(failed.join("\n")));
    }
    console.say(format_args!(
        "{} with {}, rendered in {} all together",
        numbers::counted(parts.len() as u64, "part"),
        stop::samples_in_words(&rendered),
        numbers::duration(elapsed)
    ));
    outputs.say(&console);
    taken.iter().for_each(|t| t.say(&console));
    Ok(DONE)
}

/// Refuses parts that are not each exactly once of one and the same render; some may be missing if `partial`.
pub(crate) fn check(paths: &[PathBuf], parts: &[Snapshot], partial: bool) -> Result<(), Failure> {
    let name = |i: usize| paths[i].display();
    let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
    let (first, count) = (&parts[0], part_of(&parts[0]).count);
    for (i, part) in parts.iter().enumerate() {
        let whole = |s: &Snapshot| {
            let mut id = s.identity.clone();
            id.remove("share");
            id.insert("spp".into(), s.spp.to_string());
            id.insert("number of parts".into(), part_of(s).count.to_string());
            id
        };
        let different = differences(&whole(part), &whole(first), &name(i).to_string(), &name(0).to_string());
        if !different.is_empty() || std::mem::discriminant(&part.share) != std::mem::discriminant(&first.share) {
            let list = different.iter().map(|d| format!("\n  {d}")).collect::<String>();
            return Err(Failure::Input(format!("{} and {} are of different renders{list}", name(i), name(0))));
        }
        if let Some(other) = seen.insert(part_of(part).index, i) {
            let which = keep::share_name(part.share);
            return Err(Failure::Input(format!("{} and {} are both part {which}", name(other), name(i))));
        }
    }
    let missing: Vec<String> =
        (0..count).filter(|i| !seen.contains_key(i)).map(|i| format!("{}/{count}", i + 1)).collect();
    if missing.is_empty() || partial {
        return Ok(());
    }
    const SHOWN: usize = 12;
    let more = missing.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    Err(Failure::Input(format!("missing: part {}{more}", missing[..missing.len().min(SHOWN)].join(", "))))
}

fn part_of(snapshot: &Snapshot) -> Part {
    snapshot.share.part()
}
