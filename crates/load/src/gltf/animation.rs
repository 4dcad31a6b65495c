//! Animations, sampled when the shutter opens and when it closes.

use super::Gltf;
use super::json::{Json, Result};
use super::nodes::Local;
use crate::model::ModelOptions;
use steradian_math::{safe_acos, sin};

/// Key frames of one property.
struct Track {
    times: Vec<f32>,
    /// Values of all keys; with tangents before and after each, where it is cubic.
    values: Vec<f32>,
    width: usize,
    kind: Interpolation,
    is_rotation: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    Cubic,
}

impl Track {
    /// The value of key `k`; part 0 is the tangent before, 1 the value, 2 the tangent after.
    fn key(&self, k: usize, part: usize) -> &[f32] {
        let at = if self.kind == Interpolation::Cubic { (3 * k + part) * self.width } else { k * self.width };
        &self.values[at..at + self.width]
    }

    fn at(&self, time: f32) -> Vec<f32> {
        let after = self.times.partition_point(|&t| t <= time);
        if after == 0 || after == self.times.len() {
            return self.key(if after == 0 { 0 } else { after - 1 }, 1).to_vec();
        }
        let (a, b) = (after - 1, after);
        let span = self.times[b] - self.times[a];
        let t = if span > 0.0 { (time - self.times[a]) / span } else { 0.0 };
        let (va, vb) = (self.key(a, 1), self.key(b, 1));
        let mut out: Vec<f32> = match self.kind {
            Interpolation::Step => va.to_vec(),
            Interpolation::Linear if self.is_rotation => return slerp(va, vb, t),
            Interpolation::Linear => va.iter().zip(vb).map(|(a, b)| a + t * (b - a)).collect(),
            Interpolation::Cubic => {
                let (t2, t3) = (t * t, t * t * t);
                let (out_a, in_b) = (self.key(a, 2), self.key(b, 0));
                (0..self.width)
                    .map(|i| {
                        (2.0 * t3 - 3.0 * t2 + 1.0) * va[i]
                            + span * (t3 - 2.0 * t2 + t) * out_a[i]
                            + (3.0 * t2 - 2.0 * t3) * vb[i]
                            + span * (t3 - t2) * in_b[i]
                    })
                    .collect()
            }
        };
        if self.is_rotation {
            let l = out.iter().map(|v| v * v).sum::<f32>().sqrt();
            if l > 0.0 {
                out.iter_mut().for_each(|v| *v /= l);
            }
        }
        out
    }
}

/// The short way between two rotations.
fn slerp(a: &[f32], b: &[f32], t: f32) -> Vec<f32> {
    let dot: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let (dot, sign) = if dot < 0.0 { (-dot, -1.0) } else { (dot, 1.0) };
    let angle = safe_acos(dot);
    let (wa, wb) =
        if angle < 1e-3 { (1.0 - t, t) } else { (sin((1.0 - t) * angle) / sin(angle), sin(t * angle) / sin(angle)) };
    a.iter().zip(b).map(|(a, b)| wa * a + wb * sign * b).collect()
}

impl Gltf<'_, '_> {
    /// Puts the nodes where the animation has them, if a time was asked for.
    pub(super) fn animate(&mut self, options: &ModelOptions) -> Result<()> {
        let animations = self.root.list("animations")?;
        let Some(time) = options.time else {
            if !animations.is_empty() {
                self.approximate("animations are not played without --at SECONDS");
            }
            return Ok(());
        };
        let Some(animation) = animations.first() else { return Ok(()) };
        if animations.len() > 1 {
            self.approximate("the first of several animations is played");
        }
        let samplers = animation.list("samplers")?;
        for channel in animation.list("channels")? {
            let target = channel.need("target")?;
            let Some(node) = target.count("node")? else { continue };
            if node >= self.nodes.len() {
                let message = format!("refers to node {node}, but there are only {}", self.nodes.len());
                return Err(target.problem(message));
            }
            let index = channel.need("sampler")?.as_count()?;
            let Some(sampler) = samplers.get(index) else {
                return Err(
                    channel.problem(format!("refers to sampler {index}, but there are only {}", samplers.len()))
                );
            };
            let path = target.need("path")?.as_str()?;
            let Some(track) = self.track(sampler, path)? else {
                self.warn_once(path, &format!("animations of `{path}` are not played"));
                continue;
            };
            for (k, at) in [time, time + options.shutter].into_iter().enumerate() {
                apply(&mut self.locals[k][node], path, &track.at(at));
            }
        }
        Ok(())
    }

    fn track(&self, sampler: &Json, path: &str) -> Result<Option<Track>> {
        let input = self.accessor(sampler, "input")?;
        let times: Vec<f32> = input.floats::<1>()?.into_iter().map(|[t]| t).collect();
        if times.is_empty() || times.windows(2).any(|w| w[0] > w[1]) {
            return Err(input.problem("times of key frames must be there, and grow"));
        }
        let kind = match sampler.text("interpolation")?.unwrap_or("LINEAR") {
            "STEP" => Interpolation::Step,
            "LINEAR" => Interpolation::Linear,
            "CUBICSPLINE" => Interpolation::Cubic,
            other => return Err(sampler.need("interpolation")?.problem(format!("`{other}` is no interpolation"))),
        };
        let output = self.accessor(sampler, "output")?;
        let values: Vec<f32> = match path {
            "translation" | "scale" => output.floats::<3>()?.into_iter().flatten().collect(),
            "rotation" => output.floats::<4>()?.into_iter().flatten().collect(),
            "weights" => output.floats::<1>()?.into_iter().flatten().collect(),
            _ => return Ok(None),
        };
        let keys = times.len() * if kind == Interpolation::Cubic { 3 } else { 1 };
        if !values.len().is_multiple_of(keys) || values.is_empty() {
            return Err(output.problem(format!("{} numbers for {} key frames", values.len(), times.len())));
        }
        let (width, needed) = (values.len() / keys, output.width);
        if path != "weights" && width != needed {
            return Err(output.problem(format!("{} values for {} key frames", values.len() / needed, times.len())));
        }
        Ok(Some(Track { width, times, values, kind, is_rotation: path == "rotation" }))
    }
}

fn apply(local: &mut Local, path: &str, value: &[f32]) {
    fn put<const N: usize>(to: &mut [f32; N], from: &[f32]) {
        to.iter_mut().zip(from).for_each(|(t, f)| *t = *f);
    }
    match path {
        "translation" => put(&mut local.translation, value),
        "rotation" => put(&mut local.rotation, value),
        "scale" => put(&mut local.scale, value),
        _ => {
            local.weights = Some(value.to_vec());
            return;
        }
    }
    // A node with a matrix must not be animated; one that is has its parts.
    local.matrix = None;
}
