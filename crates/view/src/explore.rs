//! Why a pixel is as it is: its samples again, one by one, and the paths that make it bright.
//!
//! A sample is a function of pixel and index, so nothing has to be kept while rendering: what is shown here is traced again, and is
//! what the picture was made of.

use crate::canvas::encode;
use crate::hub::{Hub, Staged, lock};
use crate::path::{luminance, number, tell, value};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use steradian_integrator::Scratch;
use steradian_render::{PixelSampler, PixelStack, PixelSum};
use steradian_sampling::Sampler;

/// So many samples are looked at, at most.
const MOST_SAMPLES: u32 = 16_384;
/// And for so long.
const PATIENCE: Duration = Duration::from_millis(800);
/// The brightest ones that are told.
const BRIGHTEST: usize = 8;
/// And others, as they come.
const USUAL: usize = 12;
/// The normal quantile of 95 %.
const Z: f64 = 1.959_964;

fn inside(staged: &Staged, pixel: [u32; 2]) -> Result<(), String> {
    let [w, h] = staged.world.settings().film.resolution;
    if pixel[0] < w && pixel[1] < h { Ok(()) } else { Err(format!("the picture has {w} x {h} pixels")) }
}

fn command(hub: &Hub, staged: &Staged, [x, y]: [u32; 2], sample: u32) -> String {
    hub.stage.command("trace", &staged.options, &format!("--pixel {x},{y} --sample {sample}"))
}

/// One path of a pixel.
pub(crate) fn path(hub: &Hub, staged: &Staged, pixel: [u32; 2], sample: u32) -> Result<Value, String> {
    inside(staged, pixel)?;
    let pixels = PixelSampler::new(&staged.world);
    let mut tools = (Sampler::new(&staged.world.settings().sampler), Scratch::default());
    let command = command(hub, staged, pixel, sample);
    Ok(tell(&pixels, (&mut tools.0, &mut tools.1), pixel, sample, staged, command))
}

/// A pixel: its value with its confidence, how it converged, its brightest paths and some others.
pub(crate) fn explore(hub: &Hub, pane: usize, staged: &Staged, pixel: [u32; 2]) -> Result<Value, String> {
    inside(staged, pixel)?;
    let start = Instant::now();
    let pixels = PixelSampler::new(&staged.world);
    let mut sampler = Sampler::new(&staged.world.settings().sampler);
    let mut scratch = Scratch::default();
    let seen = {
        let canvas = lock(&hub.panes[pane].canvas);
        let [x, y] = canvas.origin;
        let at = pixel[0].checked_sub(x).zip(pixel[1].checked_sub(y));
        at.and_then(|(x, y)| canvas.pixel(x, y)).filter(|_| canvas.generation == staged.generation)
    };
    // As many as the picture has; where it has few, a few more, since one sample explains nothing.
    let in_picture = seen.map_or(0, |(_, n)| n);
    let wanted = in_picture.clamp(64, MOST_SAMPLES);
    let mut stack = PixelStack::new(0, 0);
    let mut curve = Vec::new();
    let mut all: Vec<(f32, u32)> = Vec::new();
    let (mut sum, mut squares, mut next_mark) = (0.0f64, 0.0f64, 1u32);
    let mut same = None;
    for index in 0..wanted {
        let rgb = value(&pixels, (&mut sampler, &mut scratch), pixel, index);
        stack.push(PixelSum::of(rgb));
        let y = f64::from(luminance(rgb));
        (sum, squares) = (sum + y, squares + y * y);
        all.push((y as f32, index));
        let n = index + 1;
        if n == next_mark || n == wanted {
            let (mean, half) = interval(sum, squares, n);
            curve.push(json!([n, mean, half]));
            next_mark = (n + 1).max((f64::from(n) * 1.12) as u32);
        }
        if n == in_picture && !pixels.splats() {
            let total = stack.nodes().map(|(_, sum, _)| sum).collect::<Vec<_>>();
            let total = total.into_iter().rev().reduce(|a, b| b.add(&a)).unwrap_or_default();
            same = seen.map(|(texel, _)| encode(total.mean(n), 0.0)[..3] == texel[..3]);
        }
        if index >= 15 && start.elapsed() > PATIENCE {
            break;
        }
    }
    let n = all.len() as u32;
    let (mean, half) = interval(sum, squares, n);
    let mut ranked = all.clone();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let brightest: Vec<u32> = ranked.iter().take(BRIGHTEST).map(|r| r.1).collect();
    let step = (n as usize / USUAL).max(1);
    let usual = (0..n).step_by(step).filter(|i| !brightest.contains(i)).take(USUAL);
    let mut told = |index: u32| {
        let command = command(hub, staged, pixel, index);
        tell(&pixels, (&mut sampler, &mut scratch), pixel, index, staged, command)
    };
    let brightest: Vec<Value> = brightest.iter().map(|&i| told(i)).collect();
    let usual: Vec<Value> = usual.map(&mut told).collect();
    let top = (n as usize / 100).max(1);
    let bright_share = ranked.iter().take(top).map(|r| f64::from(r.0)).sum::<f64>() / sum.max(1e-30);
    let total = stack.nodes().map(|(_, sum, _)| sum).collect::<Vec<_>>();
    let total = total.into_iter().rev().reduce(|a, b| b.add(&a)).unwrap_or_default();
    Ok(json!({
        "pixel": pixel, "generation": staged.generation, "samples": n, "in_picture": in_picture,
        "rgb": total.mean(n).map(number), "luminance": mean, "half_width": half, "same_as_picture": same,
        "curve": curve, "brightest": brightest, "usual": usual,
        "bright_share": bright_share, "bright_samples": top,
        "black": all.iter().filter(|s| s.0 == 0.0).count(),
        "took_ms": start.elapsed().as_secs_f64() * 1e3,
        "splats": pixels.splats(),
    }))
}

/// Mean and half the width of the 95 % confidence interval, by the normal approximation; none for one sample.
fn interval(sum: f64, squares: f64, n: u32) -> (f64, Option<f64>) {
    let count = f64::from(n.max(1));
    let mean = sum / count;
    let half = (n > 1).then(|| Z * ((squares - sum * mean).max(0.0) / (count * (count - 1.0))).sqrt());
    (mean, half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_the_textbooks() {
        let (mean, half) = interval(2.0 + 4.0 + 6.0, 4.0 + 16.0 + 36.0, 3);
        assert_eq!(mean, 4.0);
        assert!((half.unwrap() - Z * (4.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(interval(3.0, 9.0, 1), (3.0, None));
    }
}
