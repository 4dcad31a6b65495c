//! How noisy the difference of two estimates is, per pixel and per block.

use super::{
    Settings,
    estimate::{Estimate, Planes},
    statistics::{Spread, mean_and_variance},
};

/// Channels that are tested: R, G, B, and their mean, in which errors that all three share stand out.
pub(super) const CHANNELS: usize = 4;

/// Four planes.
pub(super) type Quads = [Vec<f64>; CHANNELS];

/// The two images and their difference, ready for the tests.
pub(super) struct Pair {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Reference.
    pub(super) reference: Quads,
    /// Candidate minus reference.
    pub(super) difference: Quads,
    /// Variance that is always granted: numbers this much smaller than the picture mean nothing.
    pub(super) floor: f64,
    /// Where error bars of blocks come from.
    source: Source,
    /// Variance of the difference at a pixel, for the channels R, G, B, and its degrees of freedom.
    pixel: Planes,
    pixel_dof: Vec<f64>,
    /// By how much the noise that was assumed had to be raised to fit what is seen. 1 where the noise is known.
    pub(super) noise_scale: f64,
}

enum Source {
    /// Both variances are known: one part per image.
    Known(Vec<Part>),
    /// At least one is not: the scatter of the difference inside each block says it.
    Scatter,
}

struct Part {
    variance: Quads,
    dof: f64,
    seeds: Vec<Quads>,
}

/// A rectangle of pixels.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Pair {
    pub(super) fn new(reference: &Estimate, candidate: &Estimate, settings: &Settings) -> Pair {
        let (width, height) = (reference.width, reference.height);
        let with_mean = |p: &Planes| {
            let mean = (0..width * height).map(|i| (p[0][i] + p[1][i] + p[2][i]) / 3.0).collect();
            let [r, g, b] = p.clone();
            [r, g, b, mean]
        };
        let r = with_mean(&reference.mean);
        let c = with_mean(&candidate.mean);
        let difference: Quads = std::array::from_fn(|k| c[k].iter().zip(&r[k]).map(|(c, r)| c - r).collect());
        let level = r[..3].iter().flatten().map(|v| v.abs()).sum::<f64>() / (3 * width * height) as f64 + 1e-12;
        let mut pair = Pair {
            width,
            height,
            reference: r,
            difference,
            floor: (2e-4 * level) * (2e-4 * level),
            source: Source::Scatter,
            pixel: Default::default(),
            pixel_dof: Vec::new(),
            noise_scale: 1.0,
        };
        match (reference.guarded_variance(), candidate.guarded_variance()) {
            (Some(a), Some(b)) => pair.use_known([(a, reference), (b, candidate)], with_mean),
            (Some(v), None) => {
                pair.use_pattern(v, reference.dof, 1.0 + settings.candidate_to_reference_variance.unwrap_or(0.0))
            }
            (None, Some(v)) => pair.use_pattern(v, candidate.dof, 1.0),
            (None, None) => pair.use_scatter(),
        }
        pair
    }

    /// Whether the candidate's noise was measured rather than inferred from the difference.
    pub(super) fn noise_is_known(&self) -> bool {
        matches!(self.source, Source::Known(_))
    }

    fn use_known(&mut self, sides: [(Planes, &Estimate); 2], with_mean: impl Fn(&Planes) -> Quads) {
        let spreads =
            |i: usize, c: usize| Spread::sum(sides.iter().map(|(v, e)| Spread { variance: v[c][i], dof: e.dof }));
        let n = self.width * self.height;
        for c in 0..3 {
            self.pixel[c] = (0..n).map(|i| spreads(i, c).variance).collect();
            self.pixel_dof.extend((0..n).map(|i| spreads(i, c).dof));
        }
        let parts = sides.iter().map(|(v, e)| {
            // The channels of a pixel rise and fall together, so the standard deviation of their mean is the mean of theirs.
            let mut variance = with_mean(&v.each_ref().map(|p| p.iter().map(|v| v.sqrt()).collect()));
            for v in variance.iter_mut().flatten() {
                *v *= *v;
            }
            Part { variance, dof: e.dof, seeds: e.seeds.iter().map(&with_mean).collect() }
        });
        self.source = Source::Known(parts.collect());
    }

    /// One image's variance gives the pattern of the noise over the picture; the strength is `factor`, or more if the difference
    /// shows more. The median is not moved by errors in less than half the picture.
    fn use_pattern(&mut self, variance: Planes, dof: f64, factor: f64) {
        let mut ratios: Vec<f64> = Vec::new();
        for c in 0..3 {
            for (d, &v) in self.difference[c].iter().zip(&variance[c]).filter(|(_, v)| **v > self.floor) {
                ratios.push(d * d / (v * factor + self.floor));
            }
        }
        /// Median of a squared Student variable of 15 degrees of freedom, and hardly another for more or fewer.
        const MEDIAN: f64 = 0.4705;
        ratios.sort_unstable_by(f64::total_cmp);
        self.noise_scale = ratios.get(ratios.len() / 2).map_or(1.0, |m| (m / MEDIAN).max(1.0));
        let scale = factor * self.noise_scale;
        self.pixel = variance.map(|p| p.into_iter().map(|v| v * scale).collect());
        self.pixel_dof = vec![dof; 3 * self.width * self.height];
    }

    /// Nothing is known: a pixel is as noisy as the block of 8 x 8 around it is scattered.
    fn use_scatter(&mut self) {
        let n = self.width * self.height;
        self.pixel = std::array::from_fn(|_| vec![0.0; n]);
        self.pixel_dof = vec![1.0; 3 * n];
        for block in self.blocks(8) {
            for c in 0..3 {
                let values = self.pixels(block).map(|i| self.difference[c][i]);
                let (_, v) = mean_and_variance(values);
                let inside: Vec<usize> = self.pixels(block).collect();
                for &i in &inside {
                    self.pixel[c][i] = v;
                    self.pixel_dof[c * n + i] = (inside.len() as f64 - 1.0).max(1.0);
                }
            }
        }
    }

    /// The picture cut into squares, those at the right and lower border clipped.
    pub(super) fn blocks(&self, size: usize) -> Vec<Block> {
        let mut out = Vec::new();
        for y in (0..self.height).step_by(size) {
            for x in (0..self.width).step_by(size) {
                out.push(Block { x, y, width: size.min(self.width - x), height: size.min(self.height - y) });
            }
        }
        out
    }

    /// Indices of a block's pixels.
    pub(super) fn pixels(&self, b: Block) -> impl Iterator<Item = usize> + Clone + use<> {
        let width = self.width;
        (b.y..b.y + b.height).flat_map(move |y| (b.x..b.x + b.width).map(move |x| y * width + x))
    }

    /// Spread of the mean difference over a block in one of the four channels.
    pub(super) fn block_spread(&self, block: Block, channel: usize) -> Spread {
        let n = (block.width * block.height) as f64;
        match &self.source {
            Source::Known(parts) => Spread::sum(parts.iter().map(|part| {
                let pixels = self.pixels(block).map(|i| Spread { variance: part.variance[channel][i], dof: part.dof });
                let spread = Spread::sum(pixels).over(n);
                if part.seeds.is_empty() {
                    return spread;
                }
                // Whole renderings also show noise that neighbouring pixels share, which wide filters and splatting cause.
                let means = part.seeds.iter().map(|s| self.pixels(block).map(|i| s[channel][i]).sum::<f64>() / n);
                let count = part.seeds.len() as f64;
                let seen = mean_and_variance(means).1 / count;
                Spread { variance: seen.max(0.5 * spread.variance), dof: count - 1.0 }
            })),
            Source::Scatter => {
                let (_, v) = mean_and_variance(self.pixels(block).map(|i| self.difference[channel][i]));
                Spread { variance: v / n, dof: (n - 1.0).max(1.0) }
            }
        }
    }

    /// Spread of the difference at a pixel in R, G or B, with the floor.
    pub(super) fn pixel_spread(&self, i: usize, channel: usize) -> Spread {
        let dof = self.pixel_dof[channel * self.width * self.height + i];
        Spread { variance: self.pixel[channel][i] + self.floor, dof }
    }
}
