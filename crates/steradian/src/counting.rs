//! `render --counters`: what a picture costs in rays, tests and bounces, as one JSON object.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde_json::json;
use steradian_integrator::record::Counters;
use steradian_render::{Observer, Rendered, Task};

use crate::args::{ProgressArg, RenderArgs};
use crate::console::Console;
use crate::failure::Failure;
use crate::{keep, output};

/// Refuses a file that could not be written, or is to be written twice, before rendering.
pub(crate) fn check(args: &RenderArgs) -> Result<(), Failure> {
    let Some(path) = &args.run.counters else { return Ok(()) };
    let files = args.output.output.iter().chain(&args.output.variance).chain(&args.run.preview);
    if files.chain(&args.keep.checkpoint).any(|other| other == path) {
        return Err(Failure::Input(format!("{} is to be written twice", path.display())));
    }
    if !is_standard_output(path) {
        return output::check(path);
    }
    if args.run.progress == ProgressArg::Json {
        return Err(Failure::Input("--counters - and --progress json both want standard output: name a file".into()));
    }
    Ok(())
}

/// Renders, and counts if asked to. A render that does not count is compiled apart, without a trace of it.
pub(crate) fn run(
    task: Task,
    count: bool,
    observer: &dyn Observer,
    cancel: &AtomicBool,
) -> (Rendered, Option<Counters>) {
    if !count {
        return (steradian_render::run(task, observer, cancel), None);
    }
    let (rendered, counters) = steradian_render::run_counted(task, observer, cancel);
    (rendered, Some(counters))
}

/// The counters of a run that took so many samples in all pixels together.
pub(crate) fn json(c: &Counters, samples: u64) -> String {
    // Integrators that follow trees of rays, or one ray, have no paths to count.
    let paths: u64 = c.path_lengths.iter().sum();
    let last = c.path_lengths.iter().rposition(|&n| n > 0).map_or(0, |i| i + 1);
    let (head, longer) = c.path_lengths.split_at(c.path_lengths.len() - 1);
    json!({
        "samples": samples,
        "rays": {
            "camera": c.rays.camera,
            "scattered": c.rays.scattered,
            "shadow": c.rays.shadow,
            "total": c.rays.total(),
        },
        "tests": { "box": c.box_tests, "primitive": c.primitive_tests },
        "paths": {
            "by_bounces": head[..last.min(head.len())],
            "longer": longer[0],
            "mean_bounces": (paths > 0).then(|| c.mean_path_length()),
        },
    })
    .to_string()
}

/// Writes the line to a file, or to standard output if that is `-`.
pub(crate) fn write(path: &Path, line: &str, console: &Console) -> Result<(), String> {
    if is_standard_output(path) {
        console.out(line);
        return Ok(());
    }
    keep::store(path, format!("{line}\n").as_bytes())
}

fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_integrator::record::{LONGEST_COUNTED, RayCounts};

    #[test]
    fn the_object_has_what_was_counted_and_no_more() {
        let mut c = Counters { rays: RayCounts { camera: 4, scattered: 6, shadow: 5 }, ..Counters::default() };
        (c.box_tests, c.primitive_tests) = (70, 30);
        (c.path_lengths[0], c.path_lengths[3], c.path_lengths[LONGEST_COUNTED]) = (1, 2, 1);
        let value: serde_json::Value = serde_json::from_str(&json(&c, 4)).unwrap();
        assert_eq!(value["samples"], 4);
        assert_eq!(value["rays"]["total"], 15);
        assert_eq!(value["tests"], serde_json::json!({ "box": 70, "primitive": 30 }));
        let bounces = value["paths"]["by_bounces"].as_array().unwrap();
        assert_eq!((bounces.len(), &value["paths"]["longer"]), (LONGEST_COUNTED, &serde_json::json!(1)));
        c.path_lengths[LONGEST_COUNTED] = 0;
        let value: serde_json::Value = serde_json::from_str(&json(&c, 4)).unwrap();
        assert_eq!(value["paths"]["by_bounces"], serde_json::json!([1, 0, 0, 2]));
        assert_eq!(value["paths"]["mean_bounces"], 2.0);
    }
}
