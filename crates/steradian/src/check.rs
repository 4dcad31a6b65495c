//! `steradian check`.

use steradian_load::LoadOptions;
use steradian_syntax::Severity;

use crate::args::SceneArg;
use crate::console::Console;
use crate::failure::{DONE, Failure, INPUT};
use crate::{numbers, opened};

/// Prints every problem of a scene; the exit code.
pub(crate) fn run(args: &SceneArg, console: &Console) -> Result<u8, Failure> {
    let outcome = opened::read(
        Some(&args.scene),
        &LoadOptions { model: args.model.options(None), traps: true, ..LoadOptions::default() },
    )?;
    for d in &outcome.diagnostics {
        console.diagnostic(&d.render(&outcome.sources), true);
        console.out("");
    }
    let of = |s: Severity| outcome.diagnostics.iter().filter(|d| d.severity == s).count() as u64;
    let (mut errors, warnings, notes) = (of(Severity::Error), of(Severity::Warning), of(Severity::Note));
    // Some mistakes only show when the scene is put together.
    if let Some(scene) = outcome.scene
        && let Err(e) = opened::build(scene, None)
    {
        console.diagnostic(&format!("error: {e}"), true);
        errors += 1;
    }
    let parts: Vec<String> = [(errors, "error"), (warnings, "warning"), (notes, "note")]
        .into_iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| numbers::counted(n, what))
        .collect();
    let verdict = if parts.is_empty() { "no problems".to_owned() } else { parts.join(", ") };
    console.heading(format_args!("{}: {verdict}", args.scene.display()));
    Ok(if errors > 0 { INPUT } else { DONE })
}
