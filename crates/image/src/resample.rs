//! Enlarging an image to powers of two with a windowed sinc, and halving it with a box: what a mip pyramid is made of.
//!
//! Pharr, Jakob, Humphreys, "Physically Based Rendering" (4th edition), section 10.4.3.

use steradian_math::{PI, sin};

use crate::pyramid::Wrap;

/// Interleaved float texels, while a pyramid is being built.
#[derive(Clone)]
pub(crate) struct Floats {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    pub(crate) samples: Vec<f32>,
}

/// `sin(pi x) / (pi x)`.
pub(crate) fn sinc(x: f32) -> f32 {
    let y = PI * x;
    // Below this, 1 - y^2/6 rounds to 1.
    if y.abs() < 1e-4 { 1.0 } else { sin(y) / y }
}

/// The sinc function under a sinc window of half-width `tau`, zero beyond `radius`. The Lanczos filter has `tau = radius`.
pub(crate) fn windowed_sinc(x: f32, radius: f32, tau: f32) -> f32 {
    if x.abs() > radius { 0.0 } else { sinc(x) * sinc(x / tau) }
}

/// Four consecutive old samples that make one new one.
struct Tap {
    first: i64,
    weights: [f32; 4],
}

fn taps(old: usize, new: usize) -> Vec<Tap> {
    const RADIUS: f32 = 2.0;
    (0..new)
        .map(|i| {
            let center = (i as f32 + 0.5) * old as f32 / new as f32;
            let first = (center - RADIUS + 0.5).floor();
            let raw: [f32; 4] = std::array::from_fn(|j| windowed_sinc(first + j as f32 + 0.5 - center, RADIUS, RADIUS));
            let sum: f32 = raw.iter().sum();
            Tap { first: first as i64, weights: raw.map(|w| w / sum) }
        })
        .collect()
}

impl Floats {
    /// The same picture with `new_width >= width` columns and `new_height >= height` rows. The sinc's overshoots
    /// below zero are cut off, unless the picture itself is negative somewhere.
    pub(crate) fn enlarged(&self, new_width: usize, new_height: usize, wrap: [Wrap; 2]) -> Floats {
        let (w, h, n) = (self.width, self.height, self.channels);
        let (x_taps, y_taps) = (taps(w, new_width), taps(h, new_height));
        // Rows -2 ..= h + 1 of the source are resized in x, since a tap reaches at most two rows outside. This makes wrap modes
        // that tie x and y together (octahedral) come out right.
        let margin = 2_i64;
        let rows = h as i64 + 2 * margin;
        let mut wide = vec![0.0_f32; rows as usize * new_width * n];
        for (row, out) in wide.chunks_exact_mut(new_width * n).enumerate() {
            let y = row as i64 - margin;
            for (tap, pixel) in x_taps.iter().zip(out.chunks_exact_mut(n)) {
                for (j, weight) in tap.weights.iter().enumerate() {
                    if let Some((sx, sy)) = Wrap::remap(wrap, tap.first + j as i64, y, w, h) {
                        for c in 0..n {
                            pixel[c] += weight * self.samples[(sy * w + sx) * n + c];
                        }
                    }
                }
            }
        }
        let floor = self.samples.iter().fold(0.0, |low: f32, &v| low.min(v));
        let mut samples = Vec::with_capacity(new_width * new_height * n);
        for tap in &y_taps {
            let start = (tap.first + margin) as usize;
            for i in 0..new_width * n {
                let at = |j: usize| tap.weights[j] * wide[(start + j) * new_width * n + i];
                samples.push((at(0) + at(1) + at(2) + at(3)).max(floor));
            }
        }
        Floats { width: new_width, height: new_height, channels: n, samples }
    }

    /// Half the columns and rows, each texel the mean of four; a side of one texel stays so.
    pub(crate) fn halved(&self) -> Floats {
        let n = self.channels;
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let dx = if self.width == 1 { 0 } else { n };
        let dy = if self.height == 1 { 0 } else { self.width * n };
        let mut samples = Vec::with_capacity(width * height * n);
        for y in 0..height {
            for x in 0..width {
                for c in 0..n {
                    let i = 2 * y.min(self.height - 1) * self.width * n + 2 * x.min(self.width - 1) * n + c;
                    let s = &self.samples;
                    samples.push((s[i] + s[i + dx] + s[i + dy] + s[i + dx + dy]) * 0.25);
                }
            }
        }
        Floats { width, height, channels: n, samples }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_stays_constant() {
        let f = Floats { width: 5, height: 3, channels: 2, samples: [0.25, 4.0].repeat(15) };
        let big = f.enlarged(8, 4, [Wrap::Clamp, Wrap::Repeat]);
        assert_eq!(big.samples.len(), 64);
        for p in big.samples.chunks(2) {
            assert!((p[0] - 0.25).abs() < 1e-6 && (p[1] - 4.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_inside() {
        let f = Floats { width: 12, height: 1, channels: 1, samples: (0..12).map(|x| x as f32 + 0.5).collect() };
        let big = f.enlarged(16, 1, [Wrap::Clamp, Wrap::Clamp]);
        for x in 3..13 {
            let want = (x as f32 + 0.5) * 12.0 / 16.0;
            assert!((big.samples[x] - want).abs() < 0.03, "{x}: {} for {want}", big.samples[x]);
        }
    }

    #[test]
    fn halving_keeps_the_mean() {
        let f = Floats { width: 4, height: 2, channels: 1, samples: vec![1.0, 3.0, 5.0, 7.0, 2.0, 2.0, 0.0, 4.0] };
        let half = f.halved();
        assert_eq!((half.width, half.height, half.samples.as_slice()), (2, 1, [2.0, 4.0].as_slice()));
        assert_eq!(half.halved().samples, [3.0]);
    }
}
