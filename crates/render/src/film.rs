//! The film: tiles of pixel sums, and the image that they amount to.

use crate::chains::Chains;
use crate::fault::{BadSample, Fault};
use crate::splats::Splats;
use crate::sums::{Node, PixelStack, PixelSum, add_layers};
use steradian_integrator::record::RayCounts;

/// Width and height of a tile. Part of no result but an adaptive one, whose sample counts are those of tiles.
pub const TILE_SIZE: u32 = 16;

/// The same where the noise decides how many samples each tile gets, and no error is promised.
pub const NOISE_TILE_SIZE: u32 = 8;

/// The same where contrast decides: edges are thin.
pub const FINE_TILE_SIZE: u32 = 4;

/// So many bad samples of a tile are remembered, and as many of the film.
pub(crate) const REMEMBERED: usize = 16;

/// A rectangle of pixels, with the partial sums of a range of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// First pixel in x and y, in the full image.
    pub origin: [u32; 2],
    /// Width and height.
    pub size: [u32; 2],
    /// The first sample of every pixel; 0 but for the part of a distributed render.
    pub first: u32,
    /// The sample after the last.
    pub end: u32,
    /// Rays traced.
    pub rays: RayCounts,
    /// The first samples that went wrong.
    pub bad: Vec<BadSample>,
    /// How many went wrong in all.
    pub bad_count: u64,
    /// For each node of the range, its sums.
    pub(crate) nodes: Vec<TileNode>,
    /// So many colours besides its own has each pixel.
    pub(crate) layers: usize,
}

/// The sums over the samples of one node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TileNode {
    pub node: Node,
    /// One for each pixel.
    pub sums: Vec<PixelSum>,
    /// For each pixel, one for each layer.
    pub layers: Vec<[f32; 3]>,
}

impl Tile {
    pub(crate) fn new(origin: [u32; 2], size: [u32; 2], layers: usize) -> Self {
        Self {
            origin,
            size,
            first: 0,
            end: 0,
            rays: RayCounts::default(),
            bad: Vec::new(),
            bad_count: 0,
            nodes: Vec::new(),
            layers,
        }
    }

    /// Forgets all samples before number `first`, which is where the next ones begin; does nothing to a tile that has none of them.
    pub(crate) fn begin_at(&mut self, first: u32) {
        if self.samples() == 0 || self.first < first {
            (self.first, self.end) = (first, first);
            self.nodes.clear();
        }
    }

    /// The number of pixels.
    pub fn len(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }

    /// Whether the tile has no pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Samples taken in every pixel.
    pub fn samples(&self) -> u32 {
        self.end - self.first
    }

    /// The position of pixel `i` in the full image.
    pub fn pixel(&self, i: usize) -> [u32; 2] {
        let i = i as u32;
        [self.origin[0] + i % self.size[0], self.origin[1] + i / self.size[0]]
    }

    /// Adds samples `self.end .. end` to every pixel: `fill(pixel, range, stack)` pushes them in order.
    pub fn extend(&mut self, end: u32, mut fill: impl FnMut([u32; 2], std::ops::Range<u32>, &mut PixelStack)) {
        let begin = self.end;
        if end <= begin {
            return;
        }
        let width = self.layers;
        let mut stack = PixelStack::new(begin, width);
        let mut fresh: Vec<TileNode> = Vec::new();
        for i in 0..self.len() {
            stack.resume(begin, self.nodes.iter().map(|n| (n.node, n.sums[i], &n.layers[i * width..(i + 1) * width])));
            fill(self.pixel(i), begin..end, &mut stack);
            if i == 0 {
                let sums = vec![PixelSum::default(); self.len()];
                let room = |node| TileNode { node, sums: sums.clone(), layers: Vec::with_capacity(self.len() * width) };
                fresh = stack.nodes().map(|(node, ..)| room(node)).collect();
            }
            for (at, (_, sum, layers)) in fresh.iter_mut().zip(stack.nodes()) {
                at.sums[i] = sum;
                at.layers.extend_from_slice(layers);
            }
        }
        self.nodes = fresh;
        self.end = end;
    }

    /// The sum over all samples of pixel `i`, joined from small to large.
    pub fn sum(&self, i: usize) -> PixelSum {
        self.nodes.iter().rev().map(|n| n.sums[i]).reduce(|a, b| b.add(&a)).unwrap_or_default()
    }

    /// And that of its layers.
    pub fn layer_sums(&self, i: usize) -> Vec<[f32; 3]> {
        let of = |n: &TileNode| n.layers[i * self.layers..(i + 1) * self.layers].to_vec();
        let join = |right: Vec<[f32; 3]>, mut left: Vec<[f32; 3]>| {
            add_layers(&mut left, &right);
            left
        };
        self.nodes.iter().rev().map(of).reduce(join).unwrap_or_else(|| vec![[0.0; 3]; self.layers])
    }

    /// Notes what went wrong, by place, not by time: the report is the same for any number of threads.
    pub(crate) fn remember(&mut self, mut bad: Vec<BadSample>, count: u64) {
        self.bad_count += count;
        self.bad.append(&mut bad);
        sort_bad(&mut self.bad);
    }

    /// Joins the samples that follow on this tile's, taken elsewhere. `false` if they do not follow.
    pub(crate) fn append(&mut self, next: &Tile) -> bool {
        let fits = next.first == self.end && next.layers == self.layers;
        if !fits || next.origin != self.origin || next.size != self.size {
            return false;
        }
        for right in &next.nodes {
            let mut right = right.clone();
            while let Some(joined) = self.nodes.last().and_then(|left| right.node.join(&left.node))
                && let Some(mut left) = self.nodes.pop()
            {
                left.sums.iter_mut().zip(&right.sums).for_each(|(left, right)| *left = left.add(right));
                add_layers(&mut left.layers, &right.layers);
                right = TileNode { node: joined, ..left };
            }
            self.nodes.push(right);
        }
        self.end = next.end;
        self.rays.merge(&next.rays);
        self.remember(next.bad.clone(), next.bad_count);
        true
    }
}

/// Keeps the first few.
pub(crate) fn sort_bad(bad: &mut Vec<BadSample>) {
    bad.sort_by_key(|b| (b.sample, b.pixel[1], b.pixel[0]));
    bad.truncate(REMEMBERED);
}

/// The pixels of the rendered part of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// x0, x1, y0, y1 in the full image, the ends excluded.
    pub bounds: [u32; 4],
    /// The tiles, row by row.
    pub tiles: Vec<Tile>,
    /// Light that samples of one pixel bring to others, for algorithms that do that.
    pub splats: Option<Splats>,
    /// Where the chains of Metropolis light transport stand.
    pub chains: Option<Chains>,
    /// Width and height of a tile, but for those at the right and the lower edge.
    pub(crate) tile_size: u32,
}

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: [f32; 3],
    /// The estimated variance of the mean; infinite for fewer than two samples.
    pub variance: [f32; 3],
    /// Samples taken.
    pub samples: u32,
}

impl Film {
    /// An empty film.
    pub fn new(bounds: [u32; 4]) -> Self {
        Self::with_tiles(bounds, TILE_SIZE, 0)
    }

    /// An empty film with tiles of a given size, one at least, whose pixels have so many colours besides their own.
    pub(crate) fn with_tiles(bounds: [u32; 4], tile_size: u32, layers: usize) -> Self {
        let [x0, x1, y0, y1] = bounds;
        let mut tiles = Vec::new();
        for y in (y0..y1).step_by(tile_size as usize) {
            for x in (x0..x1).step_by(tile_size as usize) {
                tiles.push(Tile::new([x, y], [tile_size.min(x1 - x), tile_size.min(y1 - y)], layers));
            }
        }
        Self { bounds, tiles, splats: None, chains: None, tile_size }
    }

    /// How many colours each pixel has besides its own.
    pub fn layers(&self) -> usize {
        self.tiles.first().map_or(0, |t| t.layers)
    }

    /// Width and height of the rendered part.
    pub fn size(&self) -> [usize; 2] {
        let [x0, x1, y0, y1] = self.bounds;
        [(x1 - x0) as usize, (y1 - y0) as usize]
    }

    /// Columns and rows of tiles.
    pub fn grid(&self) -> [usize; 2] {
        self.size().map(|n| n.div_ceil(self.tile_size as usize))
    }

    /// One value for each pixel, row by row, from what is known of it.
    pub fn map<T: Clone + Default>(&self, mut f: impl FnMut(&Estimate) -> T) -> Vec<T> {
        let [width, height] = self.size();
        let total = self.total_samples();
        let mut out = vec![T::default(); width * height];
        for tile in &self.tiles {
            for i in 0..tile.len() {
                let [x, y] = tile.pixel(i);
                let at = (y - self.bounds[2]) as usize * width + (x - self.bounds[0]) as usize;
                let (sum, n) = (tile.sum(i), tile.samples());
                let mut e = Estimate { mean: sum.mean(n), variance: sum.variance_of_mean(n), samples: n };
                if let Some(splats) = &self.splats {
                    let [mean, variance] = splats.estimate(at, total);
                    for c in 0..3 {
                        e.mean[c] = (f64::from(e.mean[c]) + mean[c]) as f32;
                        e.variance[c] = (f64::from(e.variance[c]) + variance[c]) as f32;
                    }
                    if self.chains.is_some() {
                        // The steps of a chain are no independent samples.
                        e.variance = [f32::INFINITY; 3];
                    }
                }
                out[at] = f(&e);
            }
        }
        out
    }

    /// The means of each pixel's layers, row by row.
    pub fn layer_means(&self) -> Vec<Vec<[f32; 3]>> {
        let [width, height] = self.size();
        let mut out = vec![Vec::new(); width * height];
        for tile in &self.tiles {
            let scale = if tile.samples() == 0 { 0.0 } else { 1.0 / tile.samples() as f32 };
            for i in 0..tile.len() {
                let [x, y] = tile.pixel(i);
                let at = (y - self.bounds[2]) as usize * width + (x - self.bounds[0]) as usize;
                out[at] = tile.layer_sums(i).into_iter().map(|sum| sum.map(|v| v * scale)).collect();
            }
        }
        out
    }

    /// The mean of each pixel.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        self.map(|e| e.mean)
    }

    /// The variance of the mean of each pixel.
    pub fn variance(&self) -> Vec<[f32; 3]> {
        self.map(|e| e.variance)
    }

    /// The least and the greatest number of samples in a pixel.
    pub fn samples(&self) -> [u32; 2] {
        let all = || self.tiles.iter().map(Tile::samples);
        [all().min().unwrap_or(0), all().max().unwrap_or(0)]
    }

    /// Samples in all pixels together.
    pub fn total_samples(&self) -> u64 {
        self.tiles.iter().map(|t| t.len() as u64 * u64::from(t.samples())).sum()
    }

    /// Samples per pixel, on average.
    pub fn average_samples(&self) -> f64 {
        let [w, h] = self.size();
        self.total_samples() as f64 / ((w * h) as f64).max(1.0)
    }

    /// Rays traced.
    pub fn rays(&self) -> RayCounts {
        let mut sum = RayCounts::default();
        self.tiles.iter().for_each(|t| sum.merge(&t.rays));
        self.chains.iter().for_each(|c| sum.merge(&c.rays()));
        sum
    }

    /// The first samples that went wrong, in the order of samples and pixels, and how many did in all.
    pub fn bad(&self) -> (Vec<BadSample>, u64) {
        let mut bad: Vec<_> = self.tiles.iter().flat_map(|t| t.bad.iter().cloned()).collect();
        let in_chains = self.chains.as_ref().map_or(0, Chains::bad_count);
        if in_chains > 0 {
            // A chain goes through all pixels: there is no place to tell.
            let [x, _, y, _] = self.bounds;
            bad.push(BadSample { pixel: [x, y], sample: 0, fault: Fault::NotFinite });
        }
        sort_bad(&mut bad);
        (bad, self.tiles.iter().map(|t| t.bad_count).sum::<u64>() + in_chains)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(pixel: [u32; 2], sample: u32) -> [f32; 3] {
        [(pixel[0] * 7 + sample) as f32 * 0.1, 1.0 / (1 + pixel[1] + sample) as f32, sample as f32]
    }

    #[test]
    fn tiles_cover_the_crop_once() {
        let film = Film::new([3, 40, 5, 25]);
        let total: usize = film.tiles.iter().map(Tile::len).sum();
        assert_eq!(total, 37 * 20);
        assert_eq!(film.grid(), [3, 2]);
    }

    #[test]
    fn passes_of_any_size_give_the_same_image() {
        let run = |ends: &[u32]| {
            let mut film = Film::new([0, 20, 0, 18]);
            for &end in ends {
                for tile in &mut film.tiles {
                    tile.extend(end, |p, range, stack| range.for_each(|s| stack.push(PixelSum::of(value(p, s)))));
                }
            }
            (0..film.tiles.len()).map(|t| film.tiles[t].nodes.clone()).collect::<Vec<_>>()
        };
        let whole = run(&[100]);
        assert_eq!(whole, run(&[1, 2, 4, 8, 50, 99, 100]));
        assert_eq!(whole[0].iter().map(|n| n.sums[0].rgb[2]).sum::<f32>(), (0..100).sum::<u32>() as f32);
    }
}
