//! `steradian compare`: metrics, a verdict with a stated rate of false alarms, and equality of bits.

use serde::Serialize;
use steradian_image::agreement::{Estimate, Report, Settings, agreement};
use steradian_image::{
    FlipSettings, Format, Image, Metrics, WriteOptions, exact_differences, false_colour_image, flip_hdr, flip_ldr,
    metrics, write_file,
};

use crate::args::CompareArgs;
use crate::console::Console;
use crate::failure::{DIFFERS, DONE, Failure};
use crate::info::read_image;
use crate::numbers::counted;

/// All that is found out.
#[derive(Serialize, Default)]
struct Findings {
    /// Whether the images agree.
    agree: bool,
    /// Where the noise of A was taken from.
    noise: Option<&'static str>,
    metrics: Option<Numbers>,
    statistics: Option<Report>,
    /// What differs, under `--exact`.
    differences: Option<Vec<String>>,
    /// Why nothing could be measured.
    reason: Option<String>,
}

/// `Metrics` and FLIP, for JSON. Infinite PSNR is null.
#[derive(Serialize)]
struct Numbers {
    mse: f64,
    rel_mse: f64,
    mae: f64,
    psnr: f64,
    flip: f64,
    bias: [f64; 3],
    max_error: f64,
    non_finite: [usize; 2],
}

/// Compares and reports; the exit code.
pub(crate) fn run(args: &CompareArgs, console: &Console) -> Result<u8, Failure> {
    let mut candidates = vec![read_image(&args.candidate)?];
    let reference = read_image(&args.reference)?;
    for path in &args.seed_image {
        candidates.push(read_image(path)?);
    }
    let found =
        if args.exact { exact(&candidates[0], &reference) } else { statistical(&candidates, &reference, args)? };
    if let Some(path) = &args.diff {
        write_diff(path, &candidates[0], &reference, args)?;
    }
    if args.json {
        let text = serde_json::to_string_pretty(&found).map_err(|e| Failure::Environment(e.to_string()))?;
        console.out(text);
    } else {
        print(&found, console);
    }
    Ok(if found.agree { DONE } else { DIFFERS })
}

fn exact(a: &Image, b: &Image) -> Findings {
    let differences: Vec<String> = exact_differences(a, b).iter().map(ToString::to_string).collect();
    Findings { agree: differences.is_empty(), differences: Some(differences), ..Findings::default() }
}

fn statistical(candidates: &[Image], reference: &Image, args: &CompareArgs) -> Result<Findings, Failure> {
    let bad = |e: steradian_image::Error| Failure::Input(e.to_string());
    let first = &candidates[0];
    if candidates.iter().any(|c| (c.width(), c.height()) != (reference.width(), reference.height())) {
        let (w, h, v, g) = (first.width(), first.height(), reference.width(), reference.height());
        let reason = format!("the images differ in size: {w} x {h} and {v} x {g} pixels");
        return Ok(Findings { reason: Some(reason), ..Findings::default() });
    }
    let b = Estimate::from_image(reference).map_err(bad)?;
    let mut settings = Settings::default();
    let (a, noise) = if candidates.len() > 1 {
        (Estimate::from_seeds(candidates, Some(&b)).map_err(bad)?, "the scatter between seeds")
    } else if let Some(path) = &args.variance {
        (with_variance(first, &read_image(path)?).map_err(bad)?, "the variance that was given")
    } else if let Some(spp) = args.against_spp {
        let own = first.metadata.number("samplesPerPixel").filter(|n| *n > 0.0).ok_or_else(|| {
            Failure::Input(format!(
                "{}: --against-spp needs the attribute samplesPerPixel in A",
                args.candidate.display()
            ))
        })?;
        if !b.has_variance() {
            return Err(Failure::Input(format!(
                "{}: --against-spp needs channels Variance.R .G .B in B",
                args.reference.display()
            )));
        }
        settings.candidate_to_reference_variance = Some(f64::from(spp) / own);
        (Estimate::of_unknown_noise(first).map_err(bad)?, "B's variance, scaled by samples per pixel")
    } else {
        let a = Estimate::from_image(first).map_err(bad)?;
        let noise = match (a.has_variance(), b.has_variance()) {
            (true, true) => "the variance in both files",
            (true, false) => "the variance in A, and the scatter inside blocks",
            (false, true) => "the variance in B, and the scatter inside blocks",
            (false, false) => "the scatter inside blocks",
        };
        (a, noise)
    };
    let report = agreement(&b, &a, &settings);
    let mean = mean_image(candidates);
    let m = metrics(&mean, reference).map_err(bad)?;
    let flip = flip(&mean, reference, args).map_err(bad)?;
    let flip = flip.iter().map(|&v| f64::from(v)).sum::<f64>() / flip.len().max(1) as f64;
    Ok(Findings {
        agree: report.agree,
        noise: Some(noise),
        metrics: Some(numbers(&m, flip)),
        statistics: Some(report),
        ..Findings::default()
    })
}

fn numbers(m: &Metrics, flip: f64) -> Numbers {
    Numbers {
        mse: m.mse,
        rel_mse: m.rel_mse,
        mae: m.mae,
        psnr: m.psnr,
        flip,
        bias: m.bias,
        max_error: m.max_error,
        non_finite: [m.non_finite_test, m.non_finite_reference],
    }
}

/// A with a variance from another file: its channels `Variance.*`, or else its colour.
fn with_variance(image: &Image, variance: &Image) -> Result<Estimate, steradian_image::Error> {
    let no_colour =
        || steradian_image::Error::Shape { what: "the file of the variance has no channels R, G, B or Y".into() };
    let planes = variance.planes("Variance").or_else(|| variance.colour_planes()).ok_or_else(no_colour)?;
    let samples = variance.metadata.number("samplesPerPixel").unwrap_or(1e6);
    Estimate::with_variance(image, planes, (samples - 1.0).max(1.0))
}

/// The mean of all renderings of A.
fn mean_image(images: &[Image]) -> Image {
    let mut mean = images[0].clone();
    let weight = 1.0 / images.len() as f32;
    for name in ["R", "G", "B", "Y"] {
        let planes: Option<Vec<&[f32]>> = images.iter().map(|i| i.channel(name)).collect();
        let (Some(planes), Some(out)) = (planes, mean.channel_mut(name)) else { continue };
        for (i, v) in out.iter_mut().enumerate() {
            *v = planes.iter().map(|p| p[i]).sum::<f32>() * weight;
        }
    }
    mean
}

/// FLIP as suits the kind of image: pictures for screens as they are, light at many exposures.
fn flip(a: &Image, b: &Image, args: &CompareArgs) -> Result<Vec<f32>, steradian_image::Error> {
    let is_light =
        |p: &std::path::Path| Format::from_name(&p.to_string_lossy()).is_some_and(Format::is_high_dynamic_range);
    let settings = FlipSettings::default();
    if is_light(&args.candidate) || is_light(&args.reference) {
        flip_hdr(b, a, &settings)
    } else {
        flip_ldr(b, a, &settings)
    }
}

fn write_diff(path: &std::path::Path, a: &Image, b: &Image, args: &CompareArgs) -> Result<(), Failure> {
    let values = flip(a, b, args).map_err(|e| Failure::Input(e.to_string()))?;
    let image =
        false_colour_image(a.width(), a.height(), &values, 0.0, 1.0).map_err(|e| Failure::Input(e.to_string()))?;
    write_file(&image, path, &WriteOptions::default()).map_err(|e| match e {
        steradian_image::Error::Io { source, .. } => {
            Failure::Environment(format!("cannot write {}: {}", path.display(), crate::failure::reason(&source)))
        }
        other => Failure::Input(other.to_string()),
    })
}

fn print(found: &Findings, console: &Console) {
    if let Some(m) = &found.metrics {
        console.out(format_args!("MSE      {:.6e}", m.mse));
        console.out(format_args!("relMSE   {:.6e}", m.rel_mse));
        console.out(format_args!("PSNR     {:.2} dB", m.psnr));
        console.out(format_args!("FLIP     {:.4}", m.flip));
        console.out(format_args!("bias     {}", m.bias.map(|b| format!("{:+.3} %", b * 100.0)).join("  ")));
        if m.non_finite != [0, 0] {
            console.out(format_args!(
                "not finite: {} in A, {} in B",
                counted(m.non_finite[0] as u64, "value"),
                m.non_finite[1]
            ));
        }
    }
    if let Some(report) = &found.statistics {
        for f in &report.families {
            console.out(format_args!(
                "{:<10} {:<4}  largest deviate {:6.2} (limit {:.2}), {} of {} beyond{}{}",
                f.name,
                if f.agrees { "ok" } else { "FAIL" },
                f.z_max,
                f.z_limit,
                f.failed,
                f.tests,
                if f.allowed > 0 { format!(" ({} allowed)", f.allowed) } else { String::new() },
                if f.agrees || f.place.is_empty() {
                    String::new()
                } else {
                    format!("; {:+.2} % at {}", f.relative * 100.0, f.place)
                },
            ));
        }
        if let Some(noise) = found.noise {
            console.out(format_args!(
                "noise from {noise}; an error of {:.2} % in brightness would have been seen",
                report.detectable_bias * 100.0
            ));
        }
        if let Some(reason) = &report.reason {
            console.out(reason);
        }
    }
    if let Some(reason) = &found.reason {
        console.out(reason);
    }
    for d in found.differences.iter().flatten() {
        console.out(d);
    }
    let weak = found.statistics.as_ref().is_some_and(|r| r.is_weak);
    console.heading(match (found.agree, &found.differences) {
        (true, Some(_)) => "identical",
        (true, None) if weak => "agree (weak: more samples would say more)",
        (true, None) => "agree",
        (false, _) => "differ",
    });
}
